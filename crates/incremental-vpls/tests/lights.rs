//! Lights over frames: flux, validity, what is kept.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use core::f64::consts::PI;
use std::collections::HashMap;

use glam::{DVec3, Mat3, Vec3};
use incremental_vpls::{Density, Settings, Start, State};
use indirect_accel::{Accel, BuildPreset};
use indirect_core::{Light, LightKind, Material, Ray, Scene};
use proptest::prelude::*;
use rsm::Vpl;

const ALBEDO: Vec3 = Vec3::new(0.8, 0.5, 0.2);
const POWER: Vec3 = Vec3::new(3.0, 2.0, 1.0);

fn light(kind: LightKind) -> Light {
    Light { name: String::new(), kind, power: POWER, range: None }
}

fn spot(position: Vec3, direction: Vec3) -> LightKind {
    LightKind::Spot { position, direction: direction.normalize(), inner_angle: 0.3, outer_angle: 0.7 }
}

/// A square of side `2·half` around `centre`, facing up before it is turned by `rotation`.
fn push_square(scene: &mut Scene, centre: Vec3, half: f32, rotation: Mat3) {
    let corner = |x: f32, z: f32| centre + rotation * Vec3::new(x * half, 0.0, z * half);
    scene.mesh.push_polygon(&[corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)], 0);
}

fn floor(half: f32) -> Scene {
    let mut scene = Scene { materials: vec![Material::diffuse("surface", ALBEDO)], ..Scene::default() };
    push_square(&mut scene, Vec3::ZERO, half, Mat3::IDENTITY);
    scene
}

/// A closed box around the origin, facing inwards, with a smaller square that floats in it.
fn room() -> Scene {
    use core::f32::consts::{FRAC_PI_2, PI};
    let mut scene = Scene { materials: vec![Material::diffuse("surface", ALBEDO)], ..Scene::default() };
    let x = Mat3::from_rotation_x;
    let z = Mat3::from_rotation_z;
    for turn in [Mat3::IDENTITY, x(PI), x(FRAC_PI_2), x(-FRAC_PI_2), z(FRAC_PI_2), z(-FRAC_PI_2)] {
        push_square(&mut scene, turn * Vec3::NEG_Y, 1.0, turn);
    }
    push_square(&mut scene, Vec3::new(0.1, -0.4, 0.0), 0.3, Mat3::IDENTITY);
    scene
}

fn settings(count: u32) -> Settings {
    Settings { count, ..Settings::default() }
}

fn flux(vpls: &[Vpl]) -> DVec3 {
    vpls.iter().map(|v| v.flux.as_dvec3()).sum()
}

/// The flux that the maps of the same lights reflect.
fn reflected(scene: &Scene, light: &Light, resolution: u32) -> DVec3 {
    let scene = Scene { lights: vec![light.clone()], ..scene.clone() };
    rsm::cpu::generate(&Accel::build(&scene, BuildPreset::Fast), resolution).unwrap().reflected()
}

#[test]
fn flux_is_that_of_the_reflective_shadow_map() {
    let room = room();
    let wide = LightKind::Spot {
        position: Vec3::new(0.2, 0.1, 0.3),
        direction: Vec3::X,
        inner_angle: 0.8,
        outer_angle: 1.4,
    };
    let cases = [
        (&room, spot(Vec3::new(0.1, 0.8, 0.0), Vec3::new(0.1, -1.0, 0.2))),
        (&room, wide),
        (&room, LightKind::Point { position: Vec3::new(0.2, 0.1, 0.3) }),
    ];
    for (scene, kind) in cases {
        let light = light(kind);
        let accel = Accel::build(scene, BuildPreset::Fast);
        let expected = reflected(scene, &light, 512);
        for &density in Density::ALL {
            let mut state = State::new(Settings { density, ..settings(200) }).unwrap();
            state.rebuild(&accel, &light);
            let found = flux(state.vpls());
            // Everything is lit and has one albedo, so that no cell is cut: what is left is the map's error, 1e-3 at
            // 512² (the rule of midpoints over a cone, see the tests of rsm), and f32.
            assert!((found / expected - 1.0).abs().max_element() < 1e-3, "{kind:?}: {found} {expected}");
            // Without the albedo it would be off by a fifth in red already.
            let incident = found.x / f64::from(ALBEDO.x);
            assert!((incident / expected.x - 1.0).abs() > 0.1);
        }
    }
}

#[test]
fn flux_that_misses_the_scene_is_left_out() {
    // Less than half of the light of these meets the floor. Each cell is all or nothing by its point: those that the
    // border of the lit region crosses are wrong by up to half of theirs. With n cells it crosses about 4 √(n share)
    // of them; signs are as good as random, so 3 √(4 √(n share)) · 0.5/n of the whole, twice that for the cells' sizes.
    let scene = floor(1.0);
    let n = 1024;
    let cases = [
        light(LightKind::Point { position: Vec3::new(0.1, 0.7, -0.2) }),
        light(LightKind::Directional { direction: Vec3::new(0.2, -1.0, 0.3).normalize() }),
        light(spot(Vec3::new(0.9, 1.5, 0.2), Vec3::new(0.1, -1.0, 0.0))),
    ];
    for light in cases {
        let accel = Accel::build(&scene, BuildPreset::Fast);
        let expected = reflected(&scene, &light, 512);
        for &start in Start::ALL {
            let mut state = State::new(Settings { start, ..settings(n) }).unwrap();
            let update = state.rebuild(&accel, &light);
            assert_eq!(update.inserted + update.empty, n);
            assert!(update.empty > n / 20, "{update:?}");
            let share = f64::from(update.inserted) / f64::from(n);
            let tolerance =
                2.0 * 3.0 * (4.0 * (f64::from(n) * share).sqrt()).sqrt() * 0.5 / (f64::from(n) * share);
            let found = flux(state.vpls());
            let off = (found / expected - 1.0).abs().max_element();
            assert!(off < tolerance, "{light:?} {start:?}: {found} {expected}, {off} of {tolerance}");
            // Planted: the flux of the whole domain onto those that meet something.
            assert!((found.x / share / expected.x - 1.0).abs() > tolerance);
        }
    }
}

#[test]
fn areas_are_footprints() {
    // A point light over a floor: the footprints of a disc of radius r below it cover π r².
    let scene = floor(50.0);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let n = 2000;
    let mut state = State::new(settings(n)).unwrap();
    state.rebuild(&accel, &light(LightKind::Point { position: Vec3::Y }));
    let within = |v: &&Vpl| v.position.length() < 1.0;
    let area: f64 = state.vpls().iter().filter(within).map(|v| f64::from(v.area)).sum();
    // The cone of 45° holds n (1 − cos 45°)/2 = 293 cells; its border crosses 2 √(π 293) = 61 of them: √61/2/293 of
    // the area, 3 times. The footprint is that of the point's own slope: its variation over a cell of 0.08 rad adds
    // 1e-2.
    assert!((area / PI - 1.0).abs() < 0.05, "{area}");
    // Without the cosine a third would be missing.
    let bare: f64 = state
        .vpls()
        .iter()
        .filter(within)
        .map(|v| f64::from(v.area * v.position.distance(Vec3::Y).recip()))
        .sum();
    assert!((bare / PI - 1.0).abs() > 0.1, "{bare}");
}

#[test]
fn a_light_that_rests_keeps_all_its_lights() {
    let scene = room();
    let accel = Accel::build(&scene, BuildPreset::Fast);
    for kind in [
        spot(Vec3::new(0.1, 0.8, 0.0), Vec3::NEG_Y),
        LightKind::Point { position: Vec3::splat(0.3) },
        LightKind::Directional { direction: Vec3::NEG_Y },
    ] {
        let light = light(kind);
        let mut state = State::new(Settings { recalc_min: 0, evenness: 0.0, ..settings(300) }).unwrap();
        let first = state.update(&accel, &light);
        assert_eq!((first.reused, first.inserted + first.empty), (0, 300));
        let (vpls, slots) = (state.vpls().to_vec(), state.slots().to_vec());
        for _ in 0..3 {
            let next = state.update(&accel, &light);
            // A site within rounding of an edge between two surfaces may be given up.
            assert!(next.inserted + next.removed <= 2, "{kind:?}: {next:?}");
        }
        if state.vpls().len() == vpls.len() && state.slots() == slots {
            // The point is that of the surface again: f32.
            assert!(vpls.iter().zip(state.vpls()).all(
                |(a, b)| a.position == b.position && (a.flux - b.flux).length() < 1e-2 * a.flux.length()
            ));
        }
        let mut state = State::new(settings(300)).unwrap();
        state.update(&accel, &light);
        for _ in 0..5 {
            let next = state.update(&accel, &light);
            assert!((4..8).contains(&(next.removed)), "{next:?}");
        }
    }
}

/// Whether the light can be seen from each of its lights and sees them in its cone.
fn all_lit(accel: &Accel<'_>, light: &Light, vpls: &[Vpl]) -> bool {
    vpls.iter().all(|v| {
        let s = light.sample(v.position);
        let from = v.position + v.normal * 1e-4;
        let to = light.position().unwrap() - from;
        let clear = !accel.any_hit(&Ray { t_max: 0.999, ..Ray::new(from, to) });
        clear && s.irradiance.x > 0.0 && v.normal.dot(s.direction) > 0.0
    })
}

#[test]
fn what_a_moving_light_keeps_is_lit() {
    let scene = room();
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let at = |i: usize| {
        let (y, x) = (i as f32 * 0.1).sin_cos();
        light(spot(Vec3::new(0.25 * x, 0.8, 0.25 * y), Vec3::new(0.3 * y, -1.0, 0.3 * x)))
    };
    let mut state = State::new(settings(256)).unwrap();
    state.update(&accel, &at(0));
    let expected = reflected(&scene, &at(0), 256);
    let mut kept = 0;
    for i in 1..60 {
        let before: HashMap<u32, Vec3> =
            state.slots().iter().zip(state.vpls()).map(|(&s, v)| (s, v.position)).collect();
        let old = state.vpls().to_vec();
        let update = state.update(&accel, &at(i));
        assert!(all_lit(&accel, &at(i), state.vpls()), "frame {i}");
        assert!(update.inserted <= 32 && update.reused + update.inserted + update.empty <= 256);
        // A slot that is not fresh holds the light that it held.
        let mut seen = vec![false; 256];
        for ((&slot, vpl), &fresh) in state.slots().iter().zip(state.vpls()).zip(state.fresh()) {
            assert!(!core::mem::replace(&mut seen[slot as usize], true), "slot {slot} twice");
            assert!(fresh || before[&slot] == vpl.position);
        }
        // The flux does not depend on how many are left: the box is closed, the albedo one.
        assert!((flux(state.vpls()) / expected - 1.0).abs().max_element() < 1e-2);
        kept += update.reused;
        // Without the test of validity some would be dark.
        if i == 30 {
            assert!(!all_lit(&accel, &at(45), &old));
        }
    }
    assert!(kept > 59 * 256 * 8 / 10, "{kept}");
}

#[test]
fn lights_go_with_their_surface_and_die_behind_another() {
    let scene = floor(2.0);
    let light = light(spot(Vec3::Y * 2.0, Vec3::NEG_Y));
    let mut state = State::new(Settings { recalc_min: 0, evenness: 0.0, ..settings(128) }).unwrap();
    state.update(&Accel::build(&scene, BuildPreset::Fast), &light);
    let before = state.vpls().to_vec();
    // The floor moves sideways: lights in the cone's middle go with it.
    let mut moved = scene.clone();
    let step = Vec3::new(0.8, 0.0, 0.0);
    moved.mesh.positions.iter_mut().for_each(|p| *p += step);
    let update = state.update(&Accel::build(&moved, BuildPreset::Fast), &light);
    assert!(update.reused > 64 && update.removed > 0, "{update:?}");
    let kept = state.vpls().iter().zip(state.fresh()).filter(|(_, fresh)| !**fresh);
    assert!(kept.clone().count() > 64);
    for (v, _) in kept {
        assert!(before.iter().any(|b| (b.position + step).distance(v.position) < 1e-6));
    }
    // Something comes between: half of the cone is dark, and what is new lies on it.
    let mut covered = scene.clone();
    push_square(&mut covered, Vec3::new(1.0, 1.0, 0.0), 1.0, Mat3::IDENTITY);
    let mut state =
        State::new(Settings { recalc_min: 0, evenness: 0.0, recalc_max: 128, ..settings(128) }).unwrap();
    state.update(&Accel::build(&scene, BuildPreset::Fast), &light);
    let update = state.update(&Accel::build(&covered, BuildPreset::Fast), &light);
    assert!((50..80).contains(&update.reused) && update.reused + update.inserted == 128, "{update:?}");
    // Its shadow on the floor is where x is positive.
    let kept = state.vpls().iter().zip(state.fresh()).filter(|(_, fresh)| !**fresh);
    assert!(kept.into_iter().all(|(v, _)| v.position.y < 0.5 && v.position.x < 1e-3));
    assert!(state.vpls().iter().filter(|v| v.position.y > 0.5).count() > 40);
    // The scene is gone, and comes back.
    let nothing = Scene::default();
    let update = state.update(&Accel::build(&nothing, BuildPreset::Fast), &light);
    assert!(state.vpls().is_empty() && update.removed == 128);
    state.update(&Accel::build(&scene, BuildPreset::Fast), &light);
    assert_eq!(state.vpls().len(), 128);
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let scene = room();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let accel = Accel::build(&scene, BuildPreset::Fast);
            let mut state = State::new(settings(400)).unwrap();
            for i in 0..10 {
                state.update(&accel, &light(spot(Vec3::new(0.02 * i as f32, 0.8, 0.0), Vec3::NEG_Y)));
            }
            (state.vpls().to_vec(), state.slots().to_vec())
        })
    };
    let one = run(1);
    assert!(one == run(2) && one == run(5));
}

#[test]
fn a_light_that_is_switched_on_again_has_its_lights_anew_or_as_they_were() {
    let scene = room();
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let on = light(LightKind::Point { position: Vec3::splat(0.3) });
    let off = Light { power: Vec3::ZERO, ..on.clone() };
    let mut state = State::new(Settings { recalc_min: 0, evenness: 0.0, ..settings(64) }).unwrap();
    let update = state.update(&accel, &off);
    assert!(update.inserted == 64 && state.vpls().is_empty());
    // Nobody saw them yet.
    state.update(&accel, &on);
    assert!(state.vpls().len() == 64 && state.fresh().iter().all(|&f| f));
    state.update(&accel, &off);
    assert!(state.vpls().is_empty());
    state.update(&accel, &on);
    assert!(state.vpls().len() == 64 && state.fresh().iter().all(|&f| !f));
}

#[test]
fn settings_are_checked() {
    assert!(State::new(Settings { count: 0, ..Settings::default() }).is_err());
    assert!(State::new(Settings { count: 5000, ..Settings::default() }).is_err());
    assert!(State::new(Settings { recalc_min: 64, recalc_max: 8, ..Settings::default() }).is_err());
    assert!(State::new(Settings { recalc_min: 64, recalc_max: 64, count: 8, ..Settings::default() }).is_ok());
}

fn any_light() -> impl Strategy<Value = Light> {
    let number = prop_oneof![
        6 => -2.0_f32..2.0,
        1 => Just(0.0), 1 => Just(-0.4), 1 => Just(1.0), 1 => Just(f32::NAN), 1 => Just(1e30), 1 => Just(f32::INFINITY)
    ];
    let vector = prop::array::uniform3(number.clone()).prop_map(Vec3::from);
    let kind = (0..3, vector.clone(), vector.clone(), 0.0_f32..1.6, 0.0_f32..1.6).prop_map(
        |(kind, position, direction, inner_angle, outer_angle)| match kind {
            0 => LightKind::Point { position },
            1 => LightKind::Directional { direction },
            _ => LightKind::Spot { position, direction, inner_angle, outer_angle },
        },
    );
    let power = prop_oneof![4 => Just(POWER), 1 => Just(Vec3::ZERO), 1 => vector];
    (kind, power, prop::option::of(0.0_f32..3.0)).prop_map(|(kind, power, range)| Light {
        name: String::new(),
        kind,
        power,
        range,
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_light_in_any_order_leaves_finite_lights(
        lights in prop::collection::vec((any_light(), 0_usize..5), 1..6),
        count in 1_u32..70, recalc_min in 0_u32..80, more in 1_u32..80, flux_density: bool, sequence: bool
    ) {
        let mut flat = floor(1.0);
        // Slivers and triangles without area.
        flat.mesh.positions[0] = flat.mesh.positions[1];
        let scenes = [room(), floor(1.0), flat, Scene::default(), {
            let mut s = room();
            s.mesh.positions.iter_mut().for_each(|p| *p = *p * 1e5 + Vec3::splat(3e5));
            s
        }];
        let settings = Settings {
            count, recalc_min, recalc_max: recalc_min.max(more), evenness: 0.01 * (count as f32), seed: count,
            density: Density::ALL[usize::from(flux_density)], start: Start::ALL[usize::from(sequence)],
        };
        let mut state = State::new(settings).unwrap();
        let mut sites = 0;
        for (light, scene) in &lights {
            let update = state.update(&Accel::build(&scenes[*scene], BuildPreset::Fast), light);
            let now = update.reused + update.inserted + update.empty;
            prop_assert!(now <= count && state.vpls().len() <= now as usize);
            prop_assert!(update.removed <= sites, "{:?}", update);
            sites = now;
            prop_assert_eq!(state.vpls().len(), state.slots().len());
            for v in state.vpls() {
                prop_assert!(v.position.is_finite() && v.flux.is_finite() && v.area.is_finite() && v.area >= 0.0);
                prop_assert!((v.normal.length() - 1.0).abs() < 1e-4 && v.flux.min_element() >= 0.0, "{:?}", v);
            }
        }
    }
}
