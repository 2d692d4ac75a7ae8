//! A fixture with an orbiting camera, a light that can be moved and every technique to choose from: in a browser (`cargo xtask web`), and
//! as a picture on a machine without a window (`cargo run --release -p live --example picture`). The same code in both.

mod display;
mod orbit;
mod technique;
#[cfg(target_arch = "wasm32")]
#[allow(unreachable_pub, missing_docs, reason = "wasm-bindgen hands these to scripts")]
mod web;

use indirect_accel::{Accel, BuildPreset};
use indirect_core::{LightKind, MapView, Scene, View};
use indirect_gpu::wgpu::{CommandEncoder, Device, Queue, TextureFormat, TextureView};
use indirect_gpu::{GBufferTarget, PassTimer, Pipelines, SceneBuffers, wgpu};

pub use display::Display;
pub use orbit::Orbit;
pub use technique::{NAMES, settings};

use technique::{Running, make};

/// What is shown: a scene, a camera, a light that moves, and a technique.
pub struct Live {
    pipelines: Pipelines,
    queue: Queue,
    scene: Scene,
    buffers: SceneBuffers,
    camera: GBufferTarget,
    technique: Box<dyn Running>,
    display: Display,
    /// Where the camera is.
    pub orbit: Orbit,
    /// How far the light has been moved from where the scene has it, metres.
    pub light: [f32; 3],
    /// Brightness of the picture.
    pub exposure: f32,
}

/// The limits that a device must have for an image of `size` pixels and any of the techniques, as they are set here.
///
/// # Errors
/// Where a technique cannot be made for the scene.
pub fn required_limits(size: [u32; 2]) -> Result<wgpu::Limits, String> {
    let scene = scene();
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let maps = rsm::views::views(&scene).len();
    NAMES.iter().try_fold(wgpu::Limits::default(), |limits, name| {
        let of = technique::required_limits(name, &accel, size, maps)?;
        Ok(limits.or_better_values_from(&of))
    })
}

/// The Cornell box under one spot light: its ceiling has indirect light alone.
fn scene() -> Scene {
    indirect_scene::fixtures::cornell(indirect_scene::fixtures::CornellLight::Spot)
}

impl Live {
    /// The technique of that name at `size` pixels, shown on a target of `format`.
    ///
    /// # Errors
    /// An unknown name, or a device that is too small.
    pub fn new(
        device: &Device,
        queue: &Queue,
        format: TextureFormat,
        size: [u32; 2],
        name: &str,
    ) -> Result<Self, String> {
        let scene = scene();
        let pipelines = Pipelines::new(device);
        let buffers = SceneBuffers::upload(device, &scene).map_err(|e| e.to_string())?;
        let camera = GBufferTarget::new(device, size).map_err(|e| e.to_string())?;
        let accel = Accel::build(&scene, BuildPreset::Fast);
        let maps = rsm::views::views(&scene).len();
        let technique = make(name, &pipelines, queue, &accel, maps, &camera)?;
        let display = Display::new(device, format, technique.image(), size);
        let orbit = Orbit::of(&scene.cameras[0], &scene);
        drop(accel);
        let light = [0.0; 3];
        Ok(Self {
            pipelines,
            queue: queue.clone(),
            scene,
            buffers,
            camera,
            technique,
            display,
            orbit,
            light,
            exposure: 8.0,
        })
    }

    /// Width and height, pixels.
    #[must_use]
    pub const fn size(&self) -> [u32; 2] {
        self.camera.size()
    }

    /// What the camera sees.
    #[must_use]
    pub fn view(&self) -> View {
        self.orbit.view(self.size())
    }

    /// Encodes a frame: indirect light, and the picture of it where there is a target.
    ///
    /// # Errors
    /// Whatever the technique says.
    pub fn encode(
        &mut self,
        encoder: &mut CommandEncoder,
        target: Option<&TextureView>,
    ) -> Result<(), String> {
        let view = self.view();
        let mut lights = self.scene.lights.clone();
        for light in &mut lights {
            if let LightKind::Spot { position, .. } | LightKind::Point { position } = &mut light.kind {
                *position += glam::Vec3::from_array(self.light);
            }
        }
        let bounds = self.scene.bounds().ok_or("a scene without extent")?;
        let of_light =
            |(light, l)| rsm::views::of(l, &bounds).into_iter().map(move |view| MapView { light, view });
        let views: Vec<_> = lights.iter().enumerate().flat_map(of_light).collect();
        self.camera.prepare(&self.queue, &view);
        self.technique.prepare(&self.queue, &lights, &views, &view)?;
        let timer = &mut PassTimer::off();
        self.pipelines.raster().encode(encoder, timer, "camera", &self.buffers, [&self.camera]);
        self.technique.encode(encoder, timer, &self.buffers);
        if let Some(target) = target {
            self.display.encode(&self.queue, encoder, target, self.exposure);
        }
        Ok(())
    }

    /// The triangle that each pixel of the last frame sees, `array<u32>`.
    #[must_use]
    pub const fn triangles(&self) -> &wgpu::Buffer {
        &self.camera.triangle
    }

    /// Indirect radiance of the last frame, `array<vec4<f32>>`.
    #[must_use]
    pub fn image(&self) -> &wgpu::Buffer {
        self.technique.image()
    }
}
