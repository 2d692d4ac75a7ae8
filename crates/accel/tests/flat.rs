//! The flat tree on the CPU, which the GPU's queries are held against, finds what [`Accel`] finds.

mod common;

use common::Random;
use glam::{DVec3, Mat3, Vec3};
use indirect_accel::{Accel, BuildPreset, FlatTree, FlatTriangle, RefitError, STACK, opaque};
use indirect_core::math::offset_ray_origin_scaled;
use indirect_core::{Hit, Ray, Scene};
use proptest::prelude::*;

/// How two answers to the same ray compare.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
struct Tally {
    rays: usize,
    hits: usize,
    /// Other triangles at the same distance.
    ties: usize,
    /// The second hits something nearer, or at all.
    wider: usize,
    /// The second misses what the first hits.
    lost: usize,
}

impl Tally {
    /// `near` is how far apart two distances are that count as one, as a share of the reach of rays and scene.
    fn add(&mut self, a: Option<Hit>, b: Option<Hit>, near: f32) {
        self.rays += 1;
        self.hits += usize::from(a.is_some());
        match (a, b) {
            (None, None) => {}
            (Some(a), Some(b)) if (a.t - b.t).abs() <= near => {
                self.ties += usize::from(a.triangle != b.triangle);
            }
            (Some(a), Some(b)) if b.t < a.t => self.wider += 1,
            (None, Some(_)) => self.wider += 1,
            _ => self.lost += 1,
        }
    }
}

#[test]
fn fixtures_are_hit_as_by_the_wide_tree() {
    let mut random = Random(21);
    let mut all = Tally::default();
    for name in indirect_scene::fixtures::NAMES {
        let scene = indirect_scene::fixtures::build(name).unwrap();
        let accel = Accel::build(&scene, BuildPreset::Balanced);
        let tree = FlatTree::of(&accel);
        let solid = |t, u, v| scene.is_solid(t, u, v);
        let (mut tally, mut most) = (Tally::default(), 0);
        for ray in common::rays(&accel, 96, &mut random) {
            let (hit, rounds) = tree.closest_hit_counted(&ray, solid);
            most = most.max(rounds);
            // Distances err by some ε of the way; grazing ones by more, and those are few.
            let near = 1e-5 * accel.unit() / ray.direction.length();
            tally.add(accel.closest_hit(&ray), hit, near);
            assert_eq!(tree.any_hit(&ray, solid), hit.is_some(), "{name} {ray:?}");
        }
        println!(
            "{name}: {tally:?}, {most} rounds at most, depth {}, {} nodes",
            tree.depth(),
            tree.nodes().len()
        );
        (all.rays, all.hits) = (all.rays + tally.rays, all.hits + tally.hits);
        (all.ties, all.wider, all.lost) =
            (all.ties + tally.ties, all.wider + tally.wider, all.lost + tally.lost);
        assert!(tree.depth() <= STACK);
    }
    println!("{all:?}");
    assert!(all.hits > all.rays / 2);
    // An edge counts within up to 32ε = 4·10⁻⁶ of the distance. A triangle a hundredth of the distance across has a border of that width
    // on an 800th of its area at each edge, and some of these are silhouettes; larger ones, as most are, less.
    assert!(all.wider * 1000 <= all.rays && all.ties * 400 <= all.rays, "{all:?}");
    // Whatever the wide tree's own rounding takes in lies within the bounds of the flat one's.
    assert_eq!(all.lost, 0, "{all:?}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn soups_are_hit_as_by_the_wide_tree(
        seed: u32, n in 1_usize..300, exponent in -3_i32..=5, far in prop::sample::select(vec![0.0_f32, 1.0, 100.0])
    ) {
        let mut random = Random(seed);
        let size = 10.0_f32.powi(exponent);
        let offset = random.direction() * (far * size);
        let scene = common::soup(&mut random, n, size, offset);
        for preset in [BuildPreset::Fast, BuildPreset::Best] {
            let accel = Accel::build(&scene, preset);
            let tree = FlatTree::of(&accel);
            let mut tally = Tally::default();
            for _ in 0..400 {
                let origin = offset + random.cube() * (1.5 * size);
                let mut direction = random.direction() * 10.0_f32.powf(4.0 * random.unit() - 2.0);
                match random.below(6) {
                    0 => direction = Vec3::Z.copysign(direction),
                    1 => direction.x = -0.0,
                    _ => {}
                }
                let t_max = if random.bits() & 1 == 0 { f32::INFINITY } else { size * random.unit() / direction.length() };
                let ray = Ray { origin, direction, t_max };
                let hit = tree.closest_hit(&ray, opaque);
                prop_assert_eq!(tree.any_hit(&ray, opaque), hit.is_some(), "{:?}", ray);
                tally.add(accel.closest_hit(&ray), hit, 1e-5 * accel.unit() / direction.length());
            }
            // In one plane, or edge on, rounding decides which one is met: some rays in a case, not some per cent of all.
            prop_assert!(tally.wider + tally.lost <= 4 && tally.ties <= 20, "{:?}", tally);
        }
    }
}

/// `t`, `u` and `v` against f64 arithmetic on the same f32 input.
#[test]
fn hits_are_accurate() {
    let mut random = Random(3);
    let mut worst = [0.0_f64; 2];
    let mut missed = 0;
    for exponent in [-3, 0, 5] {
        let size = 10.0_f32.powi(exponent);
        for _ in 0..30_000 {
            let [a, b, c] = core::array::from_fn(|_| random.cube() * size);
            let origin = random.cube() * (2.0 * size);
            let (u, v) = random.barycentric();
            let direction = a * (1.0 - u - v) + b * u + c * v - origin;
            let scene = common::scene(vec![a, b, c], vec![[0, 1, 2]]);
            let tree = FlatTree::of(&Accel::build(&scene, BuildPreset::Fast));
            let Some(hit) = tree.closest_hit(&Ray::new(origin, direction), opaque) else {
                missed += 1;
                continue;
            };
            // Möller & Trumbore in f64.
            let [a, b, c, o, d] = [a, b, c, origin, direction].map(Vec3::as_dvec3);
            let (e1, e2, s) = (b - a, c - a, o - a);
            let (p, q) = (d.cross(e2), s.cross(e1));
            let det = e1.dot(p);
            let exact = DVec3::new(e2.dot(q), s.dot(p), d.dot(q)) / det;
            // As for the wide tree: edge functions err by some u of the products of the sheared vertices (at most 4·size each way),
            // which their sum `det` divides.
            let condition = 16.0 * f64::from(size).powi(2) * d.length() / det.abs();
            let error = [
                (f64::from(hit.t) - exact.x).abs(),
                (f64::from(hit.u) - exact.y).abs().max((f64::from(hit.v) - exact.z).abs()),
            ];
            for (worst, e) in worst.iter_mut().zip(error) {
                *worst = worst.max(e / (f64::from(f32::EPSILON) * (1.0 + condition)));
            }
        }
    }
    println!("largest error of t and of u, v, in units of ε·(1 + condition): {worst:.2?}; {missed} missed");
    assert!(worst[0] < 4.0 && worst[1] < 4.0, "{worst:?}");
    // Aimed at the triangle's inside; the target's own rounding may put it beside a sliver.
    assert!(missed < 9, "{missed}");
}

#[test]
fn no_ray_leaves_a_closed_mesh() {
    let turn = Mat3::from_axis_angle(Vec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
    let meshes = [
        ("bumpy sphere", common::bumpy_sphere(60)),
        ("cube", common::cube(1, Mat3::IDENTITY)),
        ("fine cube", common::cube(16, Mat3::IDENTITY)),
        ("turned cube", common::cube(20, turn)),
        ("slivers", common::slivers(1000)),
    ];
    let mut random = Random(1);
    let mut total = 0;
    for (name, mesh) in meshes {
        for offset in [0.0, 1e3, 1e5] {
            for scale in [1e-3, 1.0, 1e3, 1e5] {
                // Below some tens of representable coordinates across, rounding leaves a mesh no inside.
                if scale <= 32.0 * offset * f32::EPSILON {
                    continue;
                }
                let centre = Vec3::new(offset, -offset, offset);
                let scene = common::placed(mesh.clone(), scale, centre);
                let tree = FlatTree::of(&Accel::build(&scene, BuildPreset::Best));
                let mut leaks = 0;
                for ray in common::aimed(&scene, centre, scale, 12_000, &mut random) {
                    let out = tree.closest_hit(&ray, opaque).is_none() || !tree.any_hit(&ray, opaque);
                    (leaks, total) = (leaks + usize::from(out), total + 1);
                }
                assert_eq!(leaks, 0, "{name} at {offset} × {scale}");
            }
        }
    }
    println!("0 of {total} rays leave");
}

#[test]
fn spawned_rays_do_not_hit_their_own_triangle() {
    let turn = |angle| Mat3::from_axis_angle(Vec3::new(1.0, 2.0, 3.0).normalize(), angle);
    let meshes = [
        ("bumpy sphere", common::bumpy_sphere(60)),
        ("cube", common::cube(1, Mat3::IDENTITY)),
        ("barely turned cube", common::cube(1, turn(0.01))),
    ];
    let mut random = Random(7);
    for (name, mesh) in meshes {
        for offset in [0.0, 1e3] {
            for scale in [1e-3, 1.0, 1e3] {
                if scale <= 32.0 * offset * f32::EPSILON {
                    continue;
                }
                let scene = common::placed(mesh.clone(), scale, Vec3::new(offset, -offset, offset));
                let accel = Accel::build(&scene, BuildPreset::Balanced);
                let tree = FlatTree::of(&accel);
                let mut own = 0;
                for _ in 0..20_000 {
                    let triangle = random.below(scene.mesh.triangles.len()) as u32;
                    let (u, v) = random.barycentric();
                    let surface = scene.surface(triangle, u, v);
                    let side = if random.bits() & 1 == 0 { 1.0 } else { -1.0 };
                    let n = surface.geometric_normal * side;
                    let origin = offset_ray_origin_scaled(surface.position, n, accel.unit());
                    let ray = Ray::new(origin, random.hemisphere(n));
                    own +=
                        usize::from(tree.closest_hit(&ray, opaque).is_some_and(|h| h.triangle == triangle));
                }
                assert_eq!(own, 0, "{name} at {offset} × {scale}");
            }
        }
    }
}

fn flat(scene: &Scene) -> FlatTree {
    FlatTree::of(&Accel::build(scene, BuildPreset::Best))
}

#[test]
fn an_empty_scene_hits_nothing() {
    let tree = flat(&Scene::default());
    let ray = Ray::new(Vec3::ZERO, Vec3::Z);
    assert!(tree.closest_hit(&ray, opaque).is_none() && !tree.any_hit(&ray, opaque));
    assert_eq!((tree.nodes().len(), tree.triangles().len(), tree.depth()), (1, 0, 0));
}

#[test]
fn what_has_no_area_is_left_out() {
    let mut scene = common::square(0.0);
    scene.mesh.positions.extend([
        Vec3::NAN,
        Vec3::new(-0.5, 1.0, 0.0),
        Vec3::new(0.0, 1.0, 0.0),
        Vec3::Y + 0.5 * Vec3::X,
    ]);
    scene.mesh.normals.extend([Vec3::Y; 4]);
    for bad in [[0, 1, 4], [0, 1, 99], [0, 0, 1], [2, 2, 2], [5, 6, 7]] {
        scene.mesh.triangles.push(bad);
        scene.mesh.materials.push(0);
    }
    let tree = flat(&scene);
    assert_eq!(tree.triangles().len(), 2);
    // Through the middle of the three points in a row.
    let hit = tree.closest_hit(&Ray::new(Vec3::Y * 2.0, Vec3::NEG_Y), opaque).unwrap();
    assert_eq!(hit.t, 2.0);
    // Nothing but triangles without area.
    let line = common::scene(vec![Vec3::ZERO, Vec3::X, Vec3::X * 2.0], vec![[0, 1, 2]; 100]);
    let tree = flat(&line);
    assert!(
        tree.triangles().is_empty()
            && !tree.any_hit(&Ray::new(Vec3::new(0.5, 1.0, 0.0), Vec3::NEG_Y), opaque)
    );
}

#[test]
fn odd_rays_hit_nothing() {
    let tree = flat(&common::square(0.0));
    let good = Ray::new(Vec3::new(0.3, 1.0, 0.1), Vec3::NEG_Y);
    assert!(tree.any_hit(&good, opaque));
    for ray in common::odd_rays(good) {
        assert!(tree.closest_hit(&ray, opaque).is_none() && !tree.any_hit(&ray, opaque), "{ray:?}");
    }
}

#[test]
fn the_interval_is_half_open() {
    let tree = flat(&common::square(0.0));
    let down = |y: f32, t_max: f32| {
        let ray = Ray { origin: Vec3::new(0.3, y, 0.1), direction: Vec3::NEG_Y, t_max };
        assert_eq!(tree.closest_hit(&ray, opaque).is_some(), tree.any_hit(&ray, opaque));
        tree.closest_hit(&ray, opaque).map(|hit| hit.t)
    };
    assert_eq!(down(2.0, f32::INFINITY), Some(2.0));
    assert_eq!(down(2.0, 2.0_f32.next_up()), Some(2.0));
    assert_eq!(down(2.0, 2.0), None);
    assert_eq!(down(0.0, 1.0), Some(0.0));
    assert_eq!(down(-1e-30, 1.0), None);
}

#[test]
fn a_ray_in_a_plane_does_not_hit_it() {
    // As the wide tree: a floor does not shadow what stands on it.
    let tree = flat(&common::square(0.0));
    for direction in [Vec3::X, Vec3::Z, Vec3::new(1.0, 0.0, 0.3)] {
        assert!(!tree.any_hit(&Ray::new(Vec3::new(-2.0, 0.0, 0.1), direction), opaque));
    }
}

#[test]
fn sizes_from_the_tiny_to_the_huge_in_one_scene() {
    let mut positions = Vec::new();
    for exponent in -40..40 {
        let s = 2.0_f32.powi(exponent);
        positions.extend([Vec3::new(-s, -s, s), Vec3::new(2.0 * s, -s, s), Vec3::new(-s, 2.0 * s, s)]);
    }
    let triangles = (0..80).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let tree = flat(&common::scene(positions, triangles));
    for exponent in -40..40 {
        let start = 2.0_f32.powi(exponent) * 0.75;
        let hit = tree.closest_hit(&Ray::new(Vec3::Z * start, Vec3::Z), opaque).unwrap();
        assert_eq!((hit.triangle as i32 - 40, hit.t), (exponent, start / 3.0));
    }
}

#[test]
fn many_equal_triangles_give_the_first() {
    let mut scene = common::square(0.0);
    scene.mesh.triangles.extend([[0, 1, 2]; 2000]);
    scene.mesh.materials.extend([0; 2000]);
    let hit = flat(&scene).closest_hit(&Ray::new(Vec3::new(0.5, 1.0, 0.1), Vec3::NEG_Y), opaque).unwrap();
    assert_eq!((hit.triangle, hit.t), (0, 1.0));
}

#[test]
fn rays_pass_through_the_holes_of_a_mask() {
    let scene = common::masked(common::square(1.0), common::square(0.0));
    let tree = flat(&scene);
    assert!(tree.is_masked() && !flat(&common::square(0.0)).is_masked());
    let mut random = Random(9);
    for _ in 0..10_000 {
        let p = random.cube();
        let ray = Ray::new(Vec3::new(p.x, 2.0, p.z), Vec3::NEG_Y);
        let solid = |t, u, v| scene.is_solid(t, u, v);
        let hit = tree.closest_hit(&ray, solid).unwrap();
        if p.x.abs().min(p.z.abs()) > 1e-5 {
            // Bilinear alpha of the checkerboard crosses 1/2 on the two axes.
            let expected = if p.x * p.z < 0.0 { 1.0 } else { 2.0 };
            assert_eq!(hit.t, expected, "{p}");
            assert_eq!(tree.any_hit(&Ray { t_max: 1.5, ..ray }, solid), expected == 1.0);
        }
        assert_eq!(tree.closest_hit(&ray, opaque).unwrap().t, 1.0);
    }
}

#[test]
fn a_refitted_tree_finds_what_a_new_one_finds() {
    let mut random = Random(13);
    let old = common::both(common::bumpy_sphere(30), common::cube(1, Mat3::IDENTITY));
    let mut tree = flat(&old);
    // Every vertex elsewhere, some triangles flat, some not finite.
    let mut new = old.clone();
    for p in &mut new.mesh.positions {
        *p = *p * Vec3::new(1.0, 3.0, 0.5) + random.cube() * 0.05 + Vec3::X * 10.0;
    }
    let [a, b, _] = new.mesh.triangles[50];
    new.mesh.positions[b as usize] = new.mesh.positions[a as usize];
    new.mesh.positions[new.mesh.triangles[99][0] as usize] = Vec3::NAN;
    tree.refit(&new).unwrap();
    assert!(tree.triangles().iter().any(|t| t.flags & FlatTriangle::VOID != 0));
    let fresh = flat(&new);
    let mut hits = 0;
    for _ in 0..20_000 {
        let origin = Vec3::X * 10.0 + random.cube() * 4.0;
        let ray = Ray::new(origin, Vec3::X * 10.0 + random.cube() - origin);
        let hit = tree.closest_hit(&ray, opaque);
        // The same triangles are tested the same way: equal to the bit.
        assert_eq!(hit, fresh.closest_hit(&ray, opaque));
        hits += usize::from(hit.is_some());
    }
    assert!(hits > 10_000, "{hits}");
    // Back again.
    tree.refit(&old).unwrap();
    let fresh = flat(&old);
    for _ in 0..5000 {
        let ray = Ray::new(random.cube() * 2.0, random.direction());
        assert_eq!(tree.closest_hit(&ray, opaque), fresh.closest_hit(&ray, opaque));
    }
    let other = common::square(0.0);
    let error = RefitError::Triangles { expected: old.mesh.triangles.len(), found: 2 };
    let before = tree.clone();
    assert_eq!(tree.refit(&other), Err(error));
    assert_eq!(tree, before);
}
