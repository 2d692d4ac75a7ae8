//! Input at the edge of what is defined, alpha masks, repeatability, and the image cast.

mod common;

use common::Random;
use glam::{Vec2, Vec3};
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::{NO_TRIANGLE, Projection, Ray, Scene, View};

const PRESETS: [BuildPreset; 3] = [BuildPreset::Fast, BuildPreset::Balanced, BuildPreset::Best];

#[test]
fn an_empty_scene_hits_nothing() {
    for preset in PRESETS {
        let scene = Scene::default();
        let accel = Accel::build(&scene, preset);
        let ray = Ray::new(Vec3::ZERO, Vec3::Z);
        assert!(accel.closest_hit(&ray).is_none() && !accel.any_hit(&ray));
        assert_eq!((accel.bytes(), accel.unit()), (0, 0.0));
    }
}

#[test]
fn unusable_triangles_are_left_out() {
    let mut scene = common::square(0.0);
    scene.mesh.positions.push(Vec3::NAN);
    scene.mesh.normals.push(Vec3::Y);
    for bad in [[0, 1, 4], [0, 1, 99], [0, 0, 1], [2, 2, 2]] {
        scene.mesh.triangles.push(bad);
        scene.mesh.materials.push(0);
    }
    // A triangle of a missing material, and one without any.
    scene.mesh.triangles.extend([[0, 1, 2], [0, 1, 2]]);
    scene.mesh.materials.push(7);
    for preset in PRESETS {
        let accel = Accel::build(&scene, preset);
        let hit = accel.closest_hit(&Ray::new(Vec3::new(0.3, 1.0, 0.1), Vec3::NEG_Y)).unwrap();
        assert!(hit.triangle < 2 && hit.t == 1.0);
    }
}

#[test]
fn odd_rays_hit_nothing() {
    let scene = common::square(0.0);
    let accel = Accel::build(&scene, BuildPreset::Best);
    let good = Ray::new(Vec3::new(0.3, 1.0, 0.1), Vec3::NEG_Y);
    assert!(accel.any_hit(&good));
    for ray in common::odd_rays(good) {
        assert!(accel.closest_hit(&ray).is_none() && !accel.any_hit(&ray), "{ray:?}");
    }
}

#[test]
fn the_interval_is_half_open() {
    let scene = common::square(0.0);
    let accel = Accel::build(&scene, BuildPreset::Best);
    let down = |y: f32, t_max: f32| {
        let ray = Ray { origin: Vec3::new(0.3, y, 0.1), direction: Vec3::NEG_Y, t_max };
        assert_eq!(accel.closest_hit(&ray).is_some(), accel.any_hit(&ray));
        accel.closest_hit(&ray).map(|hit| hit.t)
    };
    assert_eq!(down(2.0, f32::INFINITY), Some(2.0));
    assert_eq!(down(2.0, 2.0_f32.next_up()), Some(2.0));
    assert_eq!(down(2.0, 2.0), None);
    assert_eq!(down(0.0, 1.0), Some(0.0));
    assert_eq!(down(-f32::MIN_POSITIVE, 1.0), None);
}

#[test]
fn flat_scenes_are_hit_from_both_sides_and_along_the_axes() {
    for y in [0.0, 1e-3, 1.0, 1e5] {
        for preset in PRESETS {
            let scene = common::square(y);
            let accel = Accel::build(&scene, preset);
            let mut random = Random(5);
            for _ in 0..1000 {
                let p = random.cube();
                let side = if p.y < 0.0 { -1.0 } else { 1.0 };
                let origin = Vec3::new(p.x, y + side, p.z);
                for direction in [Vec3::new(0.0, -side, 0.0), Vec3::new(-0.0, -side, -0.0)] {
                    let hit = accel.closest_hit(&Ray::new(origin, direction)).unwrap();
                    assert_eq!(hit.t, 1.0);
                    let q = scene.surface(hit.triangle, hit.u, hit.v).position;
                    // Three roundings of a coordinate of at most 1.
                    assert!((q - origin).x.abs() < 4e-7 && (q - origin).z.abs() < 4e-7);
                }
            }
        }
    }
}

#[test]
fn a_ray_in_the_plane_of_a_box_side_enters_it() {
    // The ray runs within the lower x side of the whole scene and hits an edge there.
    let scene = common::square(0.0);
    let accel = Accel::build(&scene, BuildPreset::Best);
    assert!(accel.any_hit(&Ray::new(Vec3::new(-1.0, 1.0, 0.25), Vec3::NEG_Y)));
    assert!(accel.any_hit(&Ray::new(Vec3::new(-1.0, 1.0, -1.0), Vec3::NEG_Y)));
}

#[test]
fn an_edge_within_rounding_of_the_ray_belongs_to_one_side() {
    // The ray is the z axis. The edge a–b misses it by ε²/2: x_b·y_a = −(1 + ε)(1 − ε) rounds to y_b·x_a = −1.
    let e = f32::EPSILON;
    let (a, b) = (Vec3::new(1.0, 1.0 - e, 0.0), Vec3::new(-1.0 - e, -1.0, 0.0));
    let hit = |c| {
        let scene = common::scene(vec![a, b, c], vec![[0, 1, 2]]);
        Accel::build(&scene, BuildPreset::Best).any_hit(&Ray::new(Vec3::NEG_Z, Vec3::Z))
    };
    assert!(hit(Vec3::new(-1.0, 1.0, 0.0)));
    assert!(!hit(Vec3::new(1.0, -1.0, 0.0)));
}

#[test]
fn sizes_from_the_tiny_to_the_huge_in_one_scene() {
    let mut positions = Vec::new();
    for exponent in -60..60 {
        let s = 2.0_f32.powi(exponent);
        positions.extend([Vec3::new(-s, -s, s), Vec3::new(2.0 * s, -s, s), Vec3::new(-s, 2.0 * s, s)]);
    }
    let triangles = (0..120).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let scene = common::scene(positions, triangles);
    for preset in PRESETS {
        let accel = Accel::build(&scene, preset);
        for exponent in -60..60 {
            let start = 2.0_f32.powi(exponent) * 0.75;
            let ray = Ray::new(Vec3::Z * start, Vec3::Z);
            let hit = accel.closest_hit(&ray).unwrap();
            assert_eq!((hit.triangle as i32 - 60, hit.t), (exponent, start / 3.0), "{preset:?}");
        }
    }
}

#[test]
fn many_equal_triangles_give_the_first() {
    let mut scene = common::square(0.0);
    for _ in 0..2000 {
        scene.mesh.triangles.push([0, 1, 2]);
        scene.mesh.materials.push(0);
    }
    for preset in PRESETS {
        let accel = Accel::build(&scene, preset);
        let hit = accel.closest_hit(&Ray::new(Vec3::new(0.5, 1.0, 0.1), Vec3::NEG_Y)).unwrap();
        assert_eq!((hit.triangle, hit.t), (0, 1.0));
    }
}

#[test]
fn no_layout_takes_quadratic_time() {
    let mut repeated = common::square(0.0);
    repeated.mesh.triangles = vec![[0, 1, 2]; 100_000];
    repeated.mesh.materials = vec![0; 100_000];
    for (name, scene) in [("repeated", repeated), ("fan", common::slivers(64_000))] {
        for preset in PRESETS {
            let start = std::time::Instant::now();
            assert!(
                Accel::build(&scene, preset)
                    .any_hit(&Ray::new(Vec3::new(0.1, -0.1, 0.0), Vec3::new(0.1, 1.0, -0.2)))
            );
            // Linear ones take 0.1 s to 0.4 s on a busy machine, quadratic ones 20 s to 60 s.
            assert!(start.elapsed().as_secs() < 10, "{name}, {preset:?}: {:?}", start.elapsed());
        }
    }
}

#[test]
fn what_is_absurdly_far_does_not_disturb_the_rest() {
    let mut scene = common::square(0.0);
    scene.mesh.push_polygon(&[Vec3::X * 1e30, Vec3::Y * f32::MAX, Vec3::Z * 1e25], 0);
    for preset in PRESETS {
        let accel = Accel::build(&scene, preset);
        assert!(accel.any_hit(&Ray::new(Vec3::new(0.3, 1.0, 0.1), Vec3::NEG_Y)));
        assert!(!accel.any_hit(&Ray::new(Vec3::new(0.3, 1.0, 0.1), Vec3::ONE)));
    }
}

/// A square with a checkerboard of 2 × 2 holes over another square.
fn masked() -> Scene {
    common::masked(common::square(1.0), common::square(0.0))
}

#[test]
fn rays_pass_through_the_holes_of_a_mask() {
    let scene = masked();
    scene.validate().unwrap();
    for preset in PRESETS {
        let accel = Accel::build(&scene, preset);
        let mut random = Random(9);
        for _ in 0..10_000 {
            let p = random.cube();
            // Bilinear alpha of the checkerboard crosses 1/2 on the two axes.
            let solid = p.x * p.z < 0.0;
            let ray = Ray { t_max: 1.5, ..Ray::new(Vec3::new(p.x, 2.0, p.z), Vec3::NEG_Y) };
            if p.x.abs().min(p.z.abs()) > 1e-5 {
                assert_eq!(accel.any_hit(&ray), solid, "{p}");
                assert_eq!(accel.closest_hit(&ray).is_some(), solid, "{p}");
            }
            let t = accel.closest_hit(&Ray { t_max: 9.0, ..ray }).unwrap().t;
            assert_eq!(t, accel.closest_hit(&ray).map_or(2.0, |hit| hit.t));
        }
    }
}

#[test]
fn the_same_tree_on_any_number_of_threads() {
    let scene = common::bumpy_sphere(60);
    let mut random = Random(11);
    let rays: Vec<Ray> = (0..20_000).map(|_| Ray::new(random.cube() * 2.0, random.direction())).collect();
    for preset in PRESETS {
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let accel = pool.install(|| Accel::build(&scene, preset));
            (accel.bytes(), rays.iter().map(|r| accel.closest_hit(r)).collect::<Vec<_>>())
        };
        assert_eq!(run(1), run(4), "{preset:?}");
    }
}

#[test]
fn gbuffer_shows_what_the_view_sees() {
    let scene = masked();
    let accel = Accel::build(&scene, BuildPreset::Best);
    let projection = Projection::Perspective { tan_half: Vec2::splat(1.0) };
    let view = View::look_to(Vec3::Y * 3.0, Vec3::NEG_Y, Vec3::NEG_Z, projection, 0.5, 10.0);
    let size = [64, 48];
    let g = cast::gbuffer(&accel, &view, size);
    assert_eq!((g.size, g.len()), (size, 64 * 48));
    for y in 0..size[1] {
        for x in 0..size[0] {
            let i = (y * size[0] + x) as usize;
            let plane = view.plane_point(Vec2::new(x as f32 + 0.5, y as f32 + 0.5), size);
            // The mask lies 2 m below the eye, the floor 3 m; image right is +x, image up is −z.
            let at = |depth: f32| (plane * depth, plane.abs().max_element() * depth < 1.0);
            let ((p, on_mask), (_, on_floor)) = (at(2.0), at(3.0));
            let expected = if on_mask && p.x * -p.y < 0.0 {
                Some(1.0)
            } else if on_floor {
                Some(0.0)
            } else {
                None
            };
            let Some(height) = expected else {
                assert!(g.triangle[i] == NO_TRIANGLE && g.depth[i] == 0.0 && g.position[i] == Vec3::ZERO);
                continue;
            };
            // Two roundings of values of about 3.
            assert!((g.depth[i] - (3.0 - height)).abs() < 1e-6, "{x} {y}: {}", g.depth[i]);
            assert!((g.position[i].y - height).abs() < 1e-6);
            assert_eq!(g.normal[i], Vec3::Y);
            // The mask is red where it is solid, whatever its brightness there.
            assert_eq!(g.albedo[i].y, if height == 0.0 { 1.0 } else { 0.0 });
        }
    }
    assert!(cast::gbuffer(&accel, &view, [0, 5]).is_empty());
}
