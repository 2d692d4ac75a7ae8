//! Scenes and statistics that the tests share.
#![allow(dead_code, reason = "every test file uses its own part")]
#![allow(unreachable_pub, reason = "a module of each test file")]
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "helpers of tests, outside the functions that are exempt"
)]

use glam::{Vec2, Vec3};
use indirect_accel::{Accel, BuildPreset};
use indirect_core::{Light, LightKind, Material, Projection, Scene, View};
use reference_pathtracer::{Estimate, Mean, Samples, Settings, render};

pub fn material(albedo: f32) -> Material {
    Material::diffuse("grey", Vec3::splat(albedo))
}

pub fn emitter(albedo: f32, radiance: f32) -> Material {
    Material { emission: Vec3::splat(radiance), ..material(albedo) }
}

pub fn light(kind: LightKind, power: f32) -> Light {
    Light { name: "light".into(), kind, power: Vec3::splat(power), range: None }
}

/// The rectangle `centre ± s ± t` with the front `s × t`.
pub fn rectangle(centre: Vec3, s: Vec3, t: Vec3) -> [Vec3; 4] {
    [centre - s - t, centre + s - t, centre + s + t, centre - s + t]
}

pub fn floor(half: f32, albedo: f32) -> Scene {
    let mut scene = Scene { materials: vec![material(albedo)], ..Scene::default() };
    scene.mesh.push_polygon(&rectangle(Vec3::ZERO, Vec3::Z * half, Vec3::X * half), 0);
    scene
}

/// A closed unit sphere of `4·steps²` facets, front sides inward: an octahedron whose faces are divided and blown up. Its
/// corners are on the sphere. `smooth` gives it the sphere's own normals.
pub fn sphere(steps: u32, smooth: bool, material: Material) -> Scene {
    let mut scene = Scene { materials: vec![material], ..Scene::default() };
    for face in 0..8 {
        let sign = |bit: u32| if face >> bit & 1 == 0 { 1.0_f32 } else { -1.0 };
        let (x, y, z) = (Vec3::X * sign(0), Vec3::Y * sign(1), Vec3::Z * sign(2));
        let at = |i: u32, j: u32| {
            let (u, v) = (i as f32 / steps as f32, j as f32 / steps as f32);
            (x * (1.0 - u - v) + y * u + z * v).normalize()
        };
        let mut push = |a: Vec3, b: Vec3, c: Vec3| {
            let outward = (b - a).cross(c - a).dot(a) > 0.0;
            scene.mesh.push_polygon(&if outward { [a, c, b] } else { [a, b, c] }, 0);
        };
        for i in 0..steps {
            for j in 0..steps - i {
                push(at(i, j), at(i + 1, j), at(i, j + 1));
                if i + j + 1 < steps {
                    push(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                }
            }
        }
    }
    if smooth {
        scene.mesh.normals = scene.mesh.positions.iter().map(|p| -p.normalize()).collect();
    }
    scene
}

pub fn total_area(scene: &Scene) -> f64 {
    (0..scene.mesh.triangles.len() as u32).map(|t| f64::from(scene.mesh.area(t))).sum()
}

/// A view from inside a closed scene; wide enough to see much of it.
pub fn wide(origin: Vec3, forward: Vec3) -> View {
    let lens = Projection::Perspective { tan_half: Vec2::splat(1.0) };
    View::look_to(origin, forward, Vec3::Y, lens, 1e-3, f32::INFINITY)
}

/// A view of exactly the square `centre ± half` in the plane across `forward`, from `distance` before it.
pub fn onto(centre: Vec3, forward: Vec3, up: Vec3, half: f32, distance: f32) -> View {
    let lens = Projection::Orthographic { half_size: Vec2::splat(half) };
    View::look_to(centre - forward * distance, forward, up, lens, 0.0, distance * 2.0)
}

/// A room of 2 m with two boxes, coloured walls and one of: a panel in the ceiling, or a spot that lights one wall.
pub fn room(panel: bool) -> Scene {
    let colour = |r, g, b| Material::diffuse("", Vec3::new(r, g, b));
    let mut scene = Scene {
        materials: vec![
            colour(0.73, 0.73, 0.73),
            colour(0.63, 0.06, 0.05),
            colour(0.14, 0.45, 0.09),
            emitter(0.78, 15.0),
        ],
        ..Scene::default()
    };
    let m = &mut scene.mesh;
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    m.push_polygon(&rectangle(-y, z, x), 0);
    m.push_polygon(&rectangle(y, x, z), 0);
    m.push_polygon(&rectangle(-z, x, y), 0);
    m.push_polygon(&rectangle(-x, y, z), 1);
    m.push_polygon(&rectangle(x, z, y), 2);
    if panel {
        m.push_polygon(&rectangle(y * 0.998, x * 0.25, z * 0.2), 3);
    } else {
        let kind = LightKind::Spot {
            position: Vec3::new(0.3, 0.5, 0.8),
            direction: Vec3::new(-1.0, 0.1, -0.6).normalize(),
            inner_angle: 0.2,
            outer_angle: 0.35,
        };
        scene.lights.push(light(kind, 30.0));
    }
    for (centre, half, turn) in [
        (Vec3::new(0.35, -0.7, 0.35), Vec3::splat(0.3), 0.3_f32),
        (Vec3::new(-0.35, -0.4, -0.3), Vec3::new(0.3, 0.6, 0.3), -0.3),
    ] {
        let (sx, sz) = (
            Vec3::new(turn.cos(), 0.0, turn.sin()) * half.x,
            Vec3::new(-turn.sin(), 0.0, turn.cos()) * half.z,
        );
        let sy = Vec3::Y * half.y;
        for (n, s, t) in [(sx, sy, sz), (sy, sz, sx), (sz, sx, sy)] {
            scene.mesh.push_polygon(&rectangle(centre + n, s, t), 0);
            scene.mesh.push_polygon(&rectangle(centre - n, t, s), 0);
        }
    }
    scene
}

pub fn room_view() -> View {
    let lens = Projection::Perspective { tan_half: Vec2::splat(0.4) };
    View::look_to(Vec3::new(0.0, 0.0, 3.8), Vec3::NEG_Z, Vec3::Y, lens, 0.01, f32::INFINITY)
}

pub fn run(scene: &Scene, view: &View, size: [u32; 2], settings: &Settings) -> Estimate {
    let accel = Accel::build(scene, BuildPreset::Balanced);
    render(&accel, view, size, settings).unwrap()
}

/// `batches` batches of `batch` samples: the more batches, the surer the standard error.
pub fn samples(batch: u32, batches: u32) -> Settings {
    Settings { samples: Samples { batch, first: 0, batches }, ..Settings::default() }
}

/// Two estimates of the same number: within `sigmas` standard errors of their difference, and those small enough to mean
/// something.
pub fn assert_agree(what: &str, a: Mean, b: Mean, sigmas: f64, resolution: f64) {
    let error = a.error.hypot(b.error);
    println!(
        "{what}: {:.6} against {:.6} ± {error:.6}: {:+.2} σ",
        a.value,
        b.value,
        (a.value - b.value) / error
    );
    assert!((a.value - b.value).abs() <= sigmas * error + 2e-6 * a.value, "{what}: {a:?} {b:?}");
    assert!(error <= resolution * a.value, "{what}: {a:?} {b:?} tell nothing");
}

/// Within 3 standard errors and within 0.5 % of a closed form; `geometry` is the relative error that the scene's own
/// tessellation may add.
pub fn assert_closed_form(what: &str, Mean { value, error }: Mean, expected: f64, geometry: f64) {
    let off = (value - expected).abs();
    println!(
        "{what}: {value:.6} ± {error:.6}, expected {expected:.6}: {:+.3} %, {:+.2} σ",
        (value / expected - 1.0) * 100.0,
        (value - expected) / error
    );
    // f32 radiances: a few roundings.
    let rounding = expected.abs() * (2e-6 + geometry);
    assert!(off <= 3.0 * error + rounding, "{what}: {value} ± {error}, expected {expected}");
    assert!(off <= 0.005 * expected.abs(), "{what}: {value}, expected {expected}");
}
