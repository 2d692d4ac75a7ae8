//! Degenerate input.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use common::{pairs, receivers, vpls};
use glam::Vec3;
use imperfect_shadow_maps::cpu::{Atlas, build, cast, resolve};
use imperfect_shadow_maps::{Options, Placement, Point, ScenePoint, place};
use indirect_accel::{Accel, BuildPreset};
use indirect_core::settings::Settings;
use indirect_core::{AlphaMode, Light, LightKind, Scene};
use proptest::prelude::*;
use rsm::Vpl;

fn finite(atlas: &Atlas) -> bool {
    atlas.depths.iter().chain(&atlas.coarse).all(|u| u.is_finite() && *u >= 0.0)
}

fn vpl(position: Vec3, normal: Vec3) -> Vpl {
    Vpl::new(position, normal, Vec3::ONE, 0.1)
}

#[test]
fn nothing_is_in_the_way_of_nothing() {
    let one = [vpl(Vec3::ZERO, Vec3::Z)];
    let o = Options { pull_push: 2, ..Options::default() };
    let empty = build(&one, &[], &o);
    assert!(empty.visible(0, Vec3::Z) && empty.visible_surface(0, Vec3::Z, Vec3::NEG_Z));
    let none = build(&[], &[Point::default()], &o);
    assert!(none.depths.is_empty() && !none.visible(0, Vec3::Z));
    let scene = Scene::default();
    let accel = Accel::build(&scene, BuildPreset::Fast);
    assert!(cast(&accel, &one, &o).visible(0, Vec3::Z) && cast(&accel, &[], &o).depths.is_empty());
    assert!(resolve(&scene, &[ScenePoint { triangle: 3, ..ScenePoint::default() }])[0].area == 0.0);
}

#[test]
fn options_say_what_they_take() {
    assert!(Options::default().validate().is_ok());
    for bad in [
        Options { tile: 48, ..Options::default() },
        Options { tile: 512, ..Options::default() },
        Options { points_per_map: 0, ..Options::default() },
        Options { overlap: f32::NAN, ..Options::default() },
    ] {
        assert!(bad.validate().is_err(), "{bad:?}");
    }
}

/// Points in the holes of an alpha mask draw nothing.
#[test]
fn masks_have_holes() {
    let mut scene = indirect_scene::fixtures::build("cornell_spot").unwrap();
    for m in &mut scene.materials {
        (m.alpha_mode, m.base_alpha) = (AlphaMode::Mask { cutoff: 0.5 }, 0.25);
    }
    let points = resolve(&scene, &place(&scene, 100, &[], Placement::Random, 0));
    assert!(points.iter().all(|p| p.area == 0.0));
}

fn scaled(mut scene: Scene, s: f32) -> Scene {
    scene.mesh.positions.iter_mut().for_each(|p| *p *= s);
    let of = |l: Light| {
        let kind = match l.kind {
            LightKind::Point { position } => LightKind::Point { position: position * s },
            LightKind::Spot { position, direction, inner_angle, outer_angle } => {
                LightKind::Spot { position: position * s, direction, inner_angle, outer_angle }
            }
            directional @ LightKind::Directional { .. } => directional,
        };
        Light { kind, ..l }
    };
    scene.lights = scene.lights.into_iter().map(of).collect();
    scene
}

/// A scene of any scale has the same shadows: bit for bit where the scale is a power of two, and but for the answers that hang on a
/// rounding where it is not (10⁻⁶ of a texel's 10⁻² of the range of depths, and as much of the borders of texels: one in 10⁴).
#[test]
fn scale_changes_no_answer() {
    let scene = indirect_scene::fixtures::build("two_rooms").unwrap();
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let lights = vpls(&accel, 32, 1);
    let asked = pairs(&accel, &lights, &receivers(&scene, 2000, 2), 8);
    let o = Options { pull_push: 2, ..Options::default() };
    let samples = place(&scene, o.points, &[], o.placement, 3);
    let answers = |s: f32| -> Vec<bool> {
        let scene = scaled(scene.clone(), s);
        let lights: Vec<Vpl> =
            lights.iter().map(|v| Vpl { position: v.position * s, area: v.area * s * s, ..*v }).collect();
        let moved: Vec<_> = samples.iter().map(|p| ScenePoint { area: p.area * s * s, ..*p }).collect();
        let atlas = build(&lights, &resolve(&scene, &moved), &o);
        assert!(finite(&atlas));
        let ask = |p: &common::Pair| {
            let r = p.receiver * s;
            [atlas.visible(p.vpl, r), atlas.visible_surface(p.vpl, r, p.normal)]
        };
        asked.iter().flat_map(ask).collect()
    };
    let unit = answers(1.0);
    assert!(unit.iter().any(|a| *a) && unit.iter().any(|a| !*a));
    for s in [1.0 / 1024.0, 131_072.0] {
        assert_eq!(answers(s), unit, "{s}");
    }
    for s in [1e-3, 1e5] {
        let differ = answers(s).iter().zip(&unit).filter(|(a, b)| a != b).count();
        assert!(differ * 2000 < unit.len(), "{s}: {differ} of {}", unit.len());
    }
}

#[test]
fn threads_change_nothing() {
    let scene = indirect_scene::fixtures::build("cornell_spot").unwrap();
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let lights = vpls(&accel, 37, 1);
    let o = Options { pull_push: 3, ..Options::default() };
    let points = resolve(&scene, &place(&scene, o.points, &[], o.placement, 3));
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| (build(&lights, &points, &o), cast(&accel, &lights, &o)))
    };
    assert_eq!(with(1), with(5));
}

fn vector(size: f32) -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(-size..size).prop_map(Vec3::from)
}

/// A coordinate that is now and then no number, nothing, or far too large.
fn wild() -> impl Strategy<Value = f32> {
    prop_oneof![
        8 => -2.0_f32..2.0,
        1 => prop_oneof![Just(0.0), Just(f32::NAN), Just(f32::INFINITY), Just(-1e30_f32), Just(1e-38_f32)],
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    /// No panic and no number that is none, whatever points and VPLs are like, a point on a VPL and one per map included.
    #[test]
    fn wild_points_do_no_harm(
        points in prop::collection::vec((prop::array::uniform7(wild()), any::<bool>()), 0..40),
        normal in vector(1.0), position in vector(1.0),
        tile in 0_u32..=8, pull_push in 0_u32..=4, points_per_map in 1_u32..50, receiver in prop::array::uniform3(wild()),
    ) {
        let lights = [vpl(position, indirect_core::math::normalize_or(normal, Vec3::Z)); 3];
        let points: Vec<Point> = points
            .iter()
            .map(|([a, b, c, d, e, f, area], on_vpl)| Point {
                position: if *on_vpl { position } else { Vec3::new(*a, *b, *c) },
                normal: Vec3::new(*d, *e, *f),
                area: *area,
                ..Point::default()
            })
            .collect();
        let o = Options { tile: 1 << tile, pull_push, points_per_map, ..Options::default() };
        let atlas = build(&lights, &points, &o);
        prop_assert!(finite(&atlas));
        for j in 0..4 {
            let r = Vec3::from(receiver);
            let _ = (atlas.visible(j, r), atlas.visible_surface(j, r, normal));
        }
    }

    /// A point in front of a receiver shades it, one behind it does not, at any distance.
    #[test]
    fn one_point_shades_what_is_behind_it(
        normal in vector(1.0), across in prop::array::uniform2(-1.0_f32..1.0), exponent in -4.0_f32..4.0, tile in 3_u32..=8,
    ) {
        let normal = indirect_core::math::normalize_or(normal, Vec3::Z);
        let (t, b) = indirect_core::math::orthonormal_basis(normal);
        let distance = 10.0_f32.powf(exponent);
        let direction = (normal + t * across[0] + b * across[1]).normalize();
        let light = vpl(normal * distance, normal);
        let at = |d: f32| light.position + direction * (d * distance);
        let p = Point { position: at(1.0), normal: direction, area: 0.3 * distance * distance, ..Point::default() };
        let atlas = build(&[light], &[p], &Options { tile: 1 << tile, ..Options::default() });
        prop_assert!(!atlas.visible_surface(0, at(3.0), -direction));
        prop_assert!(atlas.visible_surface(0, at(0.3), -direction) && atlas.visible(0, at(0.3)));
        prop_assert!(atlas.visible_surface(0, at(1.0), -direction));
    }
}
