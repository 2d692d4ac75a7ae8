//! Irradiance at points: closed forms, and what images see of the same surfaces.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use core::f32::consts::PI;

use common::*;
use glam::Vec3;
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::{LightKind, Scene, form_factor::point_to_polygon};
use reference_pathtracer::{
    Bounces, Components, Error, Estimate, Samples, Settings, VirtualLights, irradiance, render,
};

fn at(scene: &Scene, points: &[Vec3], normals: &[Vec3], settings: &Settings) -> Estimate {
    irradiance(&Accel::build(scene, BuildPreset::Fast), points, normals, settings).unwrap()
}

#[test]
fn punctual_lights_are_exact_on_black_surfaces_and_in_the_air() {
    let mut scene = floor(5.0, 0.0);
    let position = Vec3::new(0.0, 2.0, 0.0);
    scene.lights.push(light(LightKind::Point { position }, 7.0));
    let up = Vec3::Y;
    let tilted = Vec3::new(0.6, 0.8, 0.0);
    let points = [Vec3::ZERO, Vec3::X, Vec3::new(0.0, 1.0, 0.0), Vec3::Z, Vec3::ZERO];
    let normals = [up, 3.0 * up, up, tilted, -up];
    let e = at(&scene, &points, &normals, &samples(1, 2));
    for (i, (p, n)) in points.iter().zip(normals).enumerate() {
        let d = position - *p;
        let cos = d.normalize().dot(n.normalize()).max(0.0);
        let expected = 7.0 * cos / d.length_squared();
        let found = e.direct.pixels[i].x;
        assert!((found - expected).abs() <= 2e-5 * expected, "{i}: {found} for {expected}");
        assert!(e.surface[i]);
    }
    // A black floor reflects nothing.
    assert!(e.indirect.pixels.iter().all(|p| *p == Vec3::ZERO));
}

#[test]
fn an_emissive_panel_sends_its_form_factor() {
    let mut scene = Scene { materials: vec![emitter(0.0, 5.0)], ..Scene::default() };
    let panel = rectangle(Vec3::new(0.3, 1.0, 0.2), Vec3::X * 0.5, Vec3::Z * 0.4);
    scene.mesh.push_polygon(&panel, 0);
    let points = [Vec3::ZERO, Vec3::new(1.0, 0.2, 0.0), Vec3::new(0.3, 0.95, 0.2)];
    let normals = [Vec3::Y, Vec3::new(-0.6, 0.8, 0.0), Vec3::Y];
    let e = at(&scene, &points, &normals, &samples(64, 16));
    for i in 0..points.len() {
        let expected = PI * 5.0 * point_to_polygon(points[i], normals[i], &panel);
        let (found, error) = (e.direct.pixels[i].x, e.direct_variance.pixels[i].x.sqrt());
        // Four standard errors of a mean of 16 batches, and the closed form's own rounding.
        let sound = |found: f32| (found - expected).abs() <= 4.0 * error + 1e-5 * expected;
        assert!(sound(found), "{i}: {found} ± {error} for {expected}");
        assert!(!sound(found * 1.05) && error < 0.01 * expected, "{i}: 5 % would pass at ± {error}");
    }
}

#[test]
fn what_arrives_at_a_pixel_leaves_it_by_its_albedo() {
    let scene = room(true);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let (view, size) = (room_view(), [24, 24]);
    for bounces in [Bounces::Count(1), Bounces::Infinite] {
        let settings = Settings { bounces, virtual_lights: VirtualLights::Off, ..samples(32, 32) };
        let image = render(&accel, &view, size, &settings).unwrap();
        let seen = cast::gbuffer(&accel, &view, size);
        let other = Settings { seed: 7, ..settings };
        let points = irradiance(&accel, &seen.position, &seen.normal, &other).unwrap();
        // Mean square of the difference in standard errors, 1 where both agree; `scale` is the planted fault.
        let score = |scale: f32| {
            let (mut sum, mut count) = (0.0, 0.0_f64);
            // In the edge between two walls rounding decides on which side of the other wall a point lies.
            let in_edge = |p: Vec3| p.abs().cmpgt(Vec3::splat(0.999)).bitmask().count_ones() > 1;
            let fit = |i: &usize| seen.albedo[*i].min_element() > 0.1 && !in_edge(seen.position[*i]);
            for i in (0..seen.position.len()).filter(fit) {
                let brdf = seen.albedo[i] / PI;
                let d = image.indirect.pixels[i] - points.indirect.pixels[i] * brdf * scale;
                let v = image.indirect_variance.pixels[i] + points.indirect_variance.pixels[i] * brdf * brdf;
                sum += f64::from((d * d / v).element_sum());
                count += 3.0;
            }
            (sum / count, count)
        };
        // Squares of Student's t with 31 degrees of freedom a side: mean 62/60, variance 2.2. A pixel's channels are all but one number, so
        // that there are about 280: three standard errors are 3 · √(2.2/280) = 0.27.
        let (good, count) = score(1.0);
        assert!(count > 500.0 && (0.76..1.3).contains(&good), "{bounces:?}: {good} of {count}");
        assert!(score(1.1).0 > 1.6, "{bounces:?}: an error of 10 % would pass, {}", score(1.1).0);
    }
}

#[test]
fn parts_merge_and_are_stored_as_images_are() {
    let scene = room(true);
    let points = [Vec3::ZERO, Vec3::new(0.3, -0.2, 0.1)];
    let normals = [Vec3::Y, Vec3::NEG_X];
    let of = |first, batches| {
        let samples = Samples { batch: 8, first, batches };
        at(&scene, &points, &normals, &Settings { samples, ..Settings::default() })
    };
    let (whole, merged) = (of(0, 6), of(0, 2).merge(&of(2, 4)).unwrap());
    assert_eq!(merged.direct, whole.direct);
    assert_eq!(merged.indirect_variance, whole.indirect_variance);
    assert_eq!(Estimate::from_bytes(&whole.to_bytes()).unwrap(), whole);
    // Other points, or the same under other normals, are another estimate.
    let other = at(&scene, &points, &[Vec3::Y, Vec3::X], &samples(8, 6));
    assert!(matches!(whole.merge(&other), Err(Error::Merge { .. })));
    let direct = Settings { components: Components::Direct, ..samples(8, 6) };
    assert_eq!(at(&scene, &points, &normals, &direct).direct, whole.direct);
}

#[test]
fn points_that_are_none_are_refused_or_dark() {
    let scene = room(true);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let none = irradiance(&accel, &[], &[], &samples(1, 1));
    assert!(matches!(none, Err(Error::Size { size: [0, 1] })));
    let text = irradiance(&accel, &[Vec3::ZERO], &[], &samples(1, 1)).unwrap_err().to_string();
    assert_eq!(text, "1 points, but 0 normals");
    let lights = Settings { virtual_lights: VirtualLights::On, ..samples(1, 1) };
    assert!(irradiance(&accel, &[Vec3::ZERO], &[Vec3::Y], &lights).is_err());
    let points = [Vec3::NAN, Vec3::ZERO, Vec3::INFINITY, Vec3::ZERO];
    let normals = [Vec3::Y, Vec3::ZERO, Vec3::Y, Vec3::NAN];
    let e = irradiance(&accel, &points, &normals, &samples(4, 4)).unwrap();
    assert!(e.surface.iter().all(|s| !s));
    assert!(e.full().pixels.iter().all(|p| *p == Vec3::ZERO));
}
