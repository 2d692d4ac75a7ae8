//! Small scenes and helpers that several tests share.
#![allow(dead_code, clippy::unwrap_used, reason = "each test binary uses its own part")]

use core::f32::consts::{FRAC_PI_2, PI};

use glam::{Mat3, Vec2, Vec3};
use indirect_core::{Aabb, Light, LightKind, Material, Projection, Scene, View};
use radiance_hints::{Lattice, Options, Params, Setup, Visibility};

/// One bounce that nothing blocks.
pub(crate) fn one_bounce() -> Options {
    Options { bounces: 1, visibility: Visibility::Off, ..Options::default() }
}

/// A setup that knows nothing of what surrounds its lattice.
pub(crate) fn setup(lattice: &Lattice, options: Options, params: Params) -> Setup {
    Setup { options, params, lattice: lattice.clone(), enclosure: None }
}

pub(crate) fn light(kind: LightKind, power: Vec3) -> Light {
    Light { name: String::new(), kind, power, range: None }
}

pub(crate) fn spot(position: Vec3, direction: Vec3, inner_degrees: f32, outer_degrees: f32) -> LightKind {
    LightKind::Spot {
        position,
        direction: direction.normalize(),
        inner_angle: inner_degrees.to_radians(),
        outer_angle: outer_degrees.to_radians(),
    }
}

/// A square of side `2·half` around `centre`, facing up before it is turned by `rotation`.
pub(crate) fn push_square(scene: &mut Scene, centre: Vec3, half: f32, rotation: Mat3) {
    let corner = |x: f32, z: f32| centre + rotation * Vec3::new(x * half, 0.0, z * half);
    let corners = [corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)];
    scene.mesh.push_polygon(&corners, 0);
}

/// A floor, a wall on its far side that faces the viewer, and a light.
pub(crate) fn floor_and_wall(kind: LightKind, scale: f32) -> Scene {
    let mut s =
        Scene { materials: vec![Material::diffuse("surface", Vec3::new(0.8, 0.5, 0.2))], ..Scene::default() };
    push_square(&mut s, Vec3::ZERO, 2.0 * scale, Mat3::IDENTITY);
    push_square(&mut s, Vec3::new(0.0, 2.0, -2.0) * scale, 2.0 * scale, Mat3::from_rotation_x(FRAC_PI_2));
    s.lights.push(light(kind, Vec3::new(3.0, 2.0, 1.0)));
    s
}

/// A closed box around the origin, facing inwards, with a point light.
pub(crate) fn room(albedo: Vec3, half: f32) -> Scene {
    let mut s = Scene { materials: vec![Material::diffuse("surface", albedo)], ..Scene::default() };
    let turns = [
        Mat3::IDENTITY,
        Mat3::from_rotation_x(PI),
        Mat3::from_rotation_x(FRAC_PI_2),
        Mat3::from_rotation_x(-FRAC_PI_2),
        Mat3::from_rotation_z(FRAC_PI_2),
        Mat3::from_rotation_z(-FRAC_PI_2),
    ];
    for turn in turns {
        push_square(&mut s, turn * Vec3::new(0.0, -half, 0.0), half, turn);
    }
    s.lights.push(light(LightKind::Point { position: Vec3::ZERO }, Vec3::splat(half * half)));
    s
}

pub(crate) fn lights() -> [LightKind; 3] {
    [
        spot(Vec3::new(0.2, 3.0, 0.3), Vec3::new(0.1, -1.0, -0.3), 20.0, 35.0),
        LightKind::Point { position: Vec3::new(0.3, 1.5, 0.2) },
        LightKind::Directional { direction: Vec3::new(0.3, -1.0, -0.5).normalize() },
    ]
}

pub(crate) fn scaled(kind: LightKind, s: f32) -> LightKind {
    match kind {
        LightKind::Directional { .. } => kind,
        LightKind::Point { position } => LightKind::Point { position: position * s },
        LightKind::Spot { position, direction, inner_angle, outer_angle } => {
            LightKind::Spot { position: position * s, direction, inner_angle, outer_angle }
        }
    }
}

pub(crate) fn camera_view(scale: f32) -> View {
    let projection = Projection::Perspective { tan_half: Vec2::new(0.9, 0.55) };
    let (eye, forward) = (Vec3::new(0.5, 1.8, 3.5) * scale, Vec3::new(-0.1, -0.3, -1.0));
    View::look_to(eye, forward, Vec3::Y, projection, 0.01 * scale, 100.0 * scale)
}

pub(crate) fn lattice(scene: &Scene, cells: u32) -> Lattice {
    Lattice::new(&scene.bounds().unwrap(), [cells; 3]).unwrap()
}

/// Two boxes: a fine one within the scene's bounds, and those.
pub(crate) fn two_volumes(scene: &Scene) -> Lattice {
    let bounds = scene.bounds().unwrap();
    let third = bounds.extent() / 3.0;
    let inner = Aabb { min: bounds.min + third * 0.5, max: bounds.max - third };
    Lattice::of([(inner, [5, 6, 4]), (bounds, [7, 5, 6])]).unwrap()
}
