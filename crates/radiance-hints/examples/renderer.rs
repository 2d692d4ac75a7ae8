//! Radiance hints in a bare wgpu renderer, headless: its own device, its own G-buffer, three bounces of a spot light in the
//! Cornell box, one frame, written as a PNG.
//!
//!     cargo run --release -p radiance-hints --features gpu --example renderer -- hints.png

#![allow(clippy::print_stdout, reason = "an example's output")]

use std::error::Error;

use indirect_accel::{Accel, BuildPreset};
use indirect_core::Image;
use indirect_gpu::{GBufferTarget, PassTimer, Raster, SceneBuffers, Vec3Pad, read_buffer, wgpu};
use indirect_scene::{fixtures, png};
use radiance_hints::{Lattice, Options, Params, Visibility, cpu, gpu};

const SIZE: [u32; 2] = [512, 512];

fn main() -> Result<(), Box<dyn Error>> {
    let out = std::env::args().nth(1).unwrap_or_else(|| "hints.png".to_owned());

    // What any renderer has: a device and a queue,
    let instance = wgpu::Instance::default();
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default()))?;
    println!("on {}", adapter.get_info().name);

    // a scene, a camera, and a G-buffer: positions, normals and albedos in storage buffers.
    let scene = fixtures::build("cornell_spot").ok_or("no such fixture")?;
    let view = scene.cameras[0].view(SIZE);
    let scene_buffers = SceneBuffers::upload(&device, &scene)?;
    let raster = Raster::new(&device);
    let camera = GBufferTarget::new(&device, SIZE, 1)?;

    // Made once: pipelines for what the options ask for, a lattice over the scene, buffers.
    let options = Options { bounces: 3, visibility: Visibility::RsmDepth, ..Options::default() };
    let hints = gpu::RadianceHints::new(&device, &options)?;
    let bounds = scene.bounds().ok_or("an empty scene")?;
    let lattice = Lattice::fit(&bounds, 4096)?;
    let views = rsm::views::views(&scene);
    let mut resources = gpu::Resources::new(&device, &hints, views.len(), &lattice, &camera)?;

    // Optional, once per scene: what is around the box. Rays on the CPU; without it every side counts as a wall.
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let maps = rsm::cpu::generate(&accel, &rsm::Options { resolution: 64, ..rsm::Options::default() })?;
    let params = Params { enclosure: Some(cpu::enclosure(&accel, &bounds, &maps)), ..Params::default() };

    // Each frame: say what moved, encode into the renderer's own encoder, submit.
    resources.prepare(&queue, (&scene.lights, &views), &view, &lattice, &params)?;
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let timer = &mut PassTimer::off();
    raster.encode(&mut encoder, timer, &scene_buffers, &view, &camera, 0)?;
    hints.encode(&mut encoder, timer, &scene_buffers, &resources)?;
    queue.submit([encoder.finish()]);

    // `resources.image` is the indirect light of each pixel, to be added to the direct; here it is the picture.
    let pixels: Vec<Vec3Pad> = read_buffer(&device, &queue, &resources.image)?;
    let image = Image { size: SIZE, pixels: pixels.iter().map(|p| p.vec3()).collect() };
    let exposure = 0.4 / image.mean().element_sum() * 3.0;
    std::fs::write(&out, png::encode_srgb(&image, exposure)?)?;
    println!(
        "{out}: mean {:.4} W/(sr·m²), {} hints of {} bytes, {} bytes in all",
        image.mean().y,
        lattice.hints(),
        options.hint_bytes(lattice.hints()) / u64::from(lattice.hints()),
        resources.bytes()
    );
    Ok(())
}
