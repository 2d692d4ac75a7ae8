//! Flux against closed forms, each with a fault that the same check refuses.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use std::f64::consts::PI;

use common::{flux, light, map, mixed, room, square, textured};
use glam::{DVec3, Vec2, Vec3};
use indirect_accel::{Accel, BuildPreset};
use indirect_core::math::{luminance, orthonormal_basis};
use indirect_core::{Light, LightKind, Material, Scene, spot_attenuation};
use indirect_sampling::mapping::{cone_uniform, hemisphere_cosine, hemisphere_uniform, sphere_uniform};
use indirect_sampling::sobol;
use indirect_scene::fixtures::SphereFurnace;
use photon_tracing::cpu::{MOST_KEPT, emit, trace};
use photon_tracing::{Params, Photon, Sources};

const N: u32 = 65_536;
const PARAMS: Params = Params { photons: N, seed: 3 };

fn grey() -> Scene {
    Scene { materials: vec![Material::diffuse("grey", Vec3::splat(0.5))], ..Scene::default() }
}

/// Four standard errors of the share `q` of `n` photons that do something, each on its own; evenly spread ones err less.
fn four_errors(q: f64, n: f64) -> f64 {
    4.0 * (q * (1.0 - q) / n).sqrt()
}

/// The photons that met a surface in one flight.
fn arrivals(scene: &Scene, mut photons: Vec<Photon>) -> Vec<Photon> {
    let accel = Accel::build(scene, BuildPreset::Fast);
    trace(&accel, PARAMS.seed, &mut photons);
    photons.into_iter().filter(|p| p.state != Photon::ESCAPED).collect()
}

/// Share of the photons that met a surface.
fn arrived(scene: &Scene, photons: Vec<Photon>) -> f64 {
    let all = photons.len() as f64;
    arrivals(scene, photons).len() as f64 / all
}

/// The same photons in other directions about their normals, or about `axis`.
fn turned(mut photons: Vec<Photon>, axis: Option<Vec3>, direction: impl Fn(Vec2) -> Vec3) -> Vec<Photon> {
    for (i, p) in (0..).zip(&mut photons) {
        let n = axis.unwrap_or(p.normal);
        let (t, b) = orthonormal_basis(n);
        let w = direction(sobol::sample_2d(i, 99));
        p.direction = t * w.x + b * w.y + n * w.z;
    }
    photons
}

/// Σ (found − expected)²/expected, and four deviations above its mean for numbers drawn on their own; evenly spread ones stay below.
fn chi_square(found: &[u32], expected: &[f64]) -> (f64, f64) {
    assert_eq!(found.len(), expected.len());
    assert!(expected.iter().all(|e| *e > 5.0), "{expected:?}");
    let sum = found.iter().zip(expected).map(|(f, e)| (f64::from(*f) - e).powi(2) / e).sum();
    let free = found.len() as f64 - 1.0;
    (sum, free + 4.0 * (2.0 * free).sqrt())
}

/// Largest error of a channel in units of its allowance.
fn excess(found: DVec3, expected: DVec3, relative: DVec3) -> f64 {
    ((found - expected).abs() / (expected * relative)).max_element()
}

/// In a closed room of one albedo `k` reflections leave `ρᵏ` of the flux. Each photon is stored with the probability `pᵏ` and has then
/// `(ρ/p)ᵏ` of its flux: a relative standard error of `√((1 − pᵏ)/(pᵏ N))`.
#[test]
fn reflections_keep_powers_of_the_albedo() {
    for albedo in [Vec3::splat(0.5), Vec3::splat(0.9), Vec3::new(0.9, 0.4, 0.1), Vec3::new(0.1, 0.3, 0.2)] {
        let scene = room(albedo, 1.0, Vec3::ZERO);
        let (stored, tally) = map(&scene, N, 7, 6);
        assert_eq!(tally.escaped.photons, 0);
        let emitted = scene.lights[0].power.as_dvec3() * (4.0 * PI);
        // 65 536 terms of one rounded flux, and as many roundings of ρ/p.
        assert!(excess(tally.emitted.flux, emitted, DVec3::splat(1e-6)) < 1.0);
        for k in 1..=6 {
            let albedo = albedo.as_dvec3();
            let expected = emitted * albedo.powf(f64::from(k));
            let q = albedo.max_element().min(f64::from(MOST_KEPT)).powi(k);
            let allowed = DVec3::splat(four_errors(q, f64::from(N)) / q + 1e-5);
            let of_k = stored.iter().filter(|p| p.reflections == k as u32);
            let found = flux(of_k.clone());
            assert!(excess(found, expected, allowed) < 1.0, "{albedo} {k}: {found} {expected}");
            let share = of_k.count() as f64 / f64::from(N);
            assert!((share - q).abs() < four_errors(q, f64::from(N)), "{albedo} {k}: {share} {q}");
            // A fault: the albedo decides who survives, and is multiplied once more.
            let twice = found * q;
            assert!(excess(twice, expected, allowed) > 1.0, "{twice} passed");
        }
    }
}

/// Solid angle of the rectangle `[0, x] × [0, y]` at height 1 below a point.
fn corner_angle(x: f64, y: f64) -> f64 {
    (x * y / (1.0 + x * x + y * y).sqrt()).atan()
}

/// Counts of hits in 8 × 8 cells of a square of half side 2, and elsewhere.
fn cells(photons: &[Photon]) -> Vec<u32> {
    let mut counts = vec![0; 65];
    counts[64] = N - photons.len() as u32;
    for p in photons {
        let cell = |x: f32| ((x + 2.0) * 2.0).clamp(0.0, 7.0) as usize;
        counts[cell(p.position.z) * 8 + cell(p.position.x)] += 1;
    }
    counts
}

#[test]
fn a_point_light_fills_solid_angles() {
    let mut scene = grey();
    square(&mut scene, Vec3::ZERO, Vec3::X, -Vec3::Z, 2.0, 0);
    scene.lights.push(light(LightKind::Point { position: Vec3::Y }, Vec3::ONE));
    let edge = |i: usize| f64::from(i as u32) * 0.5 - 2.0;
    let mut expected = Vec::new();
    for cell in 0..64 {
        let (x, y) = ([edge(cell % 8), edge(cell % 8 + 1)], [edge(cell / 8), edge(cell / 8 + 1)]);
        let angle = corner_angle(x[1], y[1]) - corner_angle(x[0], y[1]) - corner_angle(x[1], y[0])
            + corner_angle(x[0], y[0]);
        expected.push(angle / (4.0 * PI) * f64::from(N));
    }
    expected.push(f64::from(N) - expected.iter().sum::<f64>());
    let photons = emit(&Sources::new(&scene), &PARAMS);
    let (right, most) = chi_square(&cells(&arrivals(&scene, photons.clone())), &expected);
    println!("{right:.1} of {most:.1}");
    assert!(right < most, "{right} {most}");
    // A fault: the light sends as a surface does, with the cosine.
    let cosine = turned(photons, Some(-Vec3::Y), |u| {
        let w = hemisphere_cosine(u);
        // The lower half gets half of all, so that totals do not give it away.
        if u.x < 0.5 { w } else { -w }
    });
    let (wrong, _) = chi_square(&cells(&arrivals(&scene, cosine)), &expected);
    assert!(wrong > most, "{wrong} passed");
}

/// Counts of directions by their cosine with `axis`, evenly between that of the cone's border and 1, and by their turn about it.
fn directions(photons: &[Photon], axis: Vec3, low: f64) -> [Vec<u32>; 2] {
    let (mut cosines, mut turns) = (vec![0; BINS], vec![0; BINS]);
    let (t, b) = orthonormal_basis(axis);
    for p in photons {
        let d = p.direction.as_dvec3();
        let share = (d.dot(axis.as_dvec3()) - low) / (1.0 - low);
        cosines[((share * BINS as f64) as usize).min(BINS - 1)] += 1;
        let angle = d.dot(b.as_dvec3()).atan2(d.dot(t.as_dvec3())) / (2.0 * PI) + 0.5;
        turns[((angle * BINS as f64) as usize).min(BINS - 1)] += 1;
    }
    [cosines, turns]
}
const BINS: usize = 24;

#[test]
fn a_spot_light_sends_in_proportion_to_its_falloff() {
    let axis = Vec3::new(0.3, -0.8, 0.5).normalize();
    let half_turn = std::f32::consts::FRAC_PI_2;
    for (inner, outer) in [(0.0_f32, 0.6_f32), (0.35, 0.7), (0.69, 0.7), (0.5, 0.5), (0.2, half_turn)] {
        let position = Vec3::new(1.0, 2.0, 3.0);
        let kind = LightKind::Spot { position, direction: axis, inner_angle: inner, outer_angle: outer };
        let mut sources = Sources::default();
        sources.set_lights(&[light(kind, Vec3::ONE)]);
        let photons = emit(&sources, &PARAMS);
        let low = f64::from(outer.cos());
        // What the rest of the workspace evaluates, at 2000 midpoints of each bin.
        let at = |i: usize| {
            let c = low + (1.0 - low) * (i as f64 + 0.5) / (2000 * BINS) as f64;
            f64::from(spot_attenuation(c as f32, inner, outer))
        };
        let mut expected: Vec<f64> =
            (0..BINS).map(|bin| (0..2000).map(|i| at(bin * 2000 + i)).sum()).collect();
        let all: f64 = expected.iter().sum();
        expected.iter_mut().for_each(|e| *e *= f64::from(N) / all);
        // The dimmest bins hold few photons each: those with less than five join the next.
        let join = |counts: &[u32]| {
            let (mut found, mut joined, mut waiting) = (Vec::new(), Vec::new(), (0, 0.0));
            for (c, e) in counts.iter().zip(&expected) {
                waiting = (waiting.0 + c, waiting.1 + e);
                if waiting.1 > 5.0 {
                    found.push(waiting.0);
                    joined.push(waiting.1);
                    waiting = (0, 0.0);
                }
            }
            chi_square(&found, &joined)
        };
        let [cosines, turns] = directions(&photons, axis, low);
        let (right, most) = join(&cosines);
        let (around, most_around) = chi_square(&turns, &[f64::from(N) / BINS as f64; BINS]);
        println!("{inner} {outer}: {right:.1} of {most:.1}, {around:.1} of {most_around:.1}");
        assert!(right < most && around < most_around, "{inner} {outer}: {right} {around}");
        // A fault: the cone filled evenly. With equal angles the falloff is 0.001 of the cosine, less than a bin.
        if outer - inner > 0.1 {
            let even = turned(photons, Some(axis), |u| cone_uniform(u, (1.0 - low) as f32));
            let (wrong, _) = join(&directions(&even, axis, low)[0]);
            assert!(wrong > most, "{inner} {outer}: {wrong} passed");
        }
    }
}

/// A cone so narrow that even its axis is short of full intensity: the profile is a² all over, cut off by the axis.
#[test]
fn a_spot_light_whose_axis_is_dim_is_exact() {
    let (outer, axis) = (0.03_f32, Vec3::Z);
    let kind =
        LightKind::Spot { position: Vec3::ZERO, direction: axis, inner_angle: 0.0, outer_angle: outer };
    let mut sources = Sources::default();
    sources.set_lights(&[light(kind, Vec3::ONE)]);
    let low = outer.cos();
    assert!(low + 0.001 > 1.0 && spot_attenuation(1.0, 0.0, outer) < 1.0);
    let photons = emit(&sources, &PARAMS);
    // ∫ a² grows with the cube of what is above the border: the median is at the cube root of a half. f32 cosines near 1 come in steps of
    // 6·10⁻⁸, of 4.5·10⁻⁴ in all.
    let share = |c: f32| f64::from(c - low) / f64::from(1.0 - low);
    let below = photons.iter().filter(|p| share(p.direction.z) < 0.5_f64.cbrt()).count();
    let found = below as f64 / f64::from(N);
    let allowed = four_errors(0.5, f64::from(N)) + 2e-3;
    assert!((found - 0.5).abs() < allowed, "{found}");
    // A fault: an even cone has 0.79 there.
    assert!((0.5_f64.cbrt() - 0.5).abs() > allowed);
}

#[test]
fn a_directional_light_brings_its_irradiance() {
    let right = Vec3::new(0.6, 0.8, 0.0);
    let up = Vec3::new(0.0, 0.28, 0.96);
    let normal = right.cross(up);
    let direction = Vec3::new(0.5, -1.0, -0.25).normalize();
    let mut scene = grey();
    square(&mut scene, Vec3::new(3.0, 1.0, -2.0), right, up, 0.5, 0);
    // A second one in its shadow, smaller and parallel, adds nothing but bounds.
    square(&mut scene, Vec3::new(3.0, 1.0, -2.0) + direction * 2.0, right, up, 0.4, 0);
    scene.lights.push(light(LightKind::Directional { direction }, Vec3::new(3.0, 2.0, 1.0)));
    let sources = Sources::new(&scene);
    let photons = emit(&sources, &PARAMS);
    // Outside of the bounds.
    let bounds = scene.bounds().unwrap();
    assert!(photons.iter().all(|p| (p.position - bounds.centre()).dot(direction) < 0.0));
    let expected = DVec3::new(3.0, 2.0, 1.0) * f64::from(normal.dot(direction).abs());
    let found = flux(&arrivals(&scene, photons));
    // Grey of ½ keeps the flux of those that survive, and those that do not have what they brought.
    let q = expected.x / f64::from(sources.flux().x);
    let allowed = DVec3::splat(four_errors(q, f64::from(N)) / q);
    assert!(excess(found, expected, allowed) < 1.0, "{found} {expected}");
    // A fault: the square as if it faced the light.
    assert!(excess(DVec3::new(3.0, 2.0, 1.0), expected, allowed) > 1.0);
}

/// Two facing unit squares one apart: F = 0.199 825 (Modest, Radiative Heat Transfer, configuration 38).
#[test]
fn an_emissive_square_lights_another_by_its_form_factor() {
    const FORM_FACTOR: f64 = 0.199_825;
    for double_sided in [false, true] {
        let mut scene = grey();
        let emission = Vec3::new(4.0, 3.0, 2.0);
        scene.materials.push(Material { emission, double_sided, ..Material::diffuse("lamp", Vec3::ZERO) });
        square(&mut scene, Vec3::ZERO, Vec3::X, -Vec3::Z, 0.5, 1);
        square(&mut scene, Vec3::Y, Vec3::X, Vec3::Z, 0.5, 0);
        let sources = Sources::new(&scene);
        let sides = if double_sided { 2.0 } else { 1.0 };
        let emitted = emission.as_dvec3() * (PI * sides);
        assert!(excess(sources.flux().as_dvec3(), emitted, DVec3::splat(1e-6)) < 1.0);
        let photons = emit(&sources, &PARAMS);
        let q = FORM_FACTOR / sides;
        let found = arrived(&scene, photons.clone());
        let allowed = four_errors(q, f64::from(N));
        assert!((found - q).abs() < allowed, "{found} {q}");
        let up = photons.iter().filter(|p| p.normal.y > 0.0).count() as f64 / f64::from(N);
        // Two borders of sides in each of two triangles: as in `bookkeeping`.
        assert!((up - 1.0 / sides).abs() < 8.0 / f64::from(N), "{up}");
        // A fault: directions without the cosine.
        let wrong = arrived(&scene, turned(photons, None, hemisphere_uniform));
        assert!((wrong - q).abs() > allowed, "{wrong} passed");
    }
}

#[test]
fn a_range_takes_its_window_on_the_first_flight_alone() {
    let mut scene =
        SphereFurnace { albedo: Vec3::splat(0.5), subdivisions: 5, ..SphereFurnace::default() }.build();
    let emitted = scene.lights[0].power.as_dvec3() * (4.0 * PI);
    // Share of the emitted flux after some flights, of which each counts the range where `every`.
    let mut run = |range: Option<f32>, flights: u32, every: bool| {
        scene.lights[0].range = range;
        let accel = Accel::build(&scene, BuildPreset::Fast);
        let mut photons = emit(&Sources::new(&scene), &PARAMS);
        let inverse_range = photons[0].inverse_range;
        for _ in 0..flights {
            trace(&accel, PARAMS.seed, &mut photons);
            if every {
                photons.iter_mut().for_each(|p| p.inverse_range = inverse_range);
            }
        }
        // Grey of ½: those that survive keep their flux, and those that end have what they brought.
        assert!(photons.iter().all(|p| p.state != Photon::ESCAPED));
        flux(&photons) / emitted
    };
    // 1 m away, up to the facets' depth of 10⁻³ of it, of which the window takes up to 4·(2/3)⁴/0.8 times as much.
    let window = 1.0 - (1.0_f64 / 1.5).powi(4);
    let off = |found: DVec3| (found / window - 1.0).abs().max_element();
    for flights in [1, 3] {
        let found = run(Some(1.5), flights, false);
        assert!(off(found) < 2e-3, "{flights}: {found} {window}");
    }
    // Faults: no window; the window again on each flight.
    assert!(off(run(None, 1, false)) > 2e-3);
    assert!(off(run(Some(1.5), 3, true)) > 2e-3);
    // Nothing arrives beyond the range.
    assert_eq!(run(Some(0.5), 1, false), DVec3::ZERO);
}

#[test]
fn sources_send_in_proportion_to_their_flux() {
    let scene = mixed(1.0, Vec3::ZERO);
    let sources = Sources::new(&scene);
    let photons = emit(&sources, &PARAMS);
    let total = f64::from(luminance(sources.flux()));
    let point = scene.lights[1].position().unwrap();
    let found = photons.iter().filter(|p| p.position == point).count() as f64;
    let expected = f64::from(luminance(scene.lights[1].power)) * 4.0 * PI / total * f64::from(N);
    // As in `bookkeeping`, and shares in f32.
    let allowed = 2.0 + 1e-6 * f64::from(N);
    assert!((found - expected).abs() < allowed, "{found} {expected}");
    // A fault: the same number for each of the five.
    assert!((f64::from(N) / 5.0 - expected).abs() > allowed);
    let each =
        photons.iter().map(|p| luminance(p.flux)).fold([f32::MAX, 0.0], |[a, b], l| [a.min(l), b.max(l)]);
    assert!(each[1] / each[0] < 1.000_001, "{each:?}");
    // Lights that change leave the emitters as they are.
    let mut changed = sources.clone();
    changed.set_lights(&scene.lights[..1]);
    assert_eq!(changed.emitters(), sources.emitters());
    let dark = Scene { lights: scene.lights[..1].to_vec(), ..scene };
    assert_eq!(changed, Sources::new(&dark));
}

/// Flux of the first reflection, standard error by the photons' own variance, both of luminance.
fn first_reflection(scene: &Scene) -> (f64, f64) {
    let (stored, _) = map(scene, N, 1, 1);
    let (mut sum, mut square) = (0.0, 0.0);
    for p in &stored {
        let l = f64::from(luminance(p.flux));
        sum += l;
        square += l * l;
    }
    (sum, (square - sum * sum / f64::from(N)).sqrt())
}

/// What maps of the lights say, texel by texel, textures and masks included.
#[test]
fn the_first_reflection_is_that_of_reflective_shadow_maps() {
    let fixtures = ["cornell_spot", "plane_point", "plane_spot", "plane_directional", "two_rooms", "atrium"];
    let mut scenes: Vec<_> =
        fixtures.map(|name| (name, indirect_scene::fixtures::build(name).unwrap())).into();
    scenes.push(("textures and a mask", textured()));
    for (name, scene) in scenes {
        assert!(Sources::new(&scene).emitters().is_empty());
        let accel = Accel::build(&scene, BuildPreset::Fast);
        let maps = rsm::cpu::generate(&accel, 256).unwrap();
        let expected = f64::from(luminance(maps.reflected().as_vec3()));
        let (found, error) = first_reflection(&scene);
        // Maps err where an edge crosses a texel: 256 × 256 of them, of which some percent do, either way.
        let allowed = 4.0 * error + 0.004 * expected;
        println!("{name}: {:+.4}, allowed {:.4}", found / expected - 1.0, allowed / expected);
        assert!((found - expected).abs() < allowed, "{name}: {found} {expected}");
        // A fault: the albedo, which is far from 1 here, counted once more.
        let albedo = expected / f64::from(luminance(Sources::new(&scene).flux()));
        assert!((found * albedo - expected).abs() > allowed, "{name}");
    }
}

/// What is left of the choice of a light chooses its direction: every light fills all of its own.
#[test]
fn one_of_several_lights_sends_everywhere() {
    let mut sources = Sources::default();
    let position = |i: f32| LightKind::Point { position: Vec3::X * i };
    let lights = [1.0, 3.0, 0.7, 2.0].map(Vec3::splat);
    let lights: Vec<Light> = (0..4_u8).map(|i| light(position(i.into()), lights[usize::from(i)])).collect();
    sources.set_lights(&lights);
    let photons = emit(&sources, &PARAMS);
    for (i, l) in lights.iter().enumerate() {
        let own: Vec<Photon> = photons.iter().filter(|p| Some(p.position) == l.position()).copied().collect();
        let even = [own.len() as f64 / BINS as f64; BINS];
        let counts = |own: &[Photon]| directions(own, Vec3::Y, -1.0).map(|bins| chi_square(&bins, &even));
        let right = counts(&own);
        assert!(right.iter().all(|(found, most)| found < most), "{i}: {right:?}");
        // A fault: the number that chose the light chooses the direction as it is, out of its share.
        let (first, share) = (0.25 * i as f32, 0.25);
        let strip = turned(own, Some(Vec3::Y), |u| sphere_uniform(Vec2::new(first + share * u.x, u.y)));
        assert!(counts(&strip).iter().any(|(found, most)| found > most), "{i}: a strip passed");
    }
}
