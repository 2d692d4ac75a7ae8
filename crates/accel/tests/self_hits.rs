//! A ray that starts where another one hit does not meet its own triangle again.

mod common;

use common::Random;
use glam::{Mat3, Vec3};
use indirect_accel::{Accel, BuildPreset};
use indirect_core::math::offset_ray_origin_scaled;
use indirect_core::{Ray, Scene};

fn meshes() -> Vec<(&'static str, Scene)> {
    let turn = |angle| Mat3::from_axis_angle(Vec3::new(1.0, 2.0, 3.0).normalize(), angle);
    vec![
        ("bumpy sphere", common::bumpy_sphere(60)),
        ("cube", common::cube(1, Mat3::IDENTITY)),
        ("turned cube", common::cube(1, turn(0.7))),
        ("barely turned cube", common::cube(1, turn(0.01))),
        ("slivers", common::slivers(500)),
    ]
}

#[test]
fn spawned_rays_never_hit_their_own_triangle() {
    const RAYS: usize = 1_000_000;
    let mut random = Random(7);
    let mut cases = Vec::new();
    for (name, scene) in meshes() {
        for offset in [0.0, 1e3, 1e5] {
            for direction in [Vec3::new(1.0, -1.0, 1.0), Vec3::X, Vec3::Y] {
                for scale in [0.01, 1.0, 1000.0] {
                    cases.push((name, scene.clone(), direction * offset, scale));
                }
            }
        }
    }
    let share = RAYS.div_ceil(cases.len());
    let mut failures = Vec::new();
    for (name, scene, offset, scale) in cases {
        let scene = common::placed(scene, scale, offset);
        let accel = Accel::build(&scene, BuildPreset::Best);
        let n = self_hits(&accel, share, &mut random);
        if n > 0 {
            failures.push(format!("{name} at {offset} × {scale}: {n} of {share}"));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

fn self_hits(accel: &Accel<'_>, rays: usize, random: &mut Random) -> usize {
    let scene = accel.scene();
    (0..rays)
        .filter(|_| {
            let triangle = random.below(scene.mesh.triangles.len()) as u32;
            let (u, v) = random.barycentric();
            let surface = scene.surface(triangle, u, v);
            let n = if random.bits() & 1 == 0 { surface.geometric_normal } else { -surface.geometric_normal };
            if n == Vec3::ZERO {
                return false;
            }
            // One in four leaves at a grazing angle, cosine 1e-6 … 1.
            let mut direction = random.hemisphere(n);
            if random.bits() & 3 == 0 {
                let along = direction - n * direction.dot(n);
                direction = along + n * 10.0_f32.powf(-6.0 * random.unit());
            }
            let ray = Ray::new(offset_ray_origin_scaled(surface.position, n, accel.unit()), direction);
            accel.closest_hit(&ray).is_some_and(|hit| hit.triangle == triangle)
        })
        .count()
}
