//! Every pass on the GPU against its twin on the CPU, and the whole chain.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use common::{camera_view, floor_and_wall, lattice, light, lights, scaled, two_volumes};
use glam::Vec3;
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::Scene;
use indirect_gpu::wgpu::CommandEncoderDescriptor;
use indirect_gpu::{Context, GBufferTarget, PassTimer, Raster, SceneBuffers, Vec3Pad};
use radiance_hints::gpu::{RadianceHints, Resources, Smooth, SmoothResources, twins};
use radiance_hints::{
    Lattice, Options, Order, Params, Reconstruction, Sampling, Scale, Transport, Visibility, cpu,
};
use rsm::gpu::{Data, Twin};
use testkit::{CompareError, CpuOutput, GpuOutput, Tolerance, compare, compare_exact};

/// Neither a power of two nor a multiple of a workgroup.
const CAMERA: [u32; 2] = [67, 41];

fn options() -> Options {
    Options { resolution: 45, samples: 49, bounce_samples: 9, ..Options::default() }
}

struct Frame {
    twins: Vec<Twin>,
    cpu: cpu::Output,
    /// The image of the whole GPU chain.
    image: Vec<Vec3>,
    bytes: u64,
}

fn frame(
    context: &Context,
    scene: &Scene,
    scale: f32,
    lattice: &Lattice,
    options: &Options,
    params: &Params,
) -> Frame {
    let (device, queue) = (&context.device, &context.queue);
    let accel = Accel::build(scene, BuildPreset::Fast);
    let view = camera_view(scale);
    let camera = cast::gbuffer(&accel, &view, CAMERA);
    let cpu = cpu::indirect(&accel, &view, &camera, lattice, options, params).unwrap();

    let buffers = SceneBuffers::upload(device, scene).unwrap();
    let target = GBufferTarget::new(device, CAMERA, 1).unwrap();
    let hints = RadianceHints::new(device, options).unwrap();
    let views = rsm::views::views(scene);
    let mut resources = Resources::new(device, &hints, views.len(), lattice, &target).unwrap();
    resources.prepare(queue, (&scene.lights, &views), &view, lattice, params).unwrap();
    let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
    let timer = &mut PassTimer::off();
    Raster::new(device).encode(&mut encoder, timer, &buffers, &view, &target, 0).unwrap();
    hints.encode(&mut encoder, timer, &buffers, &resources).unwrap();
    queue.submit([encoder.finish()]);
    let image: Vec<Vec3Pad> = context.read(&resources.image).unwrap();
    let image = image.iter().map(|v| v.vec3()).collect();
    let twins = twins((device, queue), &hints, &resources, &camera, &target, &cpu).unwrap();
    Frame { twins, cpu, image, bytes: resources.bytes() }
}

fn check(twin: &Twin) -> Result<(), String> {
    let name = format!("{} {}", twin.pass, twin.buffer);
    match (&twin.cpu, &twin.gpu) {
        (Data::F32 { values: a, components }, Data::F32 { values: b, .. }) => {
            // 1e-6 of the buffer's own magnitude where that is below 1.
            let largest = a.iter().fold(0.0_f32, |m, v| m.max(v.abs()));
            let tolerance = Tolerance { absolute: 1e-6 * largest.clamp(1e-30, 1.0), ..Tolerance::TWINS };
            let result = match components {
                1 => floats::<1>(&name, a, b, tolerance),
                2 => floats::<2>(&name, a, b, tolerance),
                3 => floats::<3>(&name, a, b, tolerance),
                4 => floats::<4>(&name, a, b, tolerance),
                12 => floats::<12>(&name, a, b, tolerance),
                28 => floats::<28>(&name, a, b, tolerance),
                n => panic!("{name} has {n} components"),
            };
            result.map_err(|e| e.to_string())
        }
        (Data::U32(a), Data::U32(b)) if ["occlusion", "near", "stops"].contains(&twin.pass) => {
            // A segment or a projection that grazes a texel's border falls to either side.
            let differ = a.iter().zip(b).filter(|(a, b)| a != b).count();
            println!("{name}: {differ} of {} numbers differ", a.len());
            let few = a.len() == b.len() && differ * 500 <= a.len();
            if few { Ok(()) } else { Err(format!("{name}: {differ} of {} numbers differ", a.len())) }
        }
        (Data::U32(a), Data::U32(b)) => compare_exact(&name, CpuOutput(a), GpuOutput(b), None)
            .map(|c| println!("{c}"))
            .map_err(|e| e.to_string()),
        _ => Err(format!("{name}: numbers of different kinds")),
    }
}

fn floats<const N: usize>(
    name: &str,
    a: &[f32],
    b: &[f32],
    tolerance: Tolerance,
) -> Result<(), CompareError> {
    let (a, b): (&[[f32; N]], &[[f32; N]]) = (chunks_of(a), chunks_of(b));
    compare(name, CpuOutput(a), GpuOutput(b), tolerance, None).map(|c| println!("{c}"))
}

fn chunks_of<const N: usize>(values: &[f32]) -> &[[f32; N]] {
    let (chunks, rest) = values.as_chunks::<N>();
    assert!(rest.is_empty());
    chunks
}

fn assert_twins(frame: &Frame) {
    for twin in &frame.twins {
        check(twin).unwrap_or_else(|e| panic!("{e}"));
    }
}

#[test]
fn every_pass_agrees_for_every_light_and_option() {
    let Some(context) = testkit::gpu() else { return };
    let params = Params { seed: 7, ..Params::default() };
    let cases = [
        (options(), params),
        (Options { bounces: 4, scale: Scale::Half, visibility: Visibility::RsmDepth, ..options() }, params),
        (
            Options {
                order: Order::Two,
                sampling: Sampling::Disc { fraction: 0.4 },
                bounces: 2,
                scale: Scale::Quarter,
                visibility: Visibility::CameraDepth,
                ..options()
            },
            Params { transport: Transport::Sphere, reconstruction: Reconstruction::AsPrinted, ..params },
        ),
        (
            Options {
                bounces: 3,
                order: Order::Two,
                samples: 21,
                sampling: Sampling::Importance,
                ..options()
            },
            Params {
                transport: Transport::SphereAsPrinted,
                range: 0.4,
                jitter: 1.0,
                footprint: 0.0,
                ..params
            },
        ),
    ];
    for (i, (options, params)) in cases.iter().enumerate() {
        let scene = floor_and_wall(lights()[i % 3], 1.0);
        let accel = Accel::build(&scene, BuildPreset::Fast);
        let enclosure = (i == 1).then(|| {
            let rsm = rsm::cpu::generate(&accel, &options.rsm()).unwrap();
            cpu::enclosure(&accel, &scene.bounds().unwrap(), &rsm)
        });
        let params = Params { enclosure, ..*params };
        let lattice = if i % 2 == 0 { lattice(&scene, 6) } else { two_volumes(&scene) };
        let frame = frame(context, &scene, 1.0, &lattice, options, &params);
        assert_twins(&frame);
        let expected = frame.cpu.image.mean();
        let mean = frame.image.iter().sum::<Vec3>() / frame.image.len() as f32;
        // The maps' silhouettes, and the samples drawn from them, may fall elsewhere: one or two of the 21 samples.
        assert!((mean - expected).abs().max_element() < 0.05 * expected.max_element(), "{mean} {expected}");
    }
}

#[test]
fn a_perturbed_buffer_is_found() {
    let Some(context) = testkit::gpu() else { return };
    let scene = floor_and_wall(lights()[0], 1.0);
    let options = Options { bounces: 2, scale: Scale::Half, visibility: Visibility::RsmDepth, ..options() };
    let mut frame = frame(context, &scene, 1.0, &lattice(&scene, 5), &options, &Params::default());
    assert_twins(&frame);
    for twin in &mut frame.twins {
        match &mut twin.gpu {
            Data::F32 { values, .. } => {
                let largest = values.iter_mut().max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap();
                *largest = if *largest == 0.0 { 1.0 } else { *largest * 1.001 };
            }
            // A word is forgiven, a hundredth of them is not.
            Data::U32(values) => values.iter_mut().step_by(100).for_each(|v| *v ^= 1),
        }
        assert!(check(twin).is_err(), "{} {}", twin.pass, twin.buffer);
    }
}

#[test]
fn the_image_does_not_depend_on_the_scale() {
    let Some(context) = testkit::gpu() else { return };
    let image = |s: f32| {
        let mut scene = floor_and_wall(scaled(lights()[0], s), s);
        scene.lights[0].power *= s * s;
        let options = Options { bounces: 2, ..options() };
        frame(context, &scene, s, &lattice(&scene, 6), &options, &Params::default()).image
    };
    let one = image(1.0);
    let mean = one.iter().sum::<Vec3>().max_element() / one.len() as f32;
    assert!(mean > 0.0);
    for s in [0.01, 1000.0] {
        let other = image(s);
        let difference: f32 = one.iter().zip(&other).map(|(a, b)| (*a - *b).abs().max_element()).sum();
        // Rounding may move a sample to the neighbouring texel: a forty-fifth of the map.
        assert!(difference / one.len() as f32 <= 2e-3 * mean, "{s}: {difference}");
    }
}

#[test]
fn a_scene_without_light_is_black() {
    let Some(context) = testkit::gpu() else { return };
    let mut dark = floor_and_wall(lights()[0], 1.0);
    dark.lights.clear();
    let mut black = floor_and_wall(lights()[1], 1.0);
    black.materials[0].base_color = Vec3::ZERO;
    black.lights.push(light(lights()[0], Vec3::ONE));
    for scene in [dark, black] {
        for visibility in [Visibility::Off, Visibility::RsmDepth] {
            let options = Options { bounces: 3, visibility, ..options() };
            let frame = frame(context, &scene, 1.0, &lattice(&scene, 4), &options, &Params::default());
            assert!(frame.image.iter().all(|v| *v == Vec3::ZERO));
        }
    }
}

/// What is not asked for is not allocated: the page's formula, byte for byte.
#[test]
fn the_hints_take_what_the_formula_says() {
    let Some(context) = testkit::gpu() else { return };
    let scene = floor_and_wall(lights()[0], 1.0);
    let lattice = lattice(&scene, 8);
    let bytes = |options: &Options| frame(context, &scene, 1.0, &lattice, options, &Params::default()).bytes;
    let one = options();
    let settings = size_of::<radiance_hints::layout::Settings>() as u64;
    for bounces in [2, 3, 5] {
        for order in [Order::Two, Order::Three] {
            let more = Options { bounces, order, ..one };
            let grown = bytes(&more) - bytes(&Options { order, ..one });
            let hints = more.hint_bytes(512) - Options { order, ..one }.hint_bytes(512);
            // One bounce holds one element of the surroundings, which its shader does not write.
            assert_eq!(grown, hints + settings * u64::from(bounces - 1) - 20);
        }
    }
    assert_eq!(one.hint_bytes(512), 512 * 112);
    assert_eq!(Options { order: Order::Two, ..one }.hint_bytes(512), 512 * 48);
}

#[test]
fn smoothing_agrees_and_forgets_what_is_not_finite() {
    let Some(context) = testkit::gpu() else { return };
    let (device, queue) = (&context.device, &context.queue);
    let scene = floor_and_wall(lights()[0], 1.0);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let (before, now) = (camera_view(1.0), camera_view(1.05));
    let [past, camera] = [before, now].map(|v| cast::gbuffer(&accel, &v, CAMERA));
    let value = |i: usize| Vec3::new(1.0 + (i % 7) as f32, 2.0, (i % 3) as f32);
    let current: Vec<Vec3> = (0..camera.len()).map(value).collect();
    let mut history: Vec<Vec3> = (0..camera.len()).map(|i| value(i + 3) * 2.0).collect();
    history[1500] = Vec3::splat(f32::NAN);
    history[1501] = Vec3::splat(f32::INFINITY);
    let previous = indirect_filter::cpu::Previous {
        view: &before,
        size: past.size,
        depth: &past.depth,
        irradiance: &history,
    };
    let expected = indirect_filter::cpu::smooth(&current, &camera, &previous, 0.5);
    assert!(expected.iter().all(|v| v.is_finite()));

    let target = GBufferTarget::new(device, CAMERA, 1).unwrap();
    let pad = |v: &[Vec3], w: &dyn Fn(usize) -> f32| -> Vec<Vec3Pad> {
        v.iter().enumerate().map(|(i, v)| Vec3Pad::new(*v, w(i))).collect()
    };
    queue.write_buffer(
        &target.position,
        0,
        bytemuck::cast_slice(&pad(&camera.position, &|i| camera.depth[i])),
    );
    queue.write_buffer(&target.normal, 0, bytemuck::cast_slice(&pad(&camera.normal, &|_| 0.0)));
    let buffer = indirect_gpu::storage_buffer(device, "current", &pad(&current, &|_| 0.0)).unwrap();
    let smooth = Smooth::new(device);
    let mut resources = SmoothResources::new(device, &smooth, &buffer, &target).unwrap();
    let history = pad(&history, &|i| past.depth[i]);
    resources.images.iter().for_each(|image| queue.write_buffer(image, 0, bytemuck::cast_slice(&history)));
    resources.prepare(queue, &before, 0.5).unwrap();
    assert!(resources.prepare(queue, &before, 1.0).is_err());
    let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
    smooth.encode(&mut encoder, &mut PassTimer::off(), &mut resources).unwrap();
    queue.submit([encoder.finish()]);
    let found: Vec<Vec3Pad> = context.read(resources.smoothed()).unwrap();
    let found: Vec<Vec3> = found.iter().map(|v| v.vec3()).collect();
    // At the border of a pixel's reach the past is taken or left: by the last bit, there and nowhere else.
    let clear: Vec<bool> =
        found.iter().zip(&expected).map(|(a, b)| (*a - *b).abs().max_element() < 1e-3).collect();
    let unclear = clear.iter().filter(|c| !**c).count();
    assert!(unclear <= 3, "{unclear}");
    compare("smooth", CpuOutput(&expected), GpuOutput(&found), Tolerance::TWINS, Some(&clear)).unwrap();
}
