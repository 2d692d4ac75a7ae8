//! Every pass on the GPU against its twin on the CPU, and the whole chain.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use common::{camera_view, floor_and_wall, lattice, light, lights, one_bounce, scaled, setup, two_volumes};
use glam::Vec3;
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::{Scene, View};
use indirect_gpu::wgpu::CommandEncoderDescriptor;
use indirect_gpu::{Context, GBufferTarget, PassTimer, Pipelines, SceneBuffers, Vec3Pad};
use indirect_technique::gpu::{Backend, Data, Inputs, Twin, run_both, run_both_after};
use radiance_hints::gpu::Resources;
use radiance_hints::{
    Options, Order, Output, Params, RadianceHints, Reconstruction, Sampling, Scale, Setup, Transport,
    Visibility,
    cpu::{self, Fit},
};
use testkit::{judge, perturb};

/// Neither a power of two nor a multiple of a workgroup.
const CAMERA: [u32; 2] = [67, 41];

fn options() -> Options {
    Options { resolution: 45, samples: 49, bounce_samples: 9, ..one_bounce() }
}

struct Frame {
    twins: Vec<Twin>,
    cpu: Output,
    /// The image of the whole GPU chain.
    image: Vec<Vec3>,
}

/// One frame on both backends, after another whose CPU output is `past`.
fn frame_after(context: &Context, scene: &Scene, view: View, setup: &Setup, past: Output) -> Frame {
    let (device, queue) = (&context.device, &context.queue);
    let accel = Accel::build(scene, BuildPreset::Fast);
    let camera = cast::gbuffer(&accel, &view, CAMERA);
    let frame = cpu::Frame::new(&accel, &view, &camera, setup);

    let buffers = SceneBuffers::upload(device, scene).unwrap();
    let pipelines = Pipelines::new(device);
    let target = GBufferTarget::new(device, CAMERA).unwrap();
    let views = rsm::views::views(scene);
    let mut resources = Resources::new(&pipelines, queue, setup, views.len(), &target).unwrap();
    let inputs = Inputs { lights: &scene.lights, views: &views, camera: &view };
    resources.prepare(queue, &inputs, setup).unwrap();
    target.prepare(queue, &view);
    let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
    let timer = &mut PassTimer::off();
    pipelines.raster().encode(&mut encoder, timer, "camera", &buffers, [&target]);
    resources.encode(&mut encoder, timer, &buffers);
    queue.submit([encoder.finish()]);
    let image: Vec<Vec3Pad> = context.read(resources.image()).unwrap();
    let image = image.iter().map(|v| v.vec3()).collect();
    let (cpu, twins) =
        run_both_after((device, queue), &frame, &resources, &buffers, |_| Backend::Cpu, past).unwrap();
    // Two of the lists' samples, say, on the GPU and all else on the CPU: the same picture.
    let keep = |pass: &str| if pass == "sample" { Backend::Gpu } else { Backend::Cpu };
    let (mixed, _) = run_both((device, queue), &frame, &resources, &buffers, keep).unwrap();
    let (mixed, expected) = (mixed.image.mean(), cpu::indirect(&frame).unwrap().image.mean());
    assert!((mixed - expected).abs().max_element() <= 1e-4 * expected.max_element(), "{mixed} {expected}");
    Frame { twins, cpu, image }
}

fn frame(context: &Context, scene: &Scene, scale: f32, setup: &Setup) -> Frame {
    frame_after(context, scene, camera_view(scale), setup, Output::default())
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
                sampling: Sampling::Disc,
                bounces: 2,
                scale: Scale::Quarter,
                visibility: Visibility::CameraDepth,
                transport: Transport::Sphere,
                ..options()
            },
            Params { disc: 0.4, reconstruct: Reconstruction::AsPrinted, ..params },
        ),
        (
            Options {
                bounces: 3,
                order: Order::Two,
                samples: 21,
                sampling: Sampling::Importance,
                transport: Transport::SphereAsPrinted,
                ..options()
            },
            Params { range: 0.4, jitter: 1.0, footprint: 0.0, ..params },
        ),
    ];
    for (i, (options, params)) in cases.into_iter().enumerate() {
        let scene = floor_and_wall(lights()[i % 3], 1.0);
        let accel = Accel::build(&scene, BuildPreset::Fast);
        let enclosure = RadianceHints::fit(&accel, options, params).unwrap().enclosure.filter(|_| i == 1);
        let lattice = if i % 2 == 0 { lattice(&scene, 6) } else { two_volumes(&scene) };
        let frame = frame(context, &scene, 1.0, &Setup { enclosure, ..setup(&lattice, options, params) });
        judge(&frame.twins);
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
    let options = Options {
        bounces: 2,
        scale: Scale::Half,
        visibility: Visibility::RsmDepth,
        smoothing: 0.5,
        ..options()
    };
    let setup = setup(&lattice(&scene, 5), options, Params::default());
    let mut frame = frame(context, &scene, 1.0, &setup);
    judge(&frame.twins);
    for i in 0..frame.twins.len() {
        let good = frame.twins[i].gpu.clone();
        perturb(&mut frame.twins[i]);
        let found = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| judge(&frame.twins)));
        // In these a word may differ where a segment grazes a texel's border; the mask says which, and counts.
        assert!(found.is_err(), "{} {}", frame.twins[i].pass, frame.twins[i].buffer);
        frame.twins[i].gpu = good;
    }
}

/// A camera that moves: what is kept of the frame before is the same on both sides.
#[test]
fn a_frame_that_looks_back_agrees() {
    let Some(context) = testkit::gpu() else { return };
    let scene = floor_and_wall(lights()[0], 1.0);
    let options = Options { smoothing: 0.5, ..options() };
    let mut setup = setup(&lattice(&scene, 5), options, Params::default());
    let first = frame(context, &scene, 1.0, &setup);
    setup.params.seed = 1;
    let moved = View { origin: camera_view(1.0).origin + Vec3::X * 0.02, ..camera_view(1.0) };
    let second = frame_after(context, &scene, moved, &setup, first.cpu);
    let (smoothed, others): (Vec<_>, Vec<_>) = second.twins.into_iter().partition(|t| t.pass == "smooth");
    judge(&others);
    let [Twin { cpu: Data::F32 { values: a, .. }, gpu: Data::F32 { values: b, .. }, .. }] = &smoothed[..]
    else {
        panic!("{smoothed:?}")
    };
    // At the border of a pixel's reach the past is taken or left: by the last bit, there and nowhere else.
    let apart = a.iter().zip(b).filter(|(a, b)| (**a - **b).abs() > 1e-4 * a.abs() + 1e-6).count();
    assert!(a.len() == b.len() && apart <= 4 * 3, "{apart}");
    let history = second.cpu.history.unwrap().irradiance();
    let followed = history.iter().zip(&second.cpu.irradiance).filter(|(a, b)| a != b).count();
    assert!(4 * followed > history.len(), "{followed}");
}

#[test]
fn the_image_does_not_depend_on_the_scale() {
    let Some(context) = testkit::gpu() else { return };
    let image = |s: f32| {
        let mut scene = floor_and_wall(scaled(lights()[0], s), s);
        scene.lights[0].power *= s * s;
        let options = Options { bounces: 2, ..options() };
        frame(context, &scene, s, &setup(&lattice(&scene, 6), options, Params::default())).image
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
            let setup = setup(&lattice(&scene, 4), options, Params::default());
            let frame = frame(context, &scene, 1.0, &setup);
            assert!(frame.image.iter().all(|v| *v == Vec3::ZERO));
        }
    }
}

/// What is not asked for is not allocated: the page's formula, byte for byte, and nothing but it grows.
#[test]
fn the_hints_take_what_the_formula_says() {
    let scene = floor_and_wall(lights()[0], 1.0);
    let lattice = lattice(&scene, 8);
    let bytes =
        |options: Options| Resources::plan(&setup(&lattice, options, Params::default()), CAMERA, 1).bytes();
    for (order, vectors) in [(Order::Two, 3), (Order::Three, 7)] {
        for bounces in [2, 3, 5] {
            let grown =
                bytes(Options { bounces, order, ..options() }) - bytes(Options { order, ..options() });
            let volumes = bounces.min(3) - 1;
            // A volume that is not there still has one element, and so have the surroundings; a number for each bounce.
            let hints = 512 * (16 * vectors * u64::from(volumes) + 20);
            assert_eq!(grown, hints + 4 * u64::from(bounces - 1) - 16 * u64::from(volumes) - 20);
        }
    }
}

/// Limits are said before anything is made, and nothing panics within wgpu where the device lacks them.
#[test]
fn a_device_that_is_too_small_is_refused() {
    let Some(context) = testkit::gpu() else { return };
    let scene = floor_and_wall(lights()[0], 1.0);
    let options = Options { samples: 1024, bounces: 2, bounce_samples: 1024, ..Options::default() };
    let large = setup(&lattice(&scene, 100), options, Params::default());
    let limits = Resources::required_limits(&large, [3840, 2160], 24);
    // 256 words of stops for each of a million hints; more for the samples in the windows.
    assert!(limits.max_storage_buffer_binding_size >= 1_000_000 * 1024, "{limits:?}");
    let default = setup(&lattice(&scene, 16), Options::default(), Params::default());
    let defaults = indirect_gpu::wgpu::Limits::default();
    assert_eq!(Resources::required_limits(&default, [3840, 2160], 24), defaults, "the default settings");
    let target = GBufferTarget::new(&context.device, CAMERA).unwrap();
    let larger = setup(&lattice(&scene, 128), Options { bounces: 1, ..options }, Params::default());
    if context.device.limits().max_storage_buffer_binding_size < 1 << 33 {
        assert!(
            Resources::new(&Pipelines::new(&context.device), &context.queue, &larger, 1, &target).is_err()
        );
    }
}

/// Another number of hints needs other buffers; another place of them does not.
#[test]
fn a_lattice_may_move_but_not_grow() {
    let Some(context) = testkit::gpu() else { return };
    let scene = floor_and_wall(lights()[0], 1.0);
    let target = GBufferTarget::new(&context.device, CAMERA).unwrap();
    let (views, view) = (rsm::views::views(&scene), camera_view(1.0));
    let inputs = Inputs { lights: &scene.lights, views: &views, camera: &view };
    let of = |cells: u32, options| setup(&lattice(&scene, cells), options, Params::default());
    let pipelines = Pipelines::new(&context.device);
    let mut resources =
        Resources::new(&pipelines, &context.queue, &of(4, options()), views.len(), &target).unwrap();
    let mut prepare =
        |setup: &Setup| resources.prepare(&context.queue, &inputs, setup).map_err(|e| e.to_string());
    prepare(&of(4, options())).unwrap();
    let error = prepare(&of(5, options())).unwrap_err();
    assert_eq!(error, "lattice is one of 125 hints, it must be 64 hints, for which the resources were made");
    assert!(prepare(&of(4, Options { bounces: 2, ..options() })).is_err());
    assert!(
        prepare(&Setup { params: Params { jitter: 2.0, ..Params::default() }, ..of(4, options()) }).is_err()
    );
}
