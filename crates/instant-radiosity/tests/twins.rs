//! Every pass on the GPU against its twin on the CPU, and the whole chain.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use common::{Stage, corner, lamp, lights, options, still, view};
use glam::Vec3;
use indirect_core::{Scene, View};
use indirect_gpu::wgpu::CommandEncoderDescriptor;
use indirect_gpu::{Context, GBufferTarget, PassTimer, Pipelines, SceneBuffers, Vec3Pad};
use indirect_technique::gpu::{Backend, Inputs, Twin, run_both_after};
use instant_radiosity::gpu::Resources;
use instant_radiosity::{
    Bounce, Gather, InstantRadiosity, Options, Output, Params, Sequence, Setup, Switch, Visibility,
};
use testkit::{judge, perturb};

/// Neither a power of two nor a multiple of a workgroup or of a block.
const CAMERA: [u32; 2] = [67, 41];

struct Frame {
    twins: Vec<Twin>,
    cpu: Output,
    /// The image of the whole GPU chain.
    image: Vec<Vec3>,
}

/// One frame on both backends, after another whose CPU output is `past`.
fn frame_after(context: &Context, scene: &Scene, view: View, setup: &Setup, past: Output) -> Frame {
    let (device, queue) = (&context.device, &context.queue);
    let stage = Stage::new(scene, view, CAMERA);
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
    let run = |past| {
        run_both_after((device, queue), &stage.frame(setup), &resources, &buffers, |_| Backend::Cpu, past)
            .unwrap()
    };
    let (cpu, twins) = run(past);
    Frame { twins, cpu, image }
}

fn setup(scene: &Scene, options: Options, params: Params) -> Setup {
    Stage::new(scene, view(1.0), [1, 1]).setup(options, params)
}

fn frame(context: &Context, scene: &Scene, setup: &Setup) -> Frame {
    frame_after(context, scene, view(1.0), setup, Output::default())
}

fn cuts(options: Options) -> Options {
    Options { gather: Gather::Cuts, ..options }
}

#[test]
fn every_pass_agrees_for_every_light_and_option() {
    let Some(context) = testkit::gpu() else { return };
    let scenes = [corner(lights()[0], 1.0), corner(lights()[1], 1.0), corner(lights()[2], 1.0), lamp(1.0)];
    let mut mixed = lamp(1.0);
    mixed.lights.push(common::light(lights()[0]));
    let params = Params { seed: 7, ..Params::default() };
    let cases = [
        (&scenes[0], options(), params),
        (&scenes[1], Options { bounces: 2, compensate: Switch::Off, tail: Switch::Off, ..options() }, params),
        (
            &scenes[2],
            Options { interleave: 3, shadow_rays: 0, sequence: Sequence::Halton, ..options() },
            params,
        ),
        (&scenes[3], Options { interleave: 2, ..options() }, params),
        (&mixed, options(), Params { bound: 3.0, ..params }),
        (&scenes[0], still(Options { visibility: Visibility::Off, bounces: 1, ..options() }), params),
        (
            &scenes[0],
            Options { visibility: Visibility::Maps, points: 4096, points_per_map: 512, ..options() },
            params,
        ),
        (
            &scenes[1],
            Options { bounce: Bounce::Points, points: 4096, points_per_map: 128, ..options() },
            params,
        ),
        (
            &scenes[0],
            Options { bounce: Bounce::Brightest, points: 4096, points_per_map: 64, ..options() },
            params,
        ),
        (&scenes[0], Options { interleave: 1, vpls: 300, bounces: 1, shadow_rays: 0, ..options() }, params),
        (&scenes[0], cuts(options()), params),
        (
            &mixed,
            Options { compensate: Switch::Off, bounces: 1, ..cuts(options()) },
            Params { tau: 0.1, ..params },
        ),
        (
            &scenes[1],
            Options { visibility: Visibility::Maps, points: 4096, points_per_map: 512, ..cuts(options()) },
            Params { tau: 0.03, ..params },
        ),
        (&scenes[2], still(Options { visibility: Visibility::Off, vpls: 1024, ..cuts(options()) }), params),
    ];
    for (i, (scene, options, params)) in cases.into_iter().enumerate() {
        let frame = frame(context, scene, &setup(scene, options, params));
        println!("case {i}");
        judge(&frame.twins);
        let expected = frame.cpu.image.mean();
        let mean = frame.image.iter().sum::<Vec3>() / frame.image.len() as f32;
        println!("case {i}: {mean} {expected}");
        // Silhouette texels of the maps move a virtual light or two of 64.
        assert!((mean - expected).abs().max_element() < 0.05 * expected.max_element(), "{mean} {expected}");
    }
}

/// Software renderers end long loops: what would be wrong there is refused.
#[test]
fn cuts_whose_lights_are_all_tested_by_rays_are_refused() {
    let Some(context) = testkit::gpu() else { return };
    let scene = corner(lights()[0], 1.0);
    let views = rsm::views::views(&scene);
    let view = view(1.0);
    let inputs = Inputs { lights: &scene.lights, views: &views, camera: &view };
    let pipelines = Pipelines::new(&context.device);
    let target = GBufferTarget::new(&context.device, CAMERA).unwrap();
    for (shadow_rays, refused) in [(0, true), (1, false), (64, false), (65, true)] {
        let setup = setup(&scene, Options { shadow_rays, ..cuts(options()) }, Params::default());
        let mut resources = Resources::new(&pipelines, &context.queue, &setup, views.len(), &target).unwrap();
        let result = resources.prepare(&context.queue, &inputs, &setup);
        assert_eq!(result.is_err(), refused, "{shadow_rays}");
        if let Err(e) = result {
            assert!(e.to_string().contains("shadow-rays"), "{e}");
        }
    }
}

#[test]
fn a_frame_that_looks_back_agrees() {
    let Some(context) = testkit::gpu() else { return };
    let scene = corner(lights()[0], 1.0);
    let setup = setup(&scene, options(), Params::default());
    let first = frame(context, &scene, &setup);
    let moved = View { origin: view(1.0).origin + Vec3::X * 0.02, ..view(1.0) };
    let second = frame_after(context, &scene, moved, &setup, first.cpu);
    judge(&second.twins);
    let h = second.cpu.history.unwrap();
    let reused = h.normals.iter().filter(|n| n.w > 1.0).count();
    assert!(reused * 10 > h.normals.len() * 5, "{reused}");
}

#[test]
fn objects_that_moved_agree() {
    let Some(context) = testkit::gpu() else { return };
    let scene = corner(lights()[0], 1.0);
    let options = Options { motion: Switch::On, ..options() };
    let mut setup = setup(&scene, options, Params::default());
    let first = frame(context, &scene, &setup);
    let mut moved = scene.clone();
    // The small square, whose vertices are the last four.
    moved.mesh.positions.iter_mut().rev().take(4).for_each(|p| p.x += 0.05);
    let stage = Stage::new(&moved, view(1.0), [1, 1]);
    <InstantRadiosity as indirect_technique::cpu::Fit>::refit(&mut setup, &stage.accel);
    let second = frame_after(context, &moved, view(1.0), &setup, first.cpu);
    judge(&second.twins);
    assert!(second.cpu.before.len() == second.cpu.gathered.len());
}

#[test]
fn a_perturbed_buffer_is_found() {
    let Some(context) = testkit::gpu() else { return };
    let mut scene = lamp(1.0);
    scene.lights.push(common::light(lights()[0]));
    for options in [options(), cuts(options())] {
        let setup = setup(&scene, Options { bounces: 2, ..options }, Params::default());
        let mut frame = frame(context, &scene, &setup);
        judge(&frame.twins);
        for i in 0..frame.twins.len() {
            let good = frame.twins[i].gpu.clone();
            perturb(&mut frame.twins[i]);
            let found = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| judge(&frame.twins)));
            assert!(found.is_err(), "{} {}", frame.twins[i].pass, frame.twins[i].buffer);
            frame.twins[i].gpu = good;
        }
    }
}

/// The page's formula: 80 bytes a pixel with a history; lights, maps and the scene beside.
#[test]
fn memory_is_what_the_page_says() {
    let scene = indirect_scene::fixtures::build("cornell_spot").unwrap();
    let stage = Stage::new(&scene, scene.cameras[0].view([1, 1]), [1, 1]);
    let bytes = |options: Options, size| {
        Resources::plan(&stage.setup(options, Params::default()), size, 1).bytes() as f64
    };
    let all = bytes(Options::default(), [1920, 1080]);
    let per_pixel = (all - bytes(Options::default(), [960, 540])) / (1920.0 * 1080.0 * 0.75);
    println!("{:.1} MB at 1920×1080, {per_pixel} bytes a pixel", all / 1e6);
    assert!((per_pixel - 80.0).abs() < 0.1, "{per_pixel}");
    let alone = bytes(still(Options::default()), [1920, 1080]);
    println!("{:.1} MB without history", alone / 1e6);
    let maps =
        bytes(Options { visibility: Visibility::Maps, bounces: 1, ..Options::default() }, [1920, 1080]);
    println!("{:.1} MB with shadow maps of 1024 lights", maps / 1e6);
}

/// The test device has WebGPU's default limits: 128 MiB in a storage binding.
#[test]
fn default_limits_suffice_for_4k() {
    let Some(context) = testkit::gpu() else { return };
    let scene = corner(lights()[0], 1.0);
    let setup = setup(&scene, Options { vpls: 1024, ..Options::default() }, Params::default());
    let pipelines = Pipelines::new(&context.device);
    for maps in [1, 12] {
        let target = GBufferTarget::new(&context.device, [3840, 2160]).unwrap();
        assert!(Resources::new(&pipelines, &context.queue, &setup, maps, &target).is_ok(), "{maps}");
    }
}
