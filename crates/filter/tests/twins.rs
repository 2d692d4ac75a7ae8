//! The filters on the GPU against their twins.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use common::{floor_and_wall, view};
use glam::{Vec3, Vec4};
use indirect_core::View;
use indirect_filter::gpu::SmoothBuffers;
use indirect_filter::{History, cpu};
use indirect_gpu::wgpu::CommandEncoderDescriptor;
use indirect_gpu::{GBufferTarget, Pass, PassTimer, Pipelines, Vec3Pad, named, storage_buffer};
use testkit::{CpuOutput, GpuOutput, Tolerance, compare};

const SIZE: [u32; 2] = [67, 41];

/// Three frames of a camera that moves: the first has no past, the second one that holds what is not finite, the third what the
/// second left on the GPU.
#[test]
fn smoothing_agrees_and_forgets_what_is_not_finite() {
    let Some(context) = testkit::gpu() else { return };
    let (device, queue) = (&context.device, &context.queue);
    let pixels = u64::from(SIZE[0] * SIZE[1]);
    let moved = |x: f32| View { origin: view().origin + Vec3::X * x, ..view() };
    let value = |i: usize| Vec3::new(1.0 + (i % 7) as f32, 2.0, (i % 3) as f32);
    let current: Vec<Vec3> = (0..pixels as usize).map(value).collect();
    let padded: Vec<_> = current.iter().map(|v| Vec3Pad::new(*v, 0.0)).collect();
    let irradiance = storage_buffer(device, "irradiance", &padded).unwrap();
    let target = GBufferTarget::new(device, SIZE).unwrap();
    let buffers = SmoothBuffers::new(device, &pixels).unwrap();
    let mut pass = Pass::new("smooth");
    let mut own = target.named().to_vec();
    own.push(named("irradiance", &irradiance));
    buffers.smooth(&Pipelines::new(device), &mut pass, pixels, &own).unwrap();

    let mut past: Option<History> = None;
    for (frame, x) in [0.0, 0.1, 0.15].into_iter().enumerate() {
        if let (1, Some(past)) = (frame, &mut past) {
            past.pixels[1500] = Vec4::splat(f32::NAN);
            past.pixels[1501] = Vec4::splat(f32::INFINITY);
            buffers.restore(queue, Some(past));
        }
        let now = moved(x);
        let camera = floor_and_wall(&now, SIZE);
        let expected = cpu::smooth(&current, (&now, &camera), past.as_ref(), 0.5);
        assert!(expected.pixels.iter().all(|v| v.is_finite()));
        target.write(queue, &camera);
        buffers.prepare(queue, &now, SIZE, 0.5);
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        pass.encode(&mut encoder, &mut PassTimer::off(), None);
        queue.submit([encoder.finish()]);
        let found: Vec<[f32; 4]> = context.read(&buffers.smoothed).unwrap();
        let expected_pixels: Vec<_> = expected.pixels.iter().map(|v| v.to_array()).collect();
        let far = |a: &[f32; 4], b: &[f32; 4]| a.iter().zip(b).any(|(a, b)| (a - b).abs() >= 1e-3);
        // At the border of a pixel's reach the past is taken or left: by the last bit, there and nowhere else.
        let clear: Vec<bool> = found.iter().zip(&expected_pixels).map(|(a, b)| !far(a, b)).collect();
        let unclear = clear.iter().filter(|c| !**c).count();
        assert!(unclear <= 3, "{unclear} in frame {frame}");
        let (cpu, gpu) = (CpuOutput(&expected_pixels[..]), GpuOutput(&found[..]));
        compare("smooth", cpu, gpu, Tolerance::TWINS, Some(&clear)).unwrap();
        let irradiance = expected.irradiance();
        let followed =
            (0..current.len()).filter(|i| camera.is_surface(*i) && irradiance[*i] != current[*i]).count();
        assert!((frame == 0) != (followed > 500), "{followed} in frame {frame}");
        past = Some(expected);
    }
    buffers.restore(queue, None);
    let kept: Vec<Vec3Pad> = context.read(&buffers.history).unwrap();
    assert!(kept.iter().all(|v| *v == Vec3Pad::default()));
}
