//! The truth pinned by closed forms: each mean within 3 standard errors and within 0.5 %.

mod common;

use core::f64::consts::PI;

use common::*;
use glam::{Vec2, Vec3};
use indirect_core::{LightKind, View, form_factor};
use reference_pathtracer::{Bounces, Components, EmitterSampling, PixelFilter, Settings, VirtualLights};

/// Direct light of punctual lights at pixel centres has no noise: every pixel within rounding.
#[test]
fn punctual_lights_over_a_plane() {
    let (albedo, power, height) = (0.6_f32, 7.0_f32, 2.0_f32);
    let position = Vec3::Y * height;
    let tilted = Vec3::new(0.4, -1.0, 0.2).normalize();
    let kinds = [
        LightKind::Point { position },
        LightKind::Spot { position, direction: tilted, inner_angle: 0.3, outer_angle: 0.7 },
        LightKind::Directional { direction: tilted },
    ];
    let size = [31, 31];
    let view = onto(Vec3::ZERO, Vec3::NEG_Y, Vec3::NEG_Z, 1.5, 1.0);
    for kind in kinds {
        let mut scene = floor(5.0, albedo);
        scene.lights.push(light(kind, power));
        let e = run(&scene, &view, size, &samples(1, 1));
        for (i, value) in e.direct.pixels.iter().enumerate() {
            let pixel = Vec2::new((i as u32 % size[0]) as f32, (i as u32 / size[0]) as f32) + 0.5;
            let p = view.ray(pixel, size).at(1.0);
            let irradiance = match kind {
                LightKind::Directional { direction } => -power * direction.y,
                LightKind::Point { .. } => power * height / p.distance(position).powi(3),
                LightKind::Spot { direction, inner_angle, outer_angle, .. } => {
                    let cos = (p - position).normalize().dot(direction);
                    let ramp = (cos - outer_angle.cos()) / (inner_angle.cos() - outer_angle.cos());
                    power * ramp.clamp(0.0, 1.0).powi(2) * height / p.distance(position).powi(3)
                }
            };
            let expected = albedo / core::f32::consts::PI * irradiance;
            // Rounding of the cosine is stretched by the spot's ramp: 2⁻²³/(cos 0.3 − cos 0.7) of the whole scale.
            assert!(
                (value.x - expected).abs() <= 1e-5 * expected + 1e-6 * power,
                "{kind:?} {i} {value} {expected}"
            );
        }
        // A lone plane sends itself nothing.
        assert_eq!(
            e.indirect.non_finite() + e.indirect.pixels.iter().filter(|p| **p != Vec3::ZERO).count(),
            0
        );
        // The box filter averages the same function.
        let filtered = Settings { pixel_filter: PixelFilter::Box, ..samples(16, 16) };
        let boxed = run(&scene, &view, size, &filtered);
        let fine = run(&scene, &view, [310, 310], &samples(1, 1));
        assert_closed_form("box filter", boxed.mean()[0], fine.mean()[0].value, 1e-5);
    }
}

/// A polyhedron's facets see the light at distances from cos δ to 1, δ = 0.78/steps its facets' angular radius, and nearly
/// straight on: the irradiance varies by δ² about its mean, which is 4πI/A exactly, bounce by bounce.
#[test]
fn sphere_with_a_light_at_its_centre() {
    let steps = 32;
    let delta2 = (0.78 / f64::from(steps)).powi(2);
    let (off, on) = (VirtualLights::Off, VirtualLights::On);
    for (albedo, smooth, virtual_lights) in [
        (0.1_f32, false, off),
        (0.5, false, off),
        (0.5, true, on),
        (0.9, false, off),
        (0.9, true, off),
        (0.99, false, off),
    ] {
        let mut scene = sphere(steps, smooth, material(albedo));
        scene.lights.push(light(LightKind::Point { position: Vec3::ZERO }, 3.0));
        // Radiance of a mean irradiance E.
        let (rho, e) = (f64::from(albedo), 4.0 * PI * 3.0 / total_area(&scene));
        let unit = rho / PI * e;
        let view = wide(Vec3::ZERO, Vec3::new(0.3, 0.5, 0.8));
        let settings = |bounces| Settings {
            bounces,
            virtual_lights,
            ..samples(if virtual_lights == on { 32 } else { 8 }, 32)
        };
        let what = format!("sphere, albedo {albedo}, smooth {smooth}, virtual lights {virtual_lights:?}");
        let [direct, indirect] = run(&scene, &view, [24, 24], &settings(Bounces::Infinite)).mean();
        assert_closed_form(&format!("{what}: direct"), direct, unit, 2.0 * delta2);
        let expected = unit * rho / (1.0 - rho);
        assert_closed_form(&format!("{what}: indirect"), indirect, expected, 2.0 * delta2);
        // k bounces are the partial sum of the geometric series.
        for k in [1, 2, 5] {
            let [_, indirect] = run(&scene, &view, [24, 24], &settings(Bounces::Count(k))).mean();
            let expected = unit * (1..=k).map(|i| rho.powi(i as i32)).sum::<f64>();
            assert_closed_form(&format!("{what}: {k} bounces"), indirect, expected, 2.0 * delta2);
        }
    }
}

/// A closed furnace: every wall emits L_e and reflects ρ, so L = L_e/(1 − ρ) at every point, whatever the shape, the normals
/// or the way emitters are sampled. The coarse smooth sphere has normals 16° off its facets'.
#[test]
fn closed_furnace() {
    for albedo in [0.0_f32, 0.5, 0.9] {
        for (name, scene) in [
            ("fine", sphere(12, false, emitter(albedo, 2.0))),
            ("coarse smooth", sphere(2, true, emitter(albedo, 2.0))),
        ] {
            for (emitters, virtual_lights) in [
                (EmitterSampling::Mis, VirtualLights::Off),
                (EmitterSampling::Mis, VirtualLights::On),
                (EmitterSampling::Surface, VirtualLights::Off),
            ] {
                // Light paths have unbounded weights where interpolated normals lean far off: right in the mean, but slowly.
                let shared = virtual_lights == VirtualLights::On;
                if shared && (albedo != 0.5 || name != "fine") {
                    continue;
                }
                let rho = f64::from(albedo);
                let view = wide(Vec3::splat(0.1), Vec3::new(-0.3, 0.2, 0.9));
                let s = Settings { emitters, virtual_lights, ..samples(if shared { 64 } else { 4 }, 32) };
                let [direct, indirect] = run(&scene, &view, [24, 24], &s).mean();
                let what = format!(
                    "furnace {name}, albedo {albedo}, {emitters:?}, virtual lights {virtual_lights:?}"
                );
                assert_closed_form(&format!("{what}: direct"), direct, 2.0 * (1.0 + rho), 0.0);
                if albedo == 0.0 {
                    assert_eq!(indirect.value, 0.0);
                    continue;
                }
                let expected = 2.0 * (1.0 / (1.0 - rho) - 1.0 - rho);
                assert_closed_form(&format!("{what}: indirect"), indirect, expected, 0.0);
                let s = Settings { bounces: Bounces::Count(3), ..s };
                let [_, indirect] = run(&scene, &view, [24, 24], &s).mean();
                let expected = 2.0 * (2..=4).map(|i| rho.powi(i)).sum::<f64>();
                assert_closed_form(&format!("{what}: 3 bounces"), indirect, expected, 0.0);
            }
        }
    }
}

/// Mean irradiance on one square from the other, which emits L: E = πL·F.
#[test]
fn form_factors_of_squares() {
    let (radiance, albedo) = (3.0_f32, 0.5_f32);
    let unit = f64::from(radiance * albedo);
    let check = |what: &str, emitting: &[Vec3], view: &View, receiver: &[Vec3], f: f64| {
        let mut scene = floor(1.0, albedo);
        scene.mesh = indirect_core::Mesh::default();
        scene.materials.push(emitter(0.0, radiance));
        scene.mesh.push_polygon(receiver, 0);
        scene.mesh.push_polygon(emitting, 1);
        for emitters in [EmitterSampling::Mis, EmitterSampling::Light, EmitterSampling::Surface] {
            // A far square is met by one direction in 60.
            let spp = if emitters == EmitterSampling::Surface { 256 } else { 32 };
            let s = Settings {
                pixel_filter: PixelFilter::Box,
                components: Components::Direct,
                emitters,
                ..samples(spp, 32)
            };
            let [direct, _] = run(&scene, view, [32, 32], &s).mean();
            assert_closed_form(&format!("{what}, {emitters:?}"), direct, unit * f, 0.0);
        }
    };
    let square = rectangle(Vec3::ZERO, Vec3::Z * 0.5, Vec3::X * 0.5);
    let down = |d: f32| onto(Vec3::ZERO, Vec3::NEG_Y, Vec3::NEG_Z, 0.5, d);
    for d in [0.25_f32, 1.0, 4.0] {
        let above = rectangle(Vec3::Y * d, Vec3::X * 0.5, Vec3::Z * 0.5);
        let f = form_factor::parallel_squares(1.0, f64::from(d));
        check(&format!("parallel squares at {d}"), &above, &down(0.1), &square, f);
    }
    let wall = rectangle(Vec3::new(0.0, 0.5, -0.5), Vec3::X * 0.5, Vec3::Y * 0.5);
    check("perpendicular squares", &wall, &down(0.1), &square, form_factor::perpendicular_squares());
}

/// Per pixel against Lambert's exact polygon formula: the squared z-scores of n pixels sum to about n.
#[test]
fn polygon_against_lambert() {
    let (radiance, albedo) = (3.0_f32, 0.5_f32);
    let corners = [(0.1, 0.0), (0.8, 0.2), (0.9, 0.7), (0.4, 1.0), (0.0, 0.6)].map(|(a, b): (f32, f32)| {
        Vec3::new(0.2, 0.4, 0.1) + Vec3::new(0.9, 0.3, 0.0) * a + Vec3::new(0.1, -0.5, 0.8) * b
    });
    let corners: Vec<_> = if (corners[1] - corners[0]).cross(corners[2] - corners[0]).y < 0.0 {
        corners.to_vec()
    } else {
        corners.iter().rev().copied().collect()
    };
    let mut scene = floor(1.5, albedo);
    scene.materials.push(emitter(0.0, radiance));
    scene.mesh.push_polygon(&corners, 1);
    let view = onto(Vec3::new(0.3, 0.0, 0.3), Vec3::NEG_Y, Vec3::NEG_Z, 1.0, 0.01);
    let size = [16, 16];
    let s = Settings { components: Components::Direct, ..samples(32, 32) };
    let r = run(&scene, &view, size, &s);
    let (mut chi2, mut n, mut worst) = (0.0, 0.0, 0.0_f64);
    for (i, (value, variance)) in r.direct.pixels.iter().zip(&r.direct_variance.pixels).enumerate() {
        let pixel = Vec2::new((i as u32 % size[0]) as f32, (i as u32 / size[0]) as f32) + 0.5;
        let p = view.ray(pixel, size).at(0.01);
        let expected = f64::from(radiance * albedo * form_factor::point_to_polygon(p, Vec3::Y, &corners));
        // In the polygon's shadow of itself and where it is not seen both are 0; rounding is not noise.
        let error = f64::from(variance.x).sqrt().max(1e-6 * expected);
        let z = if value.x == 0.0 && expected == 0.0 {
            continue;
        } else {
            (f64::from(value.x) - expected) / error
        };
        chi2 += z * z;
        n += 1.0;
        worst = worst.max(z.abs());
    }
    println!("polygon: χ²/n {:.3}, worst z {worst:.2}", chi2 / n);
    // Student's t with 31 degrees of freedom: E z² = 31/29; its variance 2·(31²·30)/(29²·27) = 2.54 per pixel. 4 standard deviations.
    assert!((chi2 / n - 31.0 / 29.0).abs() < 4.0 * (2.54_f64 / n).sqrt(), "{chi2} of {n}");
    // Šidák over 256 pixels at 1 %: |t₃₁| < 4.8.
    assert!(worst < 4.8);
}
