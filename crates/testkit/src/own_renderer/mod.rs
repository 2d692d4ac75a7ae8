//! A small renderer that stands for a stranger's: its own device, instances of its own mesh, a raster G-buffer in formats of its own
//! choice (reversed-Z depth, `Rgb10a2Unorm` normals, sRGB albedo), a light and an object that move. The `own_renderer` examples plug a
//! technique into it.

mod draw;
mod reference;

use std::error::Error;
use std::ops::Range;
use std::time::Instant;

use glam::{Affine3A, Mat4, Quat, Vec3, Vec4};
use indirect_core::MapView;
use indirect_core::{Aabb, Image, Light, LightKind, Material, Scene, View};
use indirect_gpu::wgpu::{CommandEncoder, CommandEncoderDescriptor, Device, Queue};
use indirect_technique::cpu::Fit;
use indirect_technique::gpu::GpuTechnique;

use crate::scenes;

pub use draw::Renderer;
pub use reference::pictures;

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
fn albedo(instance: usize) -> Vec3 {
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

/// A technique as the renderer keeps it.
pub trait Plugin: Sized {
    /// Makes it for a renderer whose first frame is `first`.
    ///
    /// # Errors
    /// Whatever the technique says.
    fn new(renderer: &Renderer, first: &Frame) -> Result<Self, Box<dyn Error>>;

    /// Adds the indirect light of a frame, from the renderer's textures to its `indirect` texture, behind what it drew.
    ///
    /// # Errors
    /// As there.
    fn frame(
        &mut self,
        renderer: &Renderer,
        frame: &Frame,
        encoder: &mut CommandEncoder,
    ) -> Result<(), Box<dyn Error>>;
}

/// Draws `frames` frames and returns the indirect light of the last, W/(sr·m²), and the median CPU time of [`Plugin::frame`], µs.
///
/// # Errors
/// Whatever the technique says.
pub fn run<P: Plugin>(device: &Device, queue: &Queue, frames: u32) -> Result<(Image, f64), Box<dyn Error>> {
    let renderer = Renderer::new(device, queue);
    let mut plugin = P::new(&renderer, &Frame::new(0))?;
    let mut times = Vec::new();
    for number in 0..frames {
        let frame = Frame::new(number);
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        renderer.draw(&mut encoder, &frame);
        let start = Instant::now();
        plugin.frame(&renderer, &frame, &mut encoder)?;
        times.push(start.elapsed().as_secs_f64() * 1e6);
        queue.submit([encoder.finish()]);
    }
    times.sort_by(f64::total_cmp);
    Ok((renderer.read_indirect()?, times.get(times.len() / 2).copied().unwrap_or(0.0)))
}

/// Root mean square of the difference of two pictures over that of the second; infinite where the first is not finite or the second
/// is black.
#[must_use]
pub fn relative_rms(found: &Image, truth: &Image) -> f64 {
    let square = |v: Vec3| f64::from(v.length_squared());
    let difference: f64 = found.pixels.iter().zip(&truth.pixels).map(|(f, t)| square(*f - *t)).sum();
    let whole: f64 = truth.pixels.iter().map(|t| square(*t)).sum();
    let ratio = (difference / whole).sqrt();
    if ratio.is_finite() && found.size == truth.size { ratio } else { f64::INFINITY }
}

/// Fails where the picture of a [`Plugin`], whose example is `source`, is not what the technique makes with the workspace's own raster,
/// to 1 % of its root mean square, or where its glue is longer than 60 lines.
///
/// 8-bit albedos and 10-bit normals err by up to 1/500 and 1/1000, half floats by 1/2048; depths are the same floats. What remains of
/// the 1 % is pixels at silhouettes, which two rasters may see on either side.
///
/// # Panics
/// Where it fails, and where pictures of other frames would have passed too.
pub fn check<P: Plugin, T: GpuTechnique<Error: 'static> + Fit>(
    settings: (T::Options, T::Params),
    views: impl Fn(&Scene) -> Vec<MapView>,
    source: &str,
) {
    let Some(context) = crate::gpu() else { return };
    let (device, queue) = (&context.device, &context.queue);
    let fail = |what: &str, e: Box<dyn Error>| -> ! { panic!("{what}: {e}") };
    let (found, _) = run::<P>(device, queue, FRAMES).unwrap_or_else(|e| fail("the example", e));
    let truth = pictures::<T>(device, queue, FRAMES, settings, views);
    let truth = truth.unwrap_or_else(|e| fail("the own raster", e));
    let error = relative_rms(&found, &truth[FRAMES as usize - 1]);
    #[allow(clippy::print_stdout, reason = "a figure of a test")]
    let () = println!("{}: {:.2} % rms from the own raster after {FRAMES} frames", T::NAME, 100.0 * error);
    assert!(error <= 0.01, "{error}");
    let control = relative_rms(&found, &truth[FRAMES as usize - 16]);
    assert!(control > 0.01, "a picture of a quarter of a second before is as near: {control}");
    let glue =
        source.lines().skip_while(|l| !l.contains("glue begins")).take_while(|l| !l.contains("glue ends"));
    let lines = glue.skip(1).filter(|l| !l.trim().is_empty() && !l.trim().starts_with("//")).count();
    assert!((1..=60).contains(&lines), "{lines} lines of glue");
}
