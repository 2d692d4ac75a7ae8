use indirect_core::GBuffer;
use indirect_gpu::wgpu::{CommandEncoderDescriptor, Device, Queue};
use indirect_gpu::{GBufferTarget, GpuError, PassTimer, SceneBuffers};

use super::exchange::{Exchange, Mode, Twin};
use super::{GpuTechnique, Resources};
use crate::Frame;

/// Where a pass runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Backend {
    /// Plain Rust.
    Cpu,
    /// wgpu.
    Gpu,
}

/// Runs every pass of a frame on both backends, from the same input, and goes on with the results of the backend that `keep` names
/// for the pass: those of one throughout, so that a difference shows in the pass that makes it and nowhere else, or of either,
/// to find the pass that spoils an image. Returns the output and all buffers beside their twins. Submits and blocks.
///
/// `resources` must have been prepared with what makes the frame. Their contents, and those of the camera's G-buffer, are
/// overwritten.
///
/// # Errors
/// [`GpuError::ReadBack`].
pub fn run_both<T: GpuTechnique>(
    (device, queue): (&Device, &Queue),
    frame: &Frame<'_, T::Setup>,
    resources: &Resources<T>,
    scene: &SceneBuffers,
    keep: impl Fn(&str) -> Backend,
) -> Result<(T::Output, Vec<Twin>), GpuError> {
    run_both_after((device, queue), frame, resources, scene, keep, T::Output::default())
}

/// [`run_both`] for a frame that follows another, whose output is `past`.
///
/// # Errors
/// As there.
pub fn run_both_after<T: GpuTechnique>(
    (device, queue): (&Device, &Queue),
    frame: &Frame<'_, T::Setup>,
    resources: &Resources<T>,
    scene: &SceneBuffers,
    keep: impl Fn(&str) -> Backend,
    past: T::Output,
) -> Result<(T::Output, Vec<Twin>), GpuError> {
    let (rows, mut output) = (T::rows(), past);
    let mut exchange = Exchange::new(device, queue);
    resources.camera.write(queue, frame.camera);
    T::restore(&resources.buffers, queue, &output);
    for (row, number, pass) in &resources.passes {
        let row = &rows[*row];
        row.run_cpu(frame, &mut output, *number);
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        pass.encode(&mut encoder, &mut PassTimer::off(), Some(scene));
        queue.submit([encoder.finish()]);
        let kept = match keep(row.name()) {
            Backend::Cpu => Mode::Upload,
            Backend::Gpu => Mode::Download,
        };
        for mode in [Mode::Compare, kept] {
            exchange.mode = mode;
            row.exchange(&resources.buffers, &mut output, &mut exchange, *number);
        }
        if let Some(e) = exchange.failed.take() {
            return Err(e);
        }
    }
    Ok((output, exchange.twins))
}

/// All buffers of a frame beside their twins, each made from the CPU's results of the passes before: see [`run_both`].
///
/// # Errors
/// As there.
pub fn twins<T: GpuTechnique>(
    gpu: (&Device, &Queue),
    frame: &Frame<'_, T::Setup>,
    resources: &Resources<T>,
    scene: &SceneBuffers,
) -> Result<Vec<Twin>, GpuError> {
    Ok(run_both(gpu, frame, resources, scene, |_| Backend::Cpu)?.1)
}

/// What the camera sees, beside its twin. Submits and blocks.
///
/// # Errors
/// As there.
pub fn camera_twins(
    (device, queue): (&Device, &Queue),
    cpu: &GBuffer,
    gpu: &GBufferTarget,
) -> Result<Vec<Twin>, GpuError> {
    let mut exchange = Exchange::new(device, queue);
    exchange.begin("camera");
    exchange.surface(gpu, &mut cpu.clone());
    exchange.failed.map_or(Ok(exchange.twins), Err)
}
