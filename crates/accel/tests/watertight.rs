//! No ray leaves a closed mesh, wherever it is aimed and however the mesh is placed.

mod common;

use common::Random;
use glam::{Mat3, Vec3};
use indirect_accel::{Accel, BuildPreset};
use indirect_core::{Ray, Scene};

const OFFSETS: [f32; 3] = [0.0, 1e3, 1e5];
const SCALES: [f32; 6] = [0.01, 0.1, 1.0, 10.0, 100.0, 1000.0];

/// Closed meshes around the origin. Next to the fine sphere the cube's faces are large: they are split.
fn meshes() -> Vec<(&'static str, Scene)> {
    let turn = Mat3::from_axis_angle(Vec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
    vec![
        ("bumpy sphere", common::bumpy_sphere(100)),
        ("cube", common::cube(1, Mat3::IDENTITY)),
        ("turned cube", common::cube(20, turn)),
        ("slivers", common::slivers(2000)),
        (
            "cube in a sphere",
            common::both(common::cube(1, turn), common::placed(common::bumpy_sphere(60), 3.0, Vec3::ZERO)),
        ),
    ]
}

/// Number of rays from inside, aimed at the edges (1 in 4 at a vertex), that either query lets out.
fn leaks(accel: &Accel<'_>, centre: Vec3, scale: f32, rays: usize, random: &mut Random) -> usize {
    let mesh = &accel.scene().mesh;
    let escapes = |_: &usize| {
        // The first triangles get half of the rays: of several meshes, the first is the innermost.
        let among = if random.bits() & 1 == 0 { mesh.triangles.len() } else { mesh.triangles.len().min(12) };
        let corners = mesh.corners(random.below(among) as u32);
        let k = random.below(3);
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        let s = if random.bits() & 3 == 0 { 0.0 } else { random.unit() };
        let target = a + (b - a) * s;
        // Within a quarter of the radius: inside all of the meshes.
        let origin = centre + random.cube() * (0.25 * scale);
        // The target lies at t = 1; half as much again leaves room for its rounding, but not for a hit beyond the mesh.
        let ray = Ray { t_max: 1.5, ..Ray::new(origin, target - origin) };
        // A target that rounds to the origin has no direction.
        ray.direction != Vec3::ZERO && (accel.closest_hit(&ray).is_none() || !accel.any_hit(&ray))
    };
    (0..rays).filter(escapes).count()
}

/// Every mesh at every place, `rays` rays in total.
fn check(rays: usize, presets: &[BuildPreset]) {
    let mut random = Random(1);
    let mut cases = Vec::new();
    for (name, scene) in meshes() {
        for offset in OFFSETS {
            for scale in SCALES {
                // Below some tens of representable coordinates across, rounding leaves a mesh no inside.
                if scale > 32.0 * offset * f32::EPSILON {
                    cases.push((name, scene.clone(), offset, scale));
                }
            }
        }
    }
    let share = rays.div_ceil(cases.len() * presets.len());
    let mut failures = Vec::new();
    for (name, scene, offset, scale) in cases {
        let centre = Vec3::new(offset, -offset, offset);
        let scene = common::placed(scene, scale, centre);
        for &preset in presets {
            let accel = Accel::build(&scene, preset);
            let n = leaks(&accel, centre, scale, share, &mut random);
            if n > 0 {
                failures.push(format!("{name} at {offset} × {scale}, {preset:?}: {n} of {share}"));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// 10⁷ rays, the number of the acceptance criterion, over all presets: some 20 s on one core.
#[test]
fn no_ray_leaves_a_closed_mesh() {
    check(10_000_000, &[BuildPreset::Fast, BuildPreset::Balanced, BuildPreset::Best]);
}
