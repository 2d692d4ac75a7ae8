//! Small scenes and helpers that several tests share.
#![allow(dead_code, reason = "each test binary uses its own part")]

use glam::{Mat3, Vec2, Vec3};
use image_space_radiosity::{Error, Output, Setup};
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::{GBuffer, Light, LightKind, Material, Projection, Scene, View};
use indirect_sampling::rng::{hash_combine, pcg_hash, unit_f32};
use rsm::{Map, Rsm, Selection, cpu, layout::Texel};

/// A frame of `size` pixels that [`view`] sees.
pub(crate) fn render(scene: &Scene, size: [u32; 2], scale: f32, setup: &Setup) -> Output {
    let (accel, view) = (Accel::build(scene, BuildPreset::Fast), view(scale));
    let camera = cast::gbuffer(&accel, &view, size);
    image_space_radiosity::cpu::indirect(&frame(&accel, &view, &camera, setup)).unwrap()
}

/// A frame from maps, without a scene.
pub(crate) fn from_maps(rsm: Rsm, camera: &GBuffer, setup: &Setup) -> Result<Output, Error> {
    let (scene, view) = (Scene::default(), view(1.0));
    let accel = Accel::build(&scene, BuildPreset::Fast);
    image_space_radiosity::cpu::indirect_from(rsm, &frame(&accel, &view, camera, setup))
}

/// A frame that is yet to be computed.
pub(crate) fn frame<'a>(
    accel: &'a Accel<'a>,
    view: &'a View,
    camera: &'a GBuffer,
    setup: &'a Setup,
) -> image_space_radiosity::cpu::Frame<'a, Setup> {
    image_space_radiosity::cpu::Frame::new(accel, view, camera, setup)
}

pub(crate) fn spot(position: Vec3, direction: Vec3, inner_degrees: f32, outer_degrees: f32) -> LightKind {
    LightKind::Spot {
        position,
        direction: direction.normalize(),
        inner_angle: inner_degrees.to_radians(),
        outer_angle: outer_degrees.to_radians(),
    }
}

/// One of each kind, inside the corner of [`corner`].
pub(crate) fn lights() -> [LightKind; 3] {
    [
        spot(Vec3::new(0.2, 3.0, 0.3), Vec3::new(0.1, -1.0, -0.3), 20.0, 35.0),
        LightKind::Point { position: Vec3::new(0.3, 1.5, 0.2) },
        LightKind::Directional { direction: Vec3::new(0.3, -1.0, -0.5).normalize() },
    ]
}

pub(crate) fn light(kind: LightKind, power: Vec3) -> Light {
    Light { name: String::new(), kind, power, range: None }
}

/// A square of side `2·half` around `centre`, facing up before it is turned by `rotation`.
fn push_square(scene: &mut Scene, centre: Vec3, half: f32, rotation: Mat3) {
    let at = |x: f32, z: f32| centre + rotation * Vec3::new(x * half, 0.0, z * half);
    scene.mesh.push_polygon(&[at(-1.0, 1.0), at(1.0, 1.0), at(1.0, -1.0), at(-1.0, -1.0)], 0);
}

/// A floor, a wall on its far side that faces the viewer, a small tilted square before it, and a light.
pub(crate) fn corner(kind: LightKind, scale: f32) -> Scene {
    let grey = Material::diffuse("surface", Vec3::new(0.8, 0.5, 0.2));
    let mut s = Scene { materials: vec![grey], ..Scene::default() };
    let up = Mat3::from_rotation_x(core::f32::consts::FRAC_PI_2);
    push_square(&mut s, Vec3::ZERO, 2.0 * scale, Mat3::IDENTITY);
    push_square(&mut s, Vec3::new(0.0, 2.0, -2.0) * scale, 2.0 * scale, up);
    push_square(&mut s, Vec3::new(0.4, 0.5, -0.5) * scale, 0.3 * scale, Mat3::from_rotation_x(0.7));
    s.lights.push(light(kind, Vec3::new(3.0, 2.0, 1.0)));
    s
}

pub(crate) fn view(scale: f32) -> View {
    View::look_to(
        Vec3::new(0.5, 1.8, 3.5) * scale,
        Vec3::new(-0.1, -0.3, -1.0),
        Vec3::Y,
        Projection::Perspective { tan_half: Vec2::new(0.9, 0.55) },
        0.01 * scale,
        100.0 * scale,
    )
}

/// Random numbers in `[0, 1)`.
pub(crate) fn random(seed: u32) -> impl FnMut() -> f32 {
    let mut state = seed;
    move || {
        state = pcg_hash(state);
        unit_f32(state)
    }
}

/// A G-buffer made from noise: rectangles of random planes, some empty, with some noisy pixels.
pub(crate) fn noise_gbuffer(size: [u32; 2], seed: u32, empty_share: f32) -> GBuffer {
    let mut next = random(seed);
    let mut g = GBuffer::new(size);
    for i in 0..g.len() {
        fill(&mut g, i, &mut next, empty_share);
    }
    for _ in 0..6 {
        let (x0, y0) = (next() * size[0] as f32, next() * size[1] as f32);
        let (w, h) = (next() * size[0] as f32, next() * size[1] as f32);
        let n = Vec3::new(next() - 0.5, next() - 0.5, next() + 0.1).normalize();
        let (depth, empty) = (1.0 + 9.0 * next(), next() < empty_share);
        for y in (y0 as u32)..((y0 + h) as u32).min(size[1]) {
            for x in (x0 as u32)..((x0 + w) as u32).min(size[0]) {
                let i = (y * size[0] + x) as usize;
                g.triangle[i] = if empty { indirect_core::NO_TRIANGLE } else { 0 };
                let seen = if empty { 0.0 } else { 1.0 };
                g.depth[i] = depth * seen;
                g.position[i] = Vec3::new(x as f32, y as f32, depth) * seen;
                g.normal[i] = n * seen;
                g.albedo[i] = Vec3::splat(0.5) * seen;
            }
        }
    }
    g
}

/// Makes pixel `i` something random.
fn fill(g: &mut GBuffer, i: usize, next: &mut impl FnMut() -> f32, empty_share: f32) {
    if next() < empty_share {
        return;
    }
    g.triangle[i] = i as u32;
    g.depth[i] = 0.1 + 10.0 * next();
    g.position[i] = Vec3::new(next(), next(), next()) * 10.0;
    let n = Vec3::new(next() - 0.5, next() - 0.5, next() - 0.5);
    g.normal[i] = indirect_core::math::normalize_or(n, Vec3::Y);
    g.albedo[i] = Vec3::new(next(), next(), next());
}

/// Maps made from noise.
pub(crate) fn noise_rsm(resolution: u32, maps: u32, seed: u32, empty_share: f32) -> Rsm {
    let map = |m| {
        let surface = noise_gbuffer([resolution; 2], hash_combine(seed, m), empty_share);
        let mut next = random(hash_combine(seed, 1000 + m));
        let texels: Vec<Texel> = (0..surface.len())
            .map(|i| {
                let incident = Vec3::new(next(), next(), next()) * next().powi(4) * 100.0;
                let area = next();
                if surface.is_surface(i) {
                    Texel { incident, pad0: 0.0, reflected: incident * surface.albedo[i], area }
                } else {
                    Texel::default()
                }
            })
            .collect();
        let pyramid = cpu::pyramid(&surface, &texels);
        Map { light: 0, view: view(1.0), surface, texels, pyramid }
    };
    Rsm { resolution, maps: (0..maps).map(map).collect() }
}

/// The plain gather of every texel at every pixel: what all thresholds at 0 must reproduce.
pub(crate) fn flat_gather(rsm: &Rsm, camera: &GBuffer, form: rsm::Form) -> Vec<Vec3> {
    let vpls = cpu::compact(&cpu::vpls(rsm, Selection::All, &[]));
    let (receivers, texels) = cpu::Receivers::of_surface(camera);
    let irradiance = cpu::gather(&vpls, &receivers, form);
    indirect_filter::cpu::shade_texels(camera, &texels, &irradiance).pixels
}

/// `√mean((x − ref)²)/mean(ref)` over pixels that see a surface, mean of the channels.
pub(crate) fn rel_rmse(found: &[Vec3], expected: &[Vec3], camera: &GBuffer) -> f64 {
    let (mut square, mut mean, mut count) = (0.0, 0.0, 0.0_f64);
    for i in (0..found.len()).filter(|&i| camera.is_surface(i)) {
        let (x, r) = (found[i].as_dvec3(), expected[i].as_dvec3());
        square += (x - r).length_squared() / 3.0;
        mean += r.element_sum() / 3.0;
        count += 1.0;
    }
    (square / count).sqrt() / (mean / count)
}
