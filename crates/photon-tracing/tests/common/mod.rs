//! Small scenes that several tests share.
#![allow(dead_code, reason = "each test binary uses its own part")]

use glam::{Affine2, DVec3, Vec2, Vec3, Vec3Swizzles};
use indirect_accel::{Accel, BuildPreset};
use indirect_core::{AlphaMode, Light, LightKind, Material, Scene, Texture, TextureRef, Wrap};
use indirect_sampling::rng::{philox4x32, unit_f32};
use photon_tracing::cpu::{Tally, photon_map};
use photon_tracing::{Params, Photon, Sources};

pub(crate) fn light(kind: LightKind, power: Vec3) -> Light {
    Light { name: String::new(), kind, power, range: None }
}

/// A square of half side `half` with the sides `right` and `up`, seen from the side where these turn counter-clockwise.
pub(crate) fn square(scene: &mut Scene, centre: Vec3, right: Vec3, up: Vec3, half: f32, material: u32) {
    let at = |x: f32, y: f32| centre + (right * x + up * y) * half;
    scene.mesh.push_polygon(&[at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)], material);
}

/// The inside of a closed cube of half side `half`.
pub(crate) fn cube(scene: &mut Scene, centre: Vec3, half: f32, material: u32) {
    for axis in 0..3 {
        let [n, t, b] = [0, 1, 2].map(|k| Vec3::AXES[(axis + k) % 3]);
        square(scene, centre + n * half, b, t, half, material);
        square(scene, centre - n * half, t, b, half, material);
    }
}

/// A closed cube with a point light in it, all lengths times `scale`, moved by `offset`.
pub(crate) fn room(albedo: Vec3, scale: f32, offset: Vec3) -> Scene {
    let mut scene = Scene { materials: vec![Material::diffuse("wall", albedo)], ..Scene::default() };
    cube(&mut scene, offset, scale, 0);
    let kind = LightKind::Point { position: offset + Vec3::new(0.3, -0.5, 0.1) * scale };
    scene.lights.push(light(kind, Vec3::new(3.0, 2.0, 1.0)));
    scene
}

/// A floor and a wall in the open, a lamp that both sides of emit, and a light of each kind, all lengths times `scale`, moved by `offset`.
pub(crate) fn mixed(scale: f32, offset: Vec3) -> Scene {
    let emission = Vec3::new(4.0, 3.0, 2.0);
    let lamp = Material { emission, double_sided: true, ..Material::diffuse("lamp", Vec3::splat(0.2)) };
    let materials = vec![Material::diffuse("grey", Vec3::new(0.8, 0.5, 0.2)), lamp];
    let mut scene = Scene { materials, ..Scene::default() };
    let at = |x: f32, y: f32, z: f32| offset + Vec3::new(x, y, z) * scale;
    square(&mut scene, at(0.0, 0.0, 0.0), Vec3::X, -Vec3::Z, 2.0 * scale, 0);
    square(&mut scene, at(0.0, 2.0, -2.0), Vec3::X, Vec3::Y, 2.0 * scale, 0);
    square(&mut scene, at(-0.3, 1.2, -0.4), Vec3::X, Vec3::Z, 0.25 * scale, 1);
    let spot = LightKind::Spot {
        position: at(0.2, 3.0, 0.3),
        direction: Vec3::new(0.1, -1.0, -0.3).normalize(),
        inner_angle: 0.35,
        outer_angle: 0.6,
    };
    let power = Vec3::new(3.0, 2.0, 1.0);
    scene.lights = vec![
        light(spot, power * (scale * scale)),
        light(LightKind::Point { position: at(0.3, 1.5, 0.2) }, power.zxy() * (scale * scale)),
        light(LightKind::Directional { direction: Vec3::new(0.3, -1.0, -0.5).normalize() }, power * 0.3),
    ];
    scene
}

/// A screen with holes, above a floor with textures of colour and of metal and with vertex colours, below a point light.
pub(crate) fn textured() -> Scene {
    let mut random = Random(5, 0);
    let mut texture = |name: &str, masked: bool| {
        let texel = |i: u32| {
            let mut number = || (random.unit() * 65535.0) as u16;
            // Some are almost holes: what lies between texels is above the cutoff or below.
            [
                number(),
                number(),
                number(),
                if masked && (i + i / 8).is_multiple_of(2) { number() / 4 } else { 65535 },
            ]
        };
        let texels = (0..64).map(texel).collect();
        Texture { name: name.into(), size: [8, 8], texels, wrap: [Wrap::Repeat, Wrap::Mirror] }
    };
    let textures = vec![texture("screen", true), texture("floor", false), texture("metal", false)];
    let at = |texture, scale: f32| {
        let uv_transform =
            Affine2::from_scale_angle_translation(Vec2::new(scale, -scale), 0.3, Vec2::splat(0.1));
        Some(TextureRef { texture, uv_transform })
    };
    let alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
    let white = |name| Material::diffuse(name, Vec3::new(0.9, 0.8, 0.7));
    let screen = Material { base_color_texture: at(0, 1.0), alpha_mode, ..white("screen") };
    let floor = Material {
        base_color_texture: at(1, 1.7),
        metallic: 0.8,
        metallic_roughness_texture: at(2, 0.6),
        ..white("floor")
    };
    let mut scene = Scene { materials: vec![screen, floor], textures, ..Scene::default() };
    square(&mut scene, Vec3::Y, Vec3::X, -Vec3::Z, 1.0, 0);
    square(&mut scene, Vec3::ZERO, Vec3::X, -Vec3::Z, 2.0, 1);
    let places = &scene.mesh.positions;
    scene.mesh.uvs = places.iter().map(|p| Vec2::new(p.x, p.z) * 0.8).collect();
    scene.mesh.colors = places.iter().map(|p| Vec3::new(0.7 + 0.15 * p.x, 1.0, 0.7 - 0.15 * p.z)).collect();
    scene
        .lights
        .push(light(LightKind::Point { position: Vec3::new(0.1, 2.0, 0.3) }, Vec3::new(3.0, 2.0, 1.0)));
    scene
}

/// A reproducible stream of numbers.
pub(crate) struct Random(pub(crate) u32, pub(crate) u32);

impl Random {
    pub(crate) fn unit(&mut self) -> f32 {
        self.1 += 1;
        unit_f32(philox4x32([self.1, 0, 0, 0], [self.0, 1])[0])
    }

    pub(crate) fn below(&mut self, n: u32) -> u32 {
        (self.unit() * n as f32) as u32
    }

    pub(crate) fn cube(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }
}

/// Random triangles, materials and lights in the cube `[-1, 1]³` times `scale`.
pub(crate) fn soup(seed: u32, scale: f32) -> Scene {
    let mut random = Random(seed, 0);
    let mut scene = Scene::default();
    for i in 0..6 {
        let albedo = match i {
            0 => Vec3::ZERO,
            1 => Vec3::ONE,
            _ => (random.cube() * 0.5 + 0.5).min(Vec3::ONE),
        };
        let glows = random.below(3) == 0;
        let emission = if glows { random.cube().abs() * 10.0 } else { Vec3::ZERO };
        let double_sided = random.below(2) == 0;
        scene.materials.push(Material { emission, double_sided, ..Material::diffuse("", albedo) });
    }
    for _ in 0..60 {
        let centre = random.cube();
        let corners = [(); 3].map(|()| (centre + 0.5 * random.cube()) * scale);
        let material = random.below(6);
        scene.mesh.push_polygon(&corners, material);
    }
    for _ in 0..random.below(5) {
        let (position, direction) = (random.cube() * scale, (random.cube() + 1e-3).normalize());
        let outer = 0.05 + 1.5 * random.unit();
        let kind = match random.below(3) {
            0 => LightKind::Point { position },
            1 => LightKind::Directional { direction },
            _ => LightKind::Spot {
                position,
                direction,
                inner_angle: outer * random.unit(),
                outer_angle: outer,
            },
        };
        let range = (random.below(2) == 0).then(|| scale * (0.1 + random.unit()));
        scene.lights.push(Light { range, ..light(kind, random.cube().abs()) });
    }
    scene
}

pub(crate) fn flux<'a>(photons: impl IntoIterator<Item = &'a Photon>) -> DVec3 {
    photons.into_iter().map(|p| p.flux.as_dvec3()).sum()
}

/// The photons that a scene stores, and their account.
pub(crate) fn map(scene: &Scene, photons: u32, seed: u32, reflections: u32) -> (Vec<Photon>, Tally) {
    let accel = Accel::build(scene, BuildPreset::Fast);
    photon_map(&accel, &Sources::new(scene), &Params { photons, seed }, reflections)
}

/// Whether a stored photon is sound: finite, on its way, away from the surface.
pub(crate) fn is_sound(p: &Photon) -> bool {
    p.is_alive()
        && p.position.is_finite()
        && p.flux.is_finite()
        && p.flux.min_element() >= 0.0
        && p.flux != Vec3::ZERO
        && (p.direction.length() - 1.0).abs() < 1e-5
        && (p.normal.length() - 1.0).abs() < 1e-5
        // The mapping's horizon is 3·10⁻⁴; two rounded vectors are off by some 10⁻⁷.
        && p.direction.dot(p.normal) > 1e-4
}
