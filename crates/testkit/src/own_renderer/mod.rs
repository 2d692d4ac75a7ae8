//! A small renderer that stands for a stranger's: its own device, instances of its own mesh, a raster G-buffer in formats of its own
//! choice (reversed-Z depth, `Rgb10a2Unorm` normals, sRGB albedo), a light and an object that move. The `own_renderer` examples plug a
//! technique into it.

mod draw;
mod frame;
mod reference;

use std::error::Error;
use std::time::Instant;

use glam::Vec3;
use indirect_core::{Image, MapView, Scene};
use indirect_gpu::wgpu::{CommandEncoder, CommandEncoderDescriptor, Device, Queue};
use indirect_technique::cpu::Fit;
use indirect_technique::gpu::GpuTechnique;

pub use draw::Renderer;
pub use frame::{FRAMES, Frame, INSTANCES, SIZE};
pub use reference::pictures;

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
