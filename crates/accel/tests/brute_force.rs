//! The tree finds what a loop over all triangles finds.

mod common;

use common::Random;
use glam::{DVec3, Vec3};
use indirect_accel::{Accel, BuildPreset};
use indirect_core::{Hit, Ray, Scene};
use proptest::prelude::*;

const PRESETS: [BuildPreset; 3] = [BuildPreset::Fast, BuildPreset::Balanced, BuildPreset::Best];

/// Every triangle alone, so that no tree is involved.
fn alone(scene: &Scene) -> Vec<Scene> {
    let one = |i: u32| common::scene(scene.mesh.corners(i).to_vec(), vec![[0, 1, 2]]);
    (0..scene.mesh.triangles.len() as u32).map(one).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn tree_and_loop_agree(
        seed: u32, n in 1_usize..120, exponent in -3_i32..=5, far in prop::sample::select(vec![0.0_f32, 1.0, 100.0])
    ) {
        let mut random = Random(seed);
        let size = 10.0_f32.powi(exponent);
        let offset = random.direction() * (far * size);
        let scene = common::soup(&mut random, n, size, offset);
        let single = alone(&scene);
        let single: Vec<Accel<'_>> = single.iter().map(|s| Accel::build(s, BuildPreset::Fast)).collect();
        let trees = PRESETS.map(|preset| Accel::build(&scene, preset));
        for _ in 0..100 {
            let origin = offset + random.cube() * (1.5 * size);
            let mut direction = random.direction() * 10.0_f32.powf(4.0 * random.unit() - 2.0);
            match random.below(6) {
                0 => direction = Vec3::Z.copysign(direction),
                1 => direction.x = -0.0,
                // At a vertex.
                2 => direction = scene.mesh.positions[random.below(scene.mesh.positions.len())] - origin,
                _ => {}
            }
            let t_max = if random.bits() & 1 == 0 { f32::INFINITY } else { size * random.unit() / direction.length() };
            let ray = Ray { origin, direction, t_max };
            let hits = single.iter().enumerate().filter_map(|(i, a)| {
                a.closest_hit(&ray).map(|hit| Hit { triangle: i as u32, ..hit })
            });
            let expected = hits.reduce(|a, b| if b.t < a.t { b } else { a });
            for tree in &trees {
                prop_assert_eq!(tree.closest_hit(&ray), expected, "{:?}", ray);
                prop_assert_eq!(tree.any_hit(&ray), expected.is_some(), "{:?}", ray);
            }
        }
    }
}

/// `t`, `u` and `v` against f64 arithmetic on the same f32 input.
#[test]
fn hits_are_accurate() {
    let mut random = Random(3);
    let mut worst = [0.0_f64; 2];
    for exponent in [-3, 0, 5] {
        let size = 10.0_f32.powi(exponent);
        for _ in 0..100_000 {
            let [a, b, c] = core::array::from_fn(|_| random.cube() * size);
            let origin = random.cube() * (2.0 * size);
            let (u, v) = random.barycentric();
            let direction = a * (1.0 - u - v) + b * u + c * v - origin;
            let scene = common::scene(vec![a, b, c], vec![[0, 1, 2]]);
            let accel = Accel::build(&scene, BuildPreset::Fast);
            let Some(hit) = accel.closest_hit(&Ray::new(origin, direction)) else { continue };
            // Möller & Trumbore in f64.
            let [a, b, c, o, d] = [a, b, c, origin, direction].map(Vec3::as_dvec3);
            let (e1, e2, s) = (b - a, c - a, o - a);
            let (p, q) = (d.cross(e2), s.cross(e1));
            let det = e1.dot(p);
            let exact = DVec3::new(e2.dot(q), s.dot(p), d.dot(q)) / det;
            // Edge functions err by some u of the products of the sheared vertices (at most 4·size each way), which
            // their sum `det` divides: 64u·size²·|d|/|det|. The depth adds as much times its range over |d|·t.
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
    println!("largest error of t and of u, v, in units of ε·(1 + condition): {worst:.2?}");
    assert!(worst[0] < 4.0 && worst[1] < 4.0, "{worst:?}");
}
