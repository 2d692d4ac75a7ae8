//! Small scenes that the tests of several techniques share.

use glam::{Vec2, Vec3};
use indirect_core::{Light, LightKind, Material, Projection, Scene, View};

/// One light of each kind, before the wall of [`corner`].
#[must_use]
pub fn lights() -> [LightKind; 3] {
    [
        LightKind::Spot {
            position: Vec3::new(0.2, 3.0, 0.3),
            direction: Vec3::new(0.1, -1.0, -0.3).normalize(),
            inner_angle: 0.35,
            outer_angle: 0.6,
        },
        LightKind::Point { position: Vec3::new(0.3, 1.5, 0.2) },
        LightKind::Directional { direction: Vec3::new(0.3, -1.0, -0.5).normalize() },
    ]
}

/// A light of a warm colour.
#[must_use]
pub fn light(kind: LightKind) -> Light {
    Light { name: String::new(), kind, power: Vec3::new(3.0, 2.0, 1.0), range: None }
}

/// A square of half side `half` with the sides `right` and `up`, seen from the side where these turn counter-clockwise.
pub fn square(scene: &mut Scene, centre: Vec3, right: Vec3, up: Vec3, half: f32, material: u32) {
    let at = |x: f32, y: f32| centre + (right * x + up * y) * half;
    scene.mesh.push_polygon(&[at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)], material);
}

/// A floor, a wall, a small tilted square before it, and a light; all lengths times `scale`.
#[must_use]
pub fn corner(kind: LightKind, scale: f32) -> Scene {
    let materials = vec![
        Material::diffuse("grey", Vec3::new(0.8, 0.5, 0.2)),
        Material::diffuse("blue", Vec3::new(0.1, 0.3, 0.9)),
    ];
    let mut s = Scene { materials, ..Scene::default() };
    square(&mut s, Vec3::ZERO, Vec3::X, -Vec3::Z, 2.0 * scale, 0);
    square(&mut s, Vec3::new(0.0, 2.0, -2.0) * scale, Vec3::X, Vec3::Y, 2.0 * scale, 0);
    let up = Vec3::new(0.0, 0.8, -0.6);
    square(&mut s, Vec3::new(0.4, 0.5, -0.5) * scale, Vec3::X, up, 0.3 * scale, 1);
    let mut light = light(kind);
    match &mut light.kind {
        LightKind::Point { position } | LightKind::Spot { position, .. } => {
            *position *= scale;
            light.power *= scale * scale;
        }
        LightKind::Directional { .. } => {}
    }
    s.lights.push(light);
    s
}

/// The same without a punctual light, lit by an emissive square that is seen from both sides.
#[must_use]
pub fn lamp(scale: f32) -> Scene {
    let mut s = corner(lights()[0], scale);
    s.lights.clear();
    let emission = Vec3::new(4.0, 3.0, 2.0);
    s.materials.push(Material {
        emission,
        double_sided: true,
        ..Material::diffuse("lamp", Vec3::splat(0.2))
    });
    square(&mut s, Vec3::new(-0.3, 1.2, -0.4) * scale, Vec3::X, Vec3::Z, 0.25 * scale, 2);
    s
}

/// A camera before the wall of [`corner`].
#[must_use]
pub fn view(scale: f32) -> View {
    View::look_to(
        Vec3::new(0.5, 1.8, 3.5) * scale,
        Vec3::new(-0.1, -0.3, -1.0),
        Vec3::Y,
        Projection::Perspective { tan_half: Vec2::new(0.9, 0.55) },
        0.01 * scale,
        100.0 * scale,
    )
}
