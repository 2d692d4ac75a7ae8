//! Nothing, too much, tiny, far away, on the border.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use common::{cube, flux, is_sound, light, map, mixed, room, square};
use glam::{DVec3, Vec3};
use indirect_accel::{Accel, BuildPreset};
use indirect_core::{Light, LightKind, Material, Scene};
use photon_tracing::cpu::{MOST_KEPT, Tally, emit, photon_map, trace};
use photon_tracing::{Params, Photon, Sources};

const N: u32 = 4096;

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let scene = indirect_scene::fixtures::build("atrium").unwrap();
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let mut sources = Sources::new(&scene);
    let mut lights = scene.lights.clone();
    lights.push(light(LightKind::Point { position: Vec3::Y }, Vec3::ONE));
    sources.set_lights(&lights);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let params = Params { photons: 5000, seed: 4 };
        let (stored, tally) = pool.install(|| photon_map(&accel, &sources, &params, 4));
        (bytemuck::cast_slice::<_, u32>(&stored).to_vec(), tally)
    };
    let (one, four) = (run(1), run(4));
    assert!(!one.0.is_empty());
    assert_eq!(one, four);
}

#[test]
fn nothing_emits_nothing() {
    let mut dark = room(Vec3::splat(0.5), 1.0, Vec3::ZERO);
    dark.lights.clear();
    let black = |kind| Scene { lights: vec![light(kind, Vec3::ZERO)], ..dark.clone() };
    let narrow = LightKind::Spot {
        position: Vec3::ZERO,
        direction: Vec3::Y,
        inner_angle: 0.0,
        // Its cosine is 1: nothing gets out, here as wherever the falloff is evaluated.
        outer_angle: 1e-5,
    };
    let sun = light(LightKind::Directional { direction: Vec3::NEG_Y }, Vec3::ONE);
    for scene in [
        Scene::default(),
        Scene { lights: vec![sun], ..Scene::default() },
        black(LightKind::Point { position: Vec3::ZERO }),
        Scene { lights: vec![light(narrow, Vec3::ONE)], ..dark.clone() },
        dark,
    ] {
        let (stored, tally) = map(&scene, N, 0, 3);
        assert!(stored.is_empty());
        assert_eq!(tally, Tally::default());
        let photons = emit(&Sources::new(&scene), &Params { photons: 7, seed: 0 });
        assert_eq!(photons, [Photon::default(); 7]);
    }
}

#[test]
fn without_photons_or_surfaces_nothing_is_stored() {
    let scene = mixed(1.0, Vec3::ZERO);
    let (stored, tally) = map(&scene, 0, 0, 3);
    assert!(stored.is_empty() && tally == Tally::default());
    let (_, tally) = map(&scene, 1, 0, 3);
    assert_eq!(tally.emitted.photons, 1);
    // A light in the void.
    let point = light(LightKind::Point { position: Vec3::ZERO }, Vec3::ONE);
    let (stored, tally) = map(&Scene { lights: vec![point], ..Scene::default() }, N, 0, 3);
    assert!(stored.is_empty());
    assert_eq!(tally.escaped, tally.emitted);
    assert_eq!(tally.emitted.photons, u64::from(N));
}

#[test]
fn black_keeps_nothing_and_white_keeps_all_flux() {
    let (stored, tally) = map(&room(Vec3::ZERO, 1.0, Vec3::ZERO), N, 0, 3);
    assert!(stored.is_empty());
    assert_eq!(tally.absorbed, tally.emitted);
    // So small an albedo that its inverse is no f32.
    let (stored, _) = map(&room(Vec3::splat(1e-40), 1.0, Vec3::ZERO), 1 << 16, 0, 3);
    assert!(stored.is_empty());

    // White: p = ¾ ends photons, and the others carry 4/3 of their flux.
    let (stored, tally) = map(&room(Vec3::ONE, 1.0, Vec3::ZERO), N, 0, 40);
    assert!(stored.iter().all(is_sound));
    assert_eq!(tally.escaped.photons, 0);
    // Each photon is stored k times with the probability ¼·¾ᵏ: 3 times in the mean, with a variance of ¾/(¼)² = 12. Four standard errors.
    let mean = stored.len() as f64 / f64::from(N);
    assert!((mean - 3.0).abs() < 4.0 * (12.0 / f64::from(N)).sqrt(), "{mean}");
    for k in 1..=4_u32 {
        let q = f64::from(MOST_KEPT).powi(k as i32);
        let found = flux(stored.iter().filter(|p| p.reflections == k)) / tally.emitted.flux;
        let allowed = 4.0 * ((1.0 - q) / (q * f64::from(N))).sqrt();
        assert!((found - 1.0).abs().max_element() < allowed, "{k}: {found}");
    }
}

#[test]
fn scales_and_distances_change_nothing() {
    // Lengths times a power of two are exact, but for the ray queries and offsets; others round.
    let (reference, _) = map(&room(Vec3::splat(0.7), 1.0, Vec3::ZERO), N, 3, 4);
    for (scale, offset) in [(1e-3, 0.0), (1e3, 0.0), (1.0, 1e5), (1e3, -1e5), (1e-18, 0.0)] {
        let scene = room(Vec3::splat(0.7), scale, Vec3::splat(offset));
        let (stored, tally) = map(&scene, N, 3, 4);
        assert!(stored.iter().all(is_sound), "{scale} {offset}");
        // A wall is a wall: numbers decide alike wherever a photon lands. But a place within a step of a coordinate (2⁻⁷ m at 10⁵ m) of an
        // edge may round to the other side of the next wall: that is twice the step's share of a side, in about two flights.
        let step = offset.abs() * f32::EPSILON / scale;
        let lost = (2.0 * 2.0 * step * N as f32) as usize;
        assert!(tally.escaped.photons as usize <= lost, "{scale} {offset}: {tally:?}");
        assert!(stored.len().abs_diff(reference.len()) <= 3 * lost, "{scale} {offset}");
        let inside = |p: &Photon| ((p.position - offset) / scale).abs().max_element() < 1.0 + 0.02;
        assert!(stored.iter().all(inside), "{scale} {offset}");

        let (stored, tally) = map(&mixed(scale, Vec3::splat(offset)), N, 3, 4);
        assert!(stored.iter().all(is_sound), "{scale} {offset}");
        assert_eq!(tally.emitted.photons, u64::from(N));
        assert!(!stored.is_empty() && tally.emitted.flux.is_finite() && tally.absorbed.flux.is_finite());
    }
}

#[test]
fn what_is_enclosed_stays_there() {
    // A light in a box within a room, and an emitter on a wall of it.
    let mut scene = room(Vec3::splat(0.7), 1.0, Vec3::ZERO);
    let centre = Vec3::new(0.3, -0.5, 0.1);
    cube(&mut scene, centre, 0.1, 0);
    let (stored, tally) = map(&scene, N, 0, 5);
    assert_eq!(tally.escaped.photons, 0);
    assert!(stored.iter().all(|p| (p.position - centre).abs().max_element() < 0.1001));
    // A light on a surface, in a corner of it, and beyond all.
    for position in [Vec3::new(1.0, 0.2, 0.3), Vec3::ONE, Vec3::NEG_X, Vec3::splat(50.0)] {
        let lights = vec![light(LightKind::Point { position }, Vec3::ONE)];
        let (stored, tally) = map(&Scene { lights, ..scene.clone() }, N, 0, 3);
        assert_eq!(tally.emitted.photons, u64::from(N));
        assert!(stored.iter().all(is_sound), "{position}");
    }
}

#[test]
fn ranges_next_to_nothing_and_next_to_infinite_stay_finite() {
    for (range, keeps) in [(1e-45, false), (1e-30, false), (1e30, true), (f32::INFINITY, true)] {
        let mut scene = room(Vec3::splat(0.5), 1.0, Vec3::ZERO);
        scene.lights[0].range = Some(range);
        let (stored, tally) = map(&scene, N, 0, 2);
        assert!(stored.iter().all(is_sound) && stored.is_empty() != keeps, "{range}");
        assert!(tally.absorbed.flux.is_finite());
        // In the place of the light there is no distance.
        let accel = Accel::build(&scene, BuildPreset::Fast);
        let mut photons = emit(&Sources::new(&scene), &Params { photons: N, seed: 0 });
        photons.iter_mut().for_each(|p| p.position = Vec3::X);
        trace(&accel, 0, &mut photons);
        assert!(photons.iter().all(|p| p.flux.is_finite()), "{range}");
    }
}

#[test]
fn flat_scenes_and_degenerate_triangles_are_no_trouble() {
    // A floor seen by a distant light along its plane, and from above.
    for (direction, meets) in [(Vec3::X, false), (Vec3::NEG_Y, true), (Vec3::Y, true)] {
        let mut scene =
            Scene { materials: vec![Material::diffuse("grey", Vec3::splat(0.5))], ..Scene::default() };
        square(&mut scene, Vec3::ZERO, Vec3::X, -Vec3::Z, 1.0, 0);
        scene.lights.push(light(LightKind::Directional { direction }, Vec3::ONE));
        let (_, tally) = map(&scene, N, 0, 1);
        let flux = tally.emitted.flux.x;
        assert!(if meets { (flux - 4.0).abs() < 1e-4 } else { flux < 1e-4 }, "{direction}: {flux}");
    }
    // Triangles without area neither emit nor stretch the bounds.
    let mut scene = mixed(1.0, Vec3::ZERO);
    let sources = Sources::new(&scene);
    let n = scene.mesh.positions.len() as u32;
    scene.mesh.positions.extend([Vec3::splat(1e6); 3]);
    scene.mesh.normals.extend([Vec3::Y; 3]);
    scene.mesh.triangles.push([n, n + 1, n + 2]);
    scene.mesh.materials.push(1);
    assert_eq!(Sources::new(&scene), sources);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    // The same length for offsets on both backends.
    assert_eq!(sources.settings(&Params::default()).unit, accel.unit());
}

#[test]
fn lights_of_extreme_power_stay_finite() {
    for power in [1e-37, 1e-30, 1e30, 1e37] {
        let mut scene = room(Vec3::new(0.9, 0.5, 0.1), 1.0, Vec3::ZERO);
        scene.lights[0].power = Vec3::splat(power);
        let (stored, tally) = map(&scene, N, 0, 2);
        assert!(!stored.is_empty() && stored.iter().all(is_sound), "{power}");
        let expected = DVec3::splat(f64::from(power) * 4.0 * std::f64::consts::PI);
        assert!((tally.emitted.flux / expected - 1.0).abs().max_element() < 1e-5, "{power}");
    }
    // More than f32 holds: left out, beside one that is not.
    let mut scene = room(Vec3::splat(0.5), 1.0, Vec3::ZERO);
    scene.lights.push(Light { power: Vec3::splat(f32::MAX), ..scene.lights[0].clone() });
    assert_eq!(Sources::new(&scene).lights().len(), 1);
}
