//! Small scenes and helpers that several tests share.
#![allow(dead_code, reason = "each test binary uses its own part")]

use glam::{Mat3, Vec3};
use indirect_core::{GBuffer, Light, LightKind, Material, Scene};
use rsm::{Map, Rsm, cpu, layout::Texel};

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

pub(crate) fn scene(albedo: Vec3) -> Scene {
    Scene { materials: vec![Material::diffuse("surface", albedo)], ..Scene::default() }
}

/// A square of side `2·half` around `centre`, facing up before it is turned by `rotation`.
pub(crate) fn push_square(scene: &mut Scene, centre: Vec3, half: f32, rotation: Mat3) {
    let corner = |x: f32, z: f32| centre + rotation * Vec3::new(x * half, 0.0, z * half);
    let corners = [corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)];
    scene.mesh.push_polygon(&corners, 0);
}

/// A closed box around the origin, facing inwards.
pub(crate) fn push_box(scene: &mut Scene, half: f32) {
    use core::f32::consts::{FRAC_PI_2, PI};
    let turns = [
        Mat3::IDENTITY,
        Mat3::from_rotation_x(PI),
        Mat3::from_rotation_x(FRAC_PI_2),
        Mat3::from_rotation_x(-FRAC_PI_2),
        Mat3::from_rotation_z(FRAC_PI_2),
        Mat3::from_rotation_z(-FRAC_PI_2),
    ];
    for turn in turns {
        push_square(scene, turn * Vec3::new(0.0, -half, 0.0), half, turn);
    }
}

/// A floor, a wall on its far side that faces the viewer, and a light.
pub(crate) fn floor_and_wall(kind: LightKind, scale: f32) -> Scene {
    let mut s = scene(Vec3::new(0.8, 0.5, 0.2));
    let up = Mat3::from_rotation_x(core::f32::consts::FRAC_PI_2);
    push_square(&mut s, Vec3::ZERO, 2.0 * scale, Mat3::IDENTITY);
    push_square(&mut s, Vec3::new(0.0, 2.0, -2.0) * scale, 2.0 * scale, up);
    s.lights.push(light(kind, Vec3::new(3.0, 2.0, 1.0)));
    s
}

/// A light of each kind above [`floor_and_wall`].
pub(crate) fn lights() -> [LightKind; 3] {
    [
        spot(Vec3::new(0.2, 3.0, 0.3), Vec3::new(0.1, -1.0, -0.3), 20.0, 35.0),
        LightKind::Point { position: Vec3::new(0.3, 1.5, 0.2) },
        LightKind::Directional { direction: Vec3::new(0.3, -1.0, -0.5).normalize() },
    ]
}

/// A light where everything is `s` times as large.
pub(crate) fn scaled(kind: LightKind, s: f32) -> LightKind {
    match kind {
        LightKind::Directional { .. } => kind,
        LightKind::Point { position } => LightKind::Point { position: position * s },
        LightKind::Spot { position, direction, inner_angle, outer_angle } => {
            LightKind::Spot { position: position * s, direction, inner_angle, outer_angle }
        }
    }
}

/// A map made from noise: random depths, unit normals, albedos and fluxes, some texels empty.
pub(crate) fn noise_map(size: [u32; 2], seed: u32, empty_share: f32) -> Map {
    let mut state = seed;
    let mut next = move || {
        state = indirect_sampling::rng::pcg_hash(state);
        indirect_sampling::rng::unit_f32(state)
    };
    let mut surface = GBuffer::new(size);
    let mut texels = vec![Texel::default(); surface.len()];
    for (i, texel) in texels.iter_mut().enumerate() {
        if next() < empty_share {
            continue;
        }
        surface.triangle[i] = i as u32;
        surface.depth[i] = 0.1 + 10.0 * next();
        surface.position[i] = Vec3::new(next(), next(), next()) * 10.0;
        let n = Vec3::new(next() - 0.5, next() - 0.5, next() - 0.5);
        surface.normal[i] = indirect_core::math::normalize_or(n, Vec3::Y);
        surface.albedo[i] = Vec3::new(next(), next(), next());
        let incident = Vec3::new(next(), next(), next()) * next().powi(4) * 100.0;
        *texel = Texel { incident, pad0: 0.0, reflected: incident * surface.albedo[i], area: next() };
    }
    let pyramid = cpu::pyramid(&surface, &texels);
    let view = indirect_core::View::look_to(
        Vec3::ZERO,
        Vec3::NEG_Z,
        Vec3::Y,
        indirect_core::Projection::Perspective { tan_half: glam::Vec2::ONE },
        0.1,
        100.0,
    );
    Map { light: 0, view, surface, texels, pyramid }
}

pub(crate) fn noise_rsm(resolution: u32, maps: u32, seed: u32, empty_share: f32) -> Rsm {
    let map = |i| noise_map([resolution; 2], indirect_sampling::rng::hash_combine(seed, i), empty_share);
    Rsm { resolution, maps: (0..maps).map(map).collect() }
}
