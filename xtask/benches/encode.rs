//! CPU time of encoding a frame with 24 maps, those of four point lights, for every technique: `Resources::encode` alone, and with
//! the encoder's `finish`.

use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::{Vec2, Vec3};
use indirect_accel::{Accel, BuildPreset};
use indirect_core::{Light, LightKind, Material, Projection, Scene, View};
use indirect_gpu::{AdapterChoice, Context, GBufferTarget, PassTimer, Pipelines, SceneBuffers};
use indirect_technique::cpu::Fit;
use indirect_technique::gpu::{GpuTechnique, Inputs, Resources};

/// A closed box, so that every face of every light's cube sees something.
fn scene() -> Scene {
    let mut scene =
        Scene { materials: vec![Material::diffuse("grey", Vec3::splat(0.5))], ..Scene::default() };
    for n in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
        let t = n.any_orthonormal_vector();
        let b = n.cross(t);
        scene.mesh.push_polygon(&[n + t + b, n - t + b, n - t - b, n + t - b], 0);
    }
    for i in 0..4 {
        let kind = LightKind::Point { position: Vec3::new(0.3 - 0.2 * i as f32, 0.1 * i as f32, 0.05) };
        scene.lights.push(Light { name: String::new(), kind, power: Vec3::ONE, range: None });
    }
    scene
}

fn of<T: Fit + GpuTechnique>(c: &mut Criterion, context: &Context) {
    let (device, queue) = (&context.device, &context.queue);
    let scene = scene();
    let views = rsm::views::views(&scene);
    assert_eq!(views.len(), 24);
    let projection = Projection::Perspective { tan_half: Vec2::ONE };
    let view = View::look_to(Vec3::ZERO, Vec3::X, Vec3::Y, projection, 0.01, 10.0);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let Ok(setup) = T::fit(&accel, T::Options::default(), T::Params::default()) else { return };
    let Ok(camera) = GBufferTarget::new(device, [256, 256]) else { return };
    let Ok(buffers) = SceneBuffers::upload(device, &scene) else { return };
    let resources = Resources::<T>::new(&Pipelines::new(device), queue, &setup, views.len(), &camera);
    let Ok(mut resources) = resources else { return };
    let inputs = Inputs { lights: &scene.lights, views: &views, camera: &view };
    if resources.prepare(queue, &inputs, &setup).is_err() {
        return;
    }
    let mut group = c.benchmark_group("a frame with 24 maps");
    for finish in [false, true] {
        let what = if finish { "encode and finish" } else { "encode" };
        group.bench_function(BenchmarkId::new(what, T::NAME), |b| {
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

fn encode(c: &mut Criterion) {
    let Ok(context) = Context::new(&AdapterChoice::from_env()) else { return };
    of::<rsm_gather::RsmGather>(c, &context);
    of::<radiance_hints::RadianceHints>(c, &context);
    of::<image_space_radiosity::ImageSpaceRadiosity>(c, &context);
}

criterion_group!(benches, encode);
criterion_main!(benches);
