//! Radiance hints in a bare wgpu renderer, headless: its own device, its own G-buffer, three bounces of a spot light in the
//! Cornell box, one frame, written as a PNG.
//!
//!     cargo run --release -p radiance-hints --features gpu --example renderer -- hints.png

#![allow(clippy::print_stdout, reason = "an example's output")]

use std::error::Error;

use indirect_accel::{Accel, BuildPreset};
use indirect_core::Image;
use indirect_gpu::{GBufferTarget, PassTimer, Pipelines, SceneBuffers, Vec3Pad, read_buffer, wgpu};
use indirect_scene::{fixtures, png};
use radiance_hints::gpu::{Inputs, Resources};
use radiance_hints::{Options, Params, RadianceHints, cpu::Fit};

const SIZE: [u32; 2] = [512, 512];

fn main() -> Result<(), Box<dyn Error>> {
    let out = std::env::args().nth(1).unwrap_or_else(|| "hints.png".to_owned());

    // A scene, a camera, and what the technique makes of them: a lattice over the bounds and, by rays, once per scene, what
    // surrounds it. `Setup::new` does without rays.
    let scene = fixtures::build("cornell_spot").ok_or("no such fixture")?;
    let view = scene.cameras[0].view(SIZE);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let setup = RadianceHints::fit(&accel, Options::default(), Params::default())?;
    let views = rsm::views::views(&scene);

    // What any renderer has: a device, with the limits that the buffers need, and a queue,
    let instance = wgpu::Instance::default();
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?;
    let required_limits = Resources::required_limits(&setup, SIZE, views.len());
    let descriptor = wgpu::DeviceDescriptor { required_limits, ..wgpu::DeviceDescriptor::default() };
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))?;
    println!("on {}", adapter.get_info().name);

    // and a G-buffer: positions, normals and albedos in storage buffers.
    let scene_buffers = SceneBuffers::upload(&device, &scene)?;
    let camera = GBufferTarget::new(&device, SIZE)?;

    // Made once: pipelines and buffers for what the options ask for.
    let pipelines = Pipelines::new(&device);
    let mut resources = Resources::new(&pipelines, &queue, &setup, views.len(), &camera)?;

    // Each frame: say what moved, encode into the renderer's own encoder, submit.
    camera.prepare(&queue, &view);
    resources.prepare(&queue, &Inputs { lights: &scene.lights, views: &views, camera: &view }, &setup)?;
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let timer = &mut PassTimer::off();
    pipelines.raster().encode(&mut encoder, timer, "camera", &scene_buffers, [&camera]);
    resources.encode(&mut encoder, timer, &scene_buffers);
    queue.submit([encoder.finish()]);

    // `resources.image()` is the indirect light of each pixel, to be added to the direct; here it is the picture.
    let pixels: Vec<Vec3Pad> = read_buffer(&device, &queue, resources.image())?;
    let image = Image { size: SIZE, pixels: pixels.iter().map(|p| p.vec3()).collect() };
    let exposure = 0.4 / image.mean().element_sum() * 3.0;
    std::fs::write(&out, png::encode_srgb(&image, exposure)?)?;
    println!(
        "{out}: mean {:.4} W/(sr·m²), {} hints, {} bytes in all",
        image.mean().y,
        setup.lattice.hints(),
        resources.bytes()
    );
    Ok(())
}
