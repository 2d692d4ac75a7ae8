//! Points are spread over surfaces in proportion to area and weight.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use glam::{DVec3, Vec3};
use imperfect_shadow_maps::{Placement, ScenePoint, place};
use indirect_core::{Material, Scene};
use indirect_sampling::analysis::l2_star_discrepancy;
use indirect_scene::fixtures::build;

const BOTH: [Placement; 2] = [Placement::LowDiscrepancy, Placement::Random];

fn area(scene: &Scene) -> f64 {
    (0..scene.mesh.triangles.len() as u32).map(|t| f64::from(scene.mesh.area(t))).sum()
}

fn total(points: &[ScenePoint]) -> f64 {
    points.iter().map(|p| f64::from(p.area)).sum()
}

#[test]
fn areas_sum_to_the_surface() {
    for name in ["cornell_spot", "two_rooms", "atrium"] {
        let scene = build(name).unwrap();
        for placement in BOTH {
            for weights in [&[][..], &[1.0, 3.0, 0.5]] {
                let found = total(&place(&scene, 10_000, weights, placement, 5));
                // One rounding to f32 per point and per triangle: 10⁻⁷ each.
                assert!((found / area(&scene) - 1.0).abs() < 1e-6, "{name} {placement:?} {found}");
            }
        }
    }
}

/// The first moment of the surface, `∫ x dA`, in closed form per triangle.
fn moment(scene: &Scene) -> DVec3 {
    (0..scene.mesh.triangles.len() as u32)
        .map(|t| {
            let [a, b, c] = scene.mesh.corners(t).map(|p| p.as_dvec3());
            (a + b + c) / 3.0 * f64::from(scene.mesh.area(t))
        })
        .sum()
}

/// How far the moment of some points is from that of the surface, over area times extent.
fn moment_error(scene: &Scene, points: &[ScenePoint]) -> f64 {
    let found: DVec3 = points
        .iter()
        .map(|p| scene.surface(p.triangle, p.u, p.v).position.as_dvec3() * f64::from(p.area))
        .sum();
    let extent = f64::from(scene.bounds().unwrap().diagonal());
    (found - moment(scene)).length() / (area(scene) * extent)
}

#[test]
fn moments_are_those_of_the_surface() {
    const COUNT: u32 = 4096;
    for name in ["cornell_spot", "atrium"] {
        let scene = build(name).unwrap();
        // Independent points: the root mean square distance of two points is below the extent, its component errors add up to
        // that over √n; four of them.
        let bound = 4.0 / f64::from(COUNT).sqrt();
        let random = moment_error(&scene, &place(&scene, COUNT, &[], Placement::Random, 1));
        assert!(random < bound, "{name}: {random}");
        // 1/n but for logarithms: an eighth of the random bound is far from both.
        let even = moment_error(&scene, &place(&scene, COUNT, &[], Placement::LowDiscrepancy, 1));
        assert!(even < bound / 8.0, "{name}: {even}");
        // Planted fault: triangles in turn instead of in proportion to area.
        let mut wrong = place(&scene, COUNT, &[], Placement::LowDiscrepancy, 1);
        let triangles = scene.mesh.triangles.len() as u32;
        for (i, p) in (0..).zip(&mut wrong) {
            p.triangle = (i * 7919) % triangles;
        }
        let error = moment_error(&scene, &wrong);
        assert!(error > bound / 8.0, "{name}: {error}");
    }
}

/// Every run of a map is spread evenly over a square, wherever it begins: no less evenly than half of what random points are.
#[test]
fn runs_are_even() {
    const RUN: usize = 512;
    let mut scene = Scene { materials: vec![Material::diffuse("m", Vec3::ONE)], ..Scene::default() };
    scene.mesh.push_polygon(&[Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y], 0);
    let runs = |placement| -> Vec<f64> {
        let points = place(&scene, 16 * RUN as u32 + 100, &[], placement, 9);
        let of = |begin: usize| {
            let run = &points[begin..begin + RUN];
            let places: Vec<[f64; 2]> = run
                .iter()
                .map(|p| scene.surface(p.triangle, p.u, p.v).position.as_dvec3())
                .map(|p| [p.x, p.y])
                .collect();
            l2_star_discrepancy(&places)
        };
        // At multiples of the run, as maps begin, and elsewhere.
        (0..16).flat_map(|k| [of(k * RUN), of(k * RUN + 37)]).collect()
    };
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let random = mean(&runs(Placement::Random));
    // Of n random points: √((2⁻² − 3⁻²)/n).
    let expected = ((1.0 / 4.0 - 1.0 / 9.0) / RUN as f64).sqrt();
    assert!((random / expected - 1.0).abs() < 0.2, "{random} {expected}");
    let even = runs(Placement::LowDiscrepancy);
    assert!(even.iter().all(|d| *d < 0.5 * expected), "{even:?} {expected}");
}

#[test]
fn weights_move_points_and_keep_areas() {
    let mut scene = Scene { materials: vec![Material::diffuse("m", Vec3::ONE); 3], ..Scene::default() };
    let square = [Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y];
    for material in 0..3 {
        scene.mesh.push_polygon(&square.map(|p| p + Vec3::Z * material as f32), material);
    }
    let points = place(&scene, 1000, &[3.0, 0.0], Placement::LowDiscrepancy, 2);
    let of = |material| -> Vec<ScenePoint> {
        points.iter().filter(|p| p.triangle / 2 == material).copied().collect()
    };
    // Weights 3, 0 and 1 (not given) on equal areas: 750, none and 250, to within the discrepancy of 1000 points in base 5.
    assert!(of(0).len().abs_diff(750) <= 5 && of(1).is_empty(), "{} {}", of(0).len(), of(1).len());
    for material in [0, 2] {
        assert!((total(&of(material)) - 1.0).abs() < 1e-6);
    }
    for bad in [f32::NAN, f32::INFINITY, -1.0] {
        assert!(place(&scene, 10, &[bad; 3], Placement::Random, 0).is_empty());
    }
}

#[test]
fn the_same_arguments_give_the_same_points_and_seeds_others() {
    let scene = build("cornell_spot").unwrap();
    for placement in BOTH {
        let points = |seed| place(&scene, 100, &[], placement, seed);
        assert_eq!(points(1), points(1));
        assert_ne!(points(1), points(2));
        for p in points(3) {
            assert!(p.u >= 0.0 && p.v >= 0.0 && p.u + p.v <= 1.0 + f32::EPSILON);
        }
    }
}

#[test]
fn nothing_gives_nothing() {
    let mut scene = Scene::default();
    assert!(place(&scene, 10, &[], Placement::Random, 0).is_empty());
    scene.materials.push(Material::diffuse("m", Vec3::ONE));
    scene.mesh.push_polygon(&[Vec3::ZERO; 3], 0);
    assert!(place(&scene, 10, &[], Placement::LowDiscrepancy, 0).is_empty());
    assert!(place(&build("cornell_spot").unwrap(), 0, &[], Placement::Random, 0).is_empty());
}
