//! SH-grid ray tracing in a renderer that has its own device, its own instances and its own G-buffer: reversed-Z depth, `Rgb10a2Unorm` normals,
//! sRGB albedo. A light and an object move for 60 frames; indirect light lands in the renderer's own texture of half floats.
//!
//!     cargo run --release -p sh-grid-raytracer --all-features --example own_renderer

#![allow(clippy::print_stdout, reason = "an example's output")]

use std::error::Error;

use indirect_accel::{Accel, BuildPreset};
use indirect_gpu::wgpu::CommandEncoder;
use indirect_gpu::{
    Context, GBufferFormat, GBufferImport, GBufferTarget, GBufferTextures, ImageExport, MovingObjects,
    NormalEncoding, PassTimer, Pipelines, SceneBuffers,
};
use sh_grid_raytracer::cpu::Fit;
use sh_grid_raytracer::gpu::{Inputs, Resources};
use sh_grid_raytracer::{Options, Params, Setup, ShGridRaytracer};
use testkit::own_renderer::{FRAMES, Frame, Plugin, Renderer, run};

/// Coarse enough for a device in software.
pub fn settings() -> (Options, Params) {
    (Options { grid: 8, photons: 4096, directions: 100, ..Options::default() }, Params::default())
}

// The glue begins here.
/// What the renderer keeps of the technique.
pub struct Indirect {
    scene: SceneBuffers,
    objects: MovingObjects,
    import: GBufferImport,
    resources: Resources,
    export: ImageExport,
    setup: Setup,
}

impl Plugin for Indirect {
    fn new(r: &Renderer, first: &Frame) -> Result<Self, Box<dyn Error>> {
        let pipelines = Pipelines::new(&r.device);
        // For the photons' rays: triangles, uploaded once, and which of their vertices move.
        let world = first.scene();
        let scene = SceneBuffers::upload(&r.device, &world)?;
        let objects = MovingObjects::new(&pipelines, &scene, &world.mesh, &[Frame::MOVING])?;
        // The camera: what the renderer draws anyway.
        let camera =
            GBufferTarget::imported(&r.device, [r.depth.texture().width(), r.depth.texture().height()])?;
        let textures = GBufferTextures { depth: &r.depth, normal: &r.normal, albedo: &r.albedo };
        let format = GBufferFormat { normal: NormalEncoding::Unorm, ..GBufferFormat::default() };
        let import = GBufferImport::new(&pipelines, &camera, &textures, format)?;
        let (options, params) = settings();
        let setup = ShGridRaytracer::fit(&Accel::build(&world, BuildPreset::Fast), options, params)?;
        let resources = Resources::new(&pipelines, &r.queue, &setup, 0, &camera)?;
        let export = ImageExport::new(&pipelines, resources.image(), &r.indirect)?;
        Ok(Self { scene, objects, import, resources, export, setup })
    }

    fn frame(&mut self, r: &Renderer, f: &Frame, encoder: &mut CommandEncoder) -> Result<(), Box<dyn Error>> {
        let timer = &mut PassTimer::off();
        self.objects.prepare(&r.queue, 0, &f.moved())?;
        self.objects.encode(encoder, timer);
        // The grid of surfaces and the rays follow the scene.
        ShGridRaytracer::refit(&mut self.setup, &Accel::build(&f.scene(), BuildPreset::Fast));
        let camera = self.import.prepare(&r.queue, &f.clip_from_world)?;
        self.import.encode(encoder, timer);
        let inputs = Inputs { lights: &f.lights, views: &[], camera: &camera };
        self.resources.prepare(&r.queue, &inputs, &self.setup)?;
        self.resources.encode(encoder, timer, &self.scene);
        self.export.encode(encoder, timer);
        Ok(())
    }
}
// The glue ends here.

fn main() -> Result<(), Box<dyn Error>> {
    let context = Context::new(&indirect_gpu::AdapterChoice::from_env())?;
    let (image, micros) = run::<Indirect>(&context.device, &context.queue, FRAMES)?;
    println!("mean {:.4} W/(sr·m²); {micros:.0} µs of CPU a frame (median of {FRAMES})", image.mean().y);
    Ok(())
}
