//! What is drawn: a floor, a wall, a square that turns, a light that swings.

use core::ops::Range;

use glam::{Affine3A, Mat4, Quat, Vec3, Vec4};
use indirect_core::{Aabb, Light, LightKind, Material, Scene, View};

use crate::scenes;

/// Frames of the examples.
pub const FRAMES: u32 = 60;

/// Pixels of the examples.
pub const SIZE: [u32; 2] = [96, 64];

/// Squares of the scene, as instances; the last one moves.
pub const INSTANCES: usize = 3;

/// What the renderer draws in a frame.
#[derive(Debug, Clone)]
pub struct Frame {
    /// From the world to the clip space of the camera, depth reversed, no far plane.
    pub clip_from_world: Mat4,
    /// Where the instances are; a square of half side 1 in the plane z = 0.
    pub instances: [Affine3A; INSTANCES],
    /// The lights.
    pub lights: Vec<Light>,
}

/// Albedos of the instances, as 8-bit sRGB textures hold them.
const ALBEDOS: [[u8; 3]; INSTANCES] = [[230, 188, 124], [230, 188, 124], [89, 149, 243]];

/// Linear albedo of an instance.
pub(super) fn albedo(instance: usize) -> Vec3 {
    let linear = |c: u8| {
        let c = f32::from(c) / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    };
    Vec3::from_array(ALBEDOS[instance].map(linear))
}

impl Frame {
    /// Vertices of [`Self::scene`] that move.
    pub const MOVING: Range<u32> = 8..12;

    /// Frame `number` of a second: a spot light swings over a floor before a wall, and a square turns between them.
    #[must_use]
    pub fn new(number: u32) -> Self {
        let t = number as f32 / FRAMES as f32;
        let (eye, forward) = (Vec3::new(0.5, 1.8, 3.5), Vec3::new(-0.1, -0.3, -1.0).normalize());
        let right = forward.cross(Vec3::Y).normalize();
        let world_from_view = Mat4::from_cols(
            right.extend(0.0),
            right.cross(forward).extend(0.0),
            (-forward).extend(0.0),
            eye.extend(1.0),
        );
        // 1 rad from top to bottom; NDC depth is near / depth.
        let [scale, near] = [1.0 / 0.5_f32.tan(), 0.05];
        let aspect = SIZE[0] as f32 / SIZE[1] as f32;
        let projection =
            Mat4::from_cols(Vec4::X * (scale / aspect), Vec4::Y * scale, -Vec4::W, Vec4::Z * near);
        let LightKind::Spot { position, direction, inner_angle, outer_angle } = scenes::lights()[0] else {
            unreachable!("the first light of the scenes is a spot");
        };
        let direction = Quat::from_rotation_z(0.2 * (t - 0.5)) * direction;
        let place = |rotation, translation, half| {
            Affine3A::from_scale_rotation_translation(Vec3::splat(half), rotation, translation)
        };
        let turned = Quat::from_rotation_y(t) * Quat::from_rotation_x(-0.6);
        Self {
            clip_from_world: projection * world_from_view.inverse(),
            instances: [
                place(Quat::from_rotation_x(-core::f32::consts::FRAC_PI_2), Vec3::ZERO, 2.0),
                place(Quat::IDENTITY, Vec3::new(0.0, 2.0, -2.0), 2.0),
                place(turned, Vec3::new(0.4 - 0.5 * t, 0.5, -0.5), 0.3),
            ],
            lights: vec![scenes::light(LightKind::Spot { position, direction, inner_angle, outer_angle })],
        }
    }

    /// The same for whoever wants triangles in world space. Vertices `4 i..4 i + 4` are those of instance `i`.
    #[must_use]
    pub fn scene(&self) -> Scene {
        let materials = (0..INSTANCES).map(|i| Material::diffuse("", albedo(i))).collect();
        let mut scene = Scene { materials, lights: self.lights.clone(), ..Scene::default() };
        for (material, world) in (0..).zip(&self.instances) {
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(x, y)| world.transform_point3(Vec3::new(x, y, 0.0)));
            scene.mesh.push_polygon(&corners, material);
        }
        scene
    }

    /// How the instance that moves got from where it is in frame 0 to where it is now.
    #[must_use]
    pub fn moved(&self) -> Affine3A {
        self.instances[INSTANCES - 1] * Self::new(0).instances[INSTANCES - 1].inverse()
    }

    /// What all frames stay within.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        Aabb { min: Vec3::new(-2.0, 0.0, -2.0), max: Vec3::new(2.0, 4.0, 2.0) }
    }

    /// The camera without its matrix.
    #[must_use]
    pub fn view(&self) -> View {
        View::from_clip(&self.clip_from_world).map_or_else(|_| scenes::view(1.0), |clip| clip.view)
    }
}
