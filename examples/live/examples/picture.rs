//! The live scene on a machine without a window: a frame of a technique as a PNG.
//!
//!     cargo run --release -p live --example picture -- radiance-hints picture.png 384

#![allow(clippy::print_stdout, reason = "an example's output")]

use std::error::Error;

use indirect_core::Image;
use indirect_gpu::wgpu::{CommandEncoderDescriptor, TextureFormat};
use indirect_gpu::{AdapterChoice, Context, Vec3Pad};
use indirect_scene::{exr, png};
use live::{Live, required_limits};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "radiance-hints".to_owned());
    let out = arguments.next().unwrap_or_else(|| "picture.png".to_owned());
    let side: u32 = arguments.next().map_or(Ok(384), |n| n.parse())?;
    let size = [side; 2];
    let gpu = Context::with_limits(&AdapterChoice::from_env(), &required_limits(size)?)?;
    let mut live = Live::new(&gpu.device, &gpu.queue, TextureFormat::Rgba8UnormSrgb, size, &name)?;
    let mut encoder = gpu.device.create_command_encoder(&CommandEncoderDescriptor::default());
    live.encode(&mut encoder, None)?;
    gpu.queue.submit([encoder.finish()]);
    let pixels: Vec<Vec3Pad> = gpu.read(live.image())?;
    let image = Image { size, pixels: pixels.iter().map(|p| p.vec3()).collect() };
    if out.ends_with(".exr") {
        exr::write_rgb(out.as_ref(), &image)?;
    } else {
        std::fs::write(&out, png::encode_srgb(&image, live.exposure)?)?;
    }
    println!("{out}: {name} on {}, mean {:.4} W/(sr·m²)", gpu.describe(), image.mean().y);
    Ok(())
}
