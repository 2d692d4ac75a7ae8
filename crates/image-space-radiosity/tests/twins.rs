//! Every pass on the GPU against its twin on the CPU.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use common::{corner, light, lights, view};
use glam::Vec3;
use image_space_radiosity::gpu::{Inputs, Resources};
use image_space_radiosity::{
    Bound, ImageSpaceRadiosity, Lights, Method, Options, Output, Params, Select, Setup, Visibility, cpu,
};
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::Scene;
use indirect_gpu::wgpu::CommandEncoderDescriptor;
use indirect_gpu::{Context, GBufferTarget, PassTimer, Pipelines, SceneBuffers, Vec3Pad};
use indirect_technique::cpu::Fit;
use indirect_technique::gpu::{Backend, Twin, run_both};
use rsm::{Form, MAP_PASSES, views::views};
use testkit::{judge, perturb};

const CAMERA: [u32; 2] = [67, 41];

/// One frame on both backends.
struct Frame {
    twins: Vec<Twin>,
    cpu: Output,
    /// The image of the whole GPU chain.
    image: Vec<Vec3Pad>,
    /// With the maps and the fragments from the GPU and all else from the CPU.
    mixed: Output,
}

fn frame(context: &Context, scene: &Scene, size: [u32; 2], setup: &Setup) -> Frame {
    let (device, queue) = (&context.device, &context.queue);
    let accel = Accel::build(scene, BuildPreset::Fast);
    let view = view(1.0);
    let camera = cast::gbuffer(&accel, &view, size);
    let setup = &ImageSpaceRadiosity::fit(&accel, setup.options, setup.params).unwrap();
    let frame = common::frame(&accel, &view, &camera, setup);

    let buffers = SceneBuffers::upload(device, scene).unwrap();
    let target = GBufferTarget::new(device, size).unwrap();
    let pipelines = Pipelines::new(device);
    let views = views(scene);
    let mut resources = Resources::new(&pipelines, queue, setup, views.len(), &target).unwrap();
    let inputs = Inputs { lights: &scene.lights, views: &views, camera: &view };
    resources.prepare(queue, &inputs, setup).unwrap();
    target.prepare(queue, &view);
    let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
    let timer = &mut PassTimer::off();
    pipelines.raster().encode(&mut encoder, timer, "camera", &buffers, [&target]);
    resources.encode(&mut encoder, timer, &buffers);
    queue.submit([encoder.finish()]);
    let image = context.read(resources.image()).unwrap();
    let run = |keep: &dyn Fn(&str) -> Backend| run_both((device, queue), &frame, &resources, &buffers, keep);
    let (cpu, twins) = run(&|_| Backend::Cpu).unwrap();
    let gpu = |pass: &str| MAP_PASSES.contains(&pass) || pass == "compact";
    let (mixed, _) = run(&|pass| if gpu(pass) { Backend::Gpu } else { Backend::Cpu }).unwrap();
    assert_eq!(cpu, cpu::indirect(&frame).unwrap());
    Frame { twins, cpu, image, mixed }
}

/// Neither a power of two nor a multiple of a workgroup.
fn options(lights: Lights, method: Method) -> Options {
    let finest = if lights == Lights::Basic { 23 } else { 45 };
    let o = Options { resolution: 45, lights, coarsest: 8, finest, ..Options::default() };
    Options { cells: 9, vpls: 1500, block: 4, method, ..o }
}

fn default_of(lights: Lights, method: Method) -> Setup {
    Setup { options: options(lights, method), ..Setup::default() }
}

/// The same with shadow maps.
fn shadowed(lights: Lights) -> Setup {
    let options =
        Options { visibility: Visibility::Maps, shadow_cells: 12, ..options(lights, Method::Gather) };
    let options = Options { points: 5000, points_per_map: 700, tile: 16, ..options };
    Setup { options, ..Setup::default() }
}

fn setups() -> Vec<Setup> {
    let flat = |select| {
        let options = Options { select, ..options(Lights::Flat, Method::Gather) };
        Setup { options, ..Setup::default() }
    };
    vec![
        default_of(Lights::Hierarchical, Method::Gather),
        default_of(Lights::Basic, Method::Gather),
        flat(Select::Grid),
        flat(Select::All),
        flat(Select::Importance),
        default_of(Lights::Flat, Method::Splat),
        default_of(Lights::Flat, Method::BoundedSplat),
        default_of(Lights::Basic, Method::BoundedSplat),
        shadowed(Lights::Hierarchical),
        shadowed(Lights::Basic),
        shadowed(Lights::Flat),
    ]
}

#[test]
fn every_pass_agrees_for_every_light_and_method() {
    let Some(context) = testkit::gpu() else { return };
    for (i, kind) in lights().into_iter().enumerate() {
        for (k, setup) in setups().iter().enumerate() {
            // The lists do not depend on the kind of light: one kind each.
            if k < 2 || k % 3 == i {
                judge(&frame(context, &corner(kind, 1.0), CAMERA, setup).twins);
            }
        }
    }
}

#[test]
fn several_lights_and_other_parameters_agree() {
    let Some(context) = testkit::gpu() else { return };
    let mut scene = corner(lights()[0], 1.0);
    for kind in lights() {
        scene.lights.push(light(kind, Vec3::new(0.5, 1.0, 4.0)));
    }
    let params = Params {
        tau: 0.1,
        bound: Bound::ContributionAsPrinted,
        patch_depth: 0.05,
        patch_normal: 0.1,
        depth: 0.3,
        normal: 0.1,
        margin: 0.0,
        bend: 1.0,
        cutoff: 0.3,
        form: Form::Point,
        seed: 3,
    };
    for (lights, method) in [
        (Lights::Hierarchical, Method::Gather),
        (Lights::Basic, Method::Gather),
        (Lights::Flat, Method::BoundedSplat),
    ] {
        judge(
            &frame(
                context,
                &scene,
                CAMERA,
                &Setup { options: options(lights, method), params, ..Setup::default() },
            )
            .twins,
        );
    }
}

#[test]
fn any_size_agrees() {
    let Some(context) = testkit::gpu() else { return };
    for size in [[1, 1], [1, 7], [97, 3], [128, 64]] {
        for (lights, method) in [
            (Lights::Hierarchical, Method::Gather),
            (Lights::Flat, Method::Splat),
            (Lights::Flat, Method::BoundedSplat),
        ] {
            let scene = corner(common::lights()[0], 1.0);
            judge(&frame(context, &scene, size, &default_of(lights, method)).twins);
        }
    }
}

/// Two maps of 1024² have more branches than one storage binding of any device holds.
#[test]
fn a_tree_in_parts_agrees() {
    let Some(context) = testkit::gpu() else { return };
    let mut scene = corner(lights()[0], 1.0);
    scene.lights.push(light(lights()[2], Vec3::new(0.5, 1.0, 4.0)));
    let mut setup = default_of(Lights::Hierarchical, Method::Gather);
    (setup.options.resolution, setup.options.finest) = (1024, 1024);
    judge(&frame(context, &scene, [33, 21], &setup).twins);
}

/// The test device has WebGPU's default limits: 128 MiB in a storage binding.
#[test]
fn default_limits_suffice_for_4k_and_for_twelve_maps() {
    let Some(context) = testkit::gpu() else { return };
    let device = &context.device;
    assert_eq!(device.limits().max_storage_buffer_binding_size, 128 << 20);
    let pipelines = Pipelines::new(device);
    for (size, resolution, maps) in [([3840, 2160], 256, 6), ([64, 64], 512, 12)] {
        let options = Options { resolution, ..Options::default() };
        let setup = Setup { options, ..Setup::default() };
        let target = GBufferTarget::new(device, size).unwrap();
        let resources = Resources::new(&pipelines, &context.queue, &setup, maps, &target);
        assert!(resources.is_ok(), "{size:?} {resolution} {maps}");
    }
}

#[test]
fn a_perturbed_buffer_is_found() {
    let Some(context) = testkit::gpu() else { return };
    let setup = default_of(Lights::Hierarchical, Method::Gather);
    let mut frame = frame(context, &corner(lights()[0], 1.0), CAMERA, &setup);
    judge(&frame.twins);
    for i in 0..frame.twins.len() {
        let good = frame.twins[i].gpu.clone();
        perturb(&mut frame.twins[i]);
        let found = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| judge(&frame.twins)));
        assert!(found.is_err(), "{} {}", frame.twins[i].pass, frame.twins[i].buffer);
        frame.twins[i].gpu = good;
    }
}

#[test]
fn the_whole_chain_gives_the_same_image() {
    let Some(context) = testkit::gpu() else { return };
    for setup in setups() {
        let frame = frame(context, &corner(lights()[0], 1.0), CAMERA, &setup);
        let mean: Vec3 = frame.image.iter().map(|v| v.vec3()).sum::<Vec3>() / frame.image.len() as f32;
        let expected = frame.cpu.image.mean();
        // Silhouettes, a texel in a hundred or fewer of 45², carry their flux elsewhere.
        for mean in [mean, frame.mixed.image.mean()] {
            let error = (mean - expected).abs().max_element() / expected.max_element();
            println!("{setup:?}: {error:.1e}");
            assert!(error < 1e-2, "{setup:?}: {mean} {expected}");
        }
    }
}

#[test]
fn a_scene_without_light_or_surface_is_black() {
    let Some(context) = testkit::gpu() else { return };
    let mut dark = corner(lights()[0], 1.0);
    dark.lights.clear();
    let mut black = corner(lights()[0], 1.0);
    black.materials[0].base_color = Vec3::ZERO;
    let mut empty = corner(lights()[0], 1.0);
    empty.mesh = indirect_core::Mesh::default();
    for scene in [dark, black, empty] {
        for setup in setups() {
            let frame = frame(context, &scene, CAMERA, &setup);
            assert!(frame.image.iter().all(|v| *v == Vec3Pad::default()), "{setup:?}");
        }
    }
}
