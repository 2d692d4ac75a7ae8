//! The raster pass on the atrium (100 000+ triangles) and the Cornell box, beside the CPU's ray cast of the same image.
//! Submission and waiting are included. `INDIRECT_ADAPTER` chooses the adapter.
#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark is no library")]

use criterion::{Criterion, criterion_group, criterion_main};
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_gpu::wgpu::PollType;
use indirect_gpu::{AdapterChoice, Context, GBufferTarget, PassTimer, Raster, SceneBuffers};
use indirect_scene::fixtures;

fn raster(criterion: &mut Criterion) {
    let gpu = Context::new(&AdapterChoice::from_env()).unwrap();
    let size = [512, 512];
    for name in ["cornell_spot", "atrium"] {
        let scene = fixtures::build(name).unwrap();
        let view = scene.cameras[0].view(size);
        let mut group = criterion.benchmark_group(name);
        group.sample_size(10);
        let buffers = SceneBuffers::upload(&gpu.device, &scene).unwrap();
        let target = GBufferTarget::new(&gpu.device, size).unwrap();
        target.prepare(&gpu.queue, &view);
        let raster = Raster::new(&gpu.device);
        group.bench_function("gpu", |b| {
            b.iter(|| {
                let mut encoder = gpu.device.create_command_encoder(&Default::default());
                raster.encode(&mut encoder, &mut PassTimer::off(), "camera", &buffers, [&target]);
                gpu.queue.submit([encoder.finish()]);
                gpu.device.poll(PollType::wait_indefinitely()).unwrap();
            });
        });
        let accel = Accel::build(&scene, BuildPreset::Balanced);
        group.bench_function("cpu", |b| b.iter(|| cast::gbuffer(&accel, &view, size)));
    }
}

criterion_group!(benches, raster);
criterion_main!(benches);
