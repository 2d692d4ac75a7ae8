//! CPU time of encoding a frame with 24 maps, four point lights': `Resources::encode` alone, and with the encoder's `finish`.

use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use glam::{Vec2, Vec3};
use indirect_core::{Light, LightKind, Material, Projection, Scene, View};
use indirect_gpu::{AdapterChoice, Context, GBufferTarget, PassTimer, Pipelines, SceneBuffers};
use rsm::views::views;
use rsm_gather::gpu::{Inputs, Resources};
use rsm_gather::{Options, Setup};

fn scene() -> Scene {
    let mut scene =
        Scene { materials: vec![Material::diffuse("grey", Vec3::splat(0.5))], ..Scene::default() };
    // Six faces, so that every face of every light's cube sees something.
    for n in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
        let (t, b) = (n.any_orthonormal_vector(), n.cross(n.any_orthonormal_vector()));
        scene.mesh.push_polygon(&[n + t + b, n - t + b, n - t - b, n + t - b], 0);
    }
    for i in 0..4 {
        let position = Vec3::new(0.3 - 0.2 * i as f32, 0.1 * i as f32, 0.05);
        let kind = LightKind::Point { position };
        scene.lights.push(Light { name: String::new(), kind, power: Vec3::ONE, range: None });
    }
    scene
}

fn encode(c: &mut Criterion) {
    let Ok(context) = Context::new(&AdapterChoice::from_env()) else { return };
    let (device, queue, size) = (&context.device, &context.queue, [256, 256]);
    let scene = scene();
    let views = views(&scene);
    assert_eq!(views.len(), 24);
    let projection = Projection::Perspective { tan_half: Vec2::ONE };
    let view = View::look_to(Vec3::ZERO, Vec3::X, Vec3::Y, projection, 0.01, 10.0);
    let setup = Setup { options: Options { resolution: 512, ..Options::default() }, ..Setup::default() };
    let (Ok(camera), Ok(buffers)) = (GBufferTarget::new(device, size), SceneBuffers::upload(device, &scene))
    else {
        return;
    };
    let Ok(mut resources) = Resources::new(&Pipelines::new(device), queue, &setup, views.len(), &camera)
    else {
        return;
    };
    let inputs = Inputs { lights: &scene.lights, views: &views, camera: &view };
    if resources.prepare(queue, &inputs, &setup).is_err() {
        return;
    }
    let mut group = c.benchmark_group("a frame with 24 maps");
    for finish in [false, true] {
        group.bench_function(if finish { "encode and finish" } else { "encode" }, |b| {
            b.iter_custom(|count| {
                let mut time = Duration::ZERO;
                for _ in 0..count {
                    let mut encoder = device.create_command_encoder(&Default::default());
                    let start = Instant::now();
                    resources.encode(&mut encoder, &mut PassTimer::off(), &buffers);
                    time += start.elapsed();
                    let start = Instant::now();
                    drop(encoder.finish());
                    if finish {
                        time += start.elapsed();
                    }
                }
                time
            });
        });
    }
    group.finish();
}

criterion_group!(benches, encode);
criterion_main!(benches);
