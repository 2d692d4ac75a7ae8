//! Throughput of the gather on both backends, pixels × VPLs per second.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use indirect_gpu::wgpu::{CommandEncoderDescriptor, PollType};
use indirect_gpu::{
    AdapterChoice, Context, Pass, PassTimer, Pipelines, Vec3Pad, empty_storage_buffer, named, storage_buffer,
};
use rsm::gpu::VplList;
use rsm::{Form, Vpl, cpu};

const PIXELS: u32 = 256 * 256;
const VPLS: u32 = 1024;

fn vpls() -> Vec<Vpl> {
    (0..VPLS)
        .map(|i| {
            let t = i as f32;
            Vpl::new(Vec3::new(t.sin(), 2.0, t.cos()), Vec3::NEG_Y, Vec3::new(1.0, 0.5, 0.2), 1e-3)
        })
        .collect()
}

fn receivers() -> impl Iterator<Item = (Vec3, Vec3)> {
    (0..PIXELS).map(|i| (Vec3::new((i % 256) as f32, 0.0, (i / 256) as f32) * 0.01, Vec3::Y))
}

fn gather(c: &mut Criterion) {
    let mut group = c.benchmark_group("gather");
    group.sample_size(10).throughput(Throughput::Elements(u64::from(PIXELS) * u64::from(VPLS)));
    let (vpls, points) = (vpls(), receivers().collect::<cpu::Receivers>());
    group.bench_function(BenchmarkId::new("cpu", rayon::current_num_threads()), |b| {
        b.iter(|| cpu::gather(&vpls, &points, Form::Disc));
    });
    if let Ok(context) = Context::new(&AdapterChoice::from_env()) {
        let (device, queue) = (&context.device, &context.queue);
        let column = |get: fn((Vec3, Vec3)) -> Vec3| {
            let data: Vec<_> = receivers().map(|r| Vec3Pad::new(get(r), 0.0)).collect();
            storage_buffer(device, "receivers", &data)
        };
        let (Ok(positions), Ok(normals)) = (column(|r| r.0), column(|r| r.1)) else { return };
        let pipelines = Pipelines::new(device);
        let (Ok(list), Ok(irradiance)) = (
            VplList::new(device, VPLS),
            empty_storage_buffer::<Vec3Pad>(device, "irradiance", PIXELS.into()),
        ) else {
            return;
        };
        let names =
            [named("positions", &positions), named("normals", &normals), named("irradiance", &irradiance)];
        let mut pass = Pass::new("gather");
        if list.gather(&pipelines, &mut pass, PIXELS.into(), &names).is_err() {
            return;
        }
        list.prepare(queue, PIXELS, Form::Disc);
        list.write(queue, &vpls);
        group.bench_function(BenchmarkId::new("gpu", &context.info.name), |b| {
            b.iter(|| {
                let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
                pass.encode(&mut encoder, &mut PassTimer::off(), None);
                queue.submit([encoder.finish()]);
                device.poll(PollType::wait_indefinitely()).is_ok()
            });
        });
    }
    group.finish();
}

criterion_group!(benches, gather);
criterion_main!(benches);
