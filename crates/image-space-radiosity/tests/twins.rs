//! Every pass on the GPU against its twin on the CPU.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use common::{corner, light, lights, view};
use glam::Vec3;
use image_space_radiosity::gpu::{ImageSpaceRadiosity, Resources, twins};
use image_space_radiosity::{Bound, Lights, Method, Options, Params, Thresholds, cpu};
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::Scene;
use indirect_gpu::wgpu::CommandEncoderDescriptor;
use indirect_gpu::{Context, GBufferTarget, PassTimer, Raster, SceneBuffers, Vec3Pad};
use rsm::gpu::{Data, Twin};
use rsm::{Form, Selection, views::views};
use testkit::{CompareError, CpuOutput, GpuOutput, Tolerance, compare, compare_exact};

const CAMERA: [u32; 2] = [67, 41];

/// One frame on both backends.
struct Frame {
    twins: Vec<Twin>,
    cpu: cpu::Output,
    /// The image of the whole GPU chain.
    image: Vec<Vec3Pad>,
}

fn frame(context: &Context, scene: &Scene, size: [u32; 2], options: &Options, params: &Params) -> Frame {
    let (device, queue) = (&context.device, &context.queue);
    let accel = Accel::build(scene, BuildPreset::Fast);
    let view = view(1.0);
    let camera = cast::gbuffer(&accel, &view, size);
    let cpu = cpu::indirect(&accel, &camera, &view, options, params).unwrap();

    let buffers = SceneBuffers::upload(device, scene).unwrap();
    let target = GBufferTarget::new(device, size, 1).unwrap();
    let technique = ImageSpaceRadiosity::new(device, options).unwrap();
    let views = views(scene);
    let mut resources = Resources::new(device, &technique, views.len(), &target).unwrap();
    resources.prepare(queue, &scene.lights, &views, &view, params).unwrap();
    let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
    let timer = &mut PassTimer::off();
    Raster::new(device).encode(&mut encoder, timer, &buffers, &view, &target, 0).unwrap();
    technique.encode(&mut encoder, timer, &buffers, &resources).unwrap();
    queue.submit([encoder.finish()]);
    let image = context.read(&resources.image).unwrap();
    let twins = twins((device, queue), &technique, &resources, &camera, &target, &cpu).unwrap();
    Frame { twins, cpu, image }
}

fn assert_twins(frame: &Frame) {
    for twin in &frame.twins {
        let name = format!("{} {}", twin.pass, twin.buffer);
        let result = match (&twin.cpu, &twin.gpu) {
            (Data::F32 { values: a, components }, Data::F32 { values: b, .. }) if !a.is_empty() => {
                // 1e-6 of the buffer's own magnitude where that is below 1: a texel's flux is far below 1 W.
                let largest = a.iter().filter(|v| **v < 1e17).fold(0.0_f32, |m, v| m.max(v.abs()));
                let tolerance = Tolerance { absolute: 1e-6 * largest.clamp(1e-30, 1.0), ..Tolerance::TWINS };
                match components {
                    1 => floats::<1>(&name, a, b, tolerance),
                    2 => floats::<2>(&name, a, b, tolerance),
                    3 => floats::<3>(&name, a, b, tolerance),
                    n => panic!("{name} has {n} components"),
                }
            }
            (Data::U32(a), Data::U32(b)) => {
                compare_exact(&name, CpuOutput(a), GpuOutput(b), None).map(|c| println!("{c}"))
            }
            (a, b) => {
                assert_eq!(a, b, "{name}");
                Ok(())
            }
        };
        result.unwrap_or_else(|e| panic!("{e}"));
    }
}

fn floats<const N: usize>(
    name: &str,
    a: &[f32],
    b: &[f32],
    tolerance: Tolerance,
) -> Result<(), CompareError> {
    let (a, b): (&[[f32; N]], &[[f32; N]]) = (bytemuck::cast_slice(a), bytemuck::cast_slice(b));
    compare(name, CpuOutput(a), GpuOutput(b), tolerance, None).map(|c| println!("{c}"))
}

const HIERARCHICAL: Lights = Lights::Hierarchical { coarsest: 8, finest: 45 };
const BASIC: Lights = Lights::Basic { coarsest: 8, finest: 23 };
const FLAT: Lights = Lights::Flat(Selection::Grid { cells: 9 });

fn settings() -> Vec<(Lights, Method)> {
    vec![
        (HIERARCHICAL, Method::Gather),
        (BASIC, Method::Gather),
        (FLAT, Method::Gather),
        (Lights::Flat(Selection::All), Method::Gather),
        (Lights::Flat(Selection::Importance { count: 1500 }), Method::Gather),
        (FLAT, Method::Splat),
        (FLAT, Method::BoundedSplat),
        (BASIC, Method::BoundedSplat),
    ]
}

fn options(lights: Lights, method: Method) -> Options {
    // Neither a power of two nor a multiple of a workgroup.
    Options { resolution: 45, lights, method, coarsest_block: 4 }
}

#[test]
fn every_pass_agrees_for_every_light_and_method() {
    let Some(context) = testkit::gpu() else { return };
    for (i, kind) in lights().into_iter().enumerate() {
        for (k, (list, method)) in settings().into_iter().enumerate() {
            // The lists do not depend on the kind of light: one kind each.
            if k < 2 || k % 3 == i {
                let frame =
                    frame(context, &corner(kind, 1.0), CAMERA, &options(list, method), &Params::default());
                assert_twins(&frame);
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
        form: Form::Point,
        seed: 3,
        blocks: Thresholds { depth: 0.3, normal: 0.1 },
        margin: 0.0,
        bend: 1.0,
        patches: Thresholds { depth: 0.05, normal: 0.1 },
        tau: 0.1,
        bound: Bound::ContributionAsPrinted,
        cutoff: 0.3,
    };
    for (list, method) in
        [(HIERARCHICAL, Method::Gather), (BASIC, Method::Gather), (FLAT, Method::BoundedSplat)]
    {
        assert_twins(&frame(context, &scene, CAMERA, &options(list, method), &params));
    }
}

#[test]
fn any_size_agrees() {
    let Some(context) = testkit::gpu() else { return };
    for size in [[1, 1], [1, 7], [97, 3], [128, 64]] {
        for (list, method) in
            [(HIERARCHICAL, Method::Gather), (FLAT, Method::Splat), (FLAT, Method::BoundedSplat)]
        {
            let scene = corner(lights()[0], 1.0);
            assert_twins(&frame(context, &scene, size, &options(list, method), &Params::default()));
        }
    }
}

/// Two maps of 1024² have more branches than one storage binding of any device holds.
#[test]
fn a_tree_in_parts_agrees() {
    let Some(context) = testkit::gpu() else { return };
    let mut scene = corner(lights()[0], 1.0);
    scene.lights.push(light(lights()[2], Vec3::new(0.5, 1.0, 4.0)));
    let options = Options { resolution: 1024, ..options(HIERARCHICAL, Method::Gather) };
    assert_twins(&frame(context, &scene, [33, 21], &options, &Params::default()));
}

/// The test device has WebGPU's default limits: 128 MiB in a storage binding.
#[test]
fn default_limits_suffice_for_4k_and_for_twelve_maps() {
    let Some(context) = testkit::gpu() else { return };
    let device = &context.device;
    assert_eq!(device.limits().max_storage_buffer_binding_size, 128 << 20);
    for (size, resolution, maps) in [([3840, 2160], 256, 6), ([1920, 1200], 256, 24), ([64, 64], 512, 12)] {
        let target = GBufferTarget::new(device, size, 1).unwrap();
        let options = Options { resolution, ..Options::default() };
        let technique = ImageSpaceRadiosity::new(device, &options).unwrap();
        assert!(Resources::new(device, &technique, maps, &target).is_ok(), "{size:?} {resolution} {maps}");
    }
}

#[test]
fn a_perturbed_buffer_is_found() {
    let Some(context) = testkit::gpu() else { return };
    let options = options(HIERARCHICAL, Method::Gather);
    let mut frame = frame(context, &corner(lights()[0], 1.0), CAMERA, &options, &Params::default());
    assert_twins(&frame);
    for i in 0..frame.twins.len() {
        let good = frame.twins[i].gpu.clone();
        match &mut frame.twins[i].gpu {
            // The largest value, so that the change is beyond the tolerance whatever the buffer holds.
            Data::F32 { values, .. } => {
                let largest = values.iter_mut().max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap();
                *largest = if *largest == 0.0 { 1.0 } else { *largest * 1.001 };
            }
            Data::U32(values) => *values.last_mut().unwrap() ^= 1,
        }
        let found = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| assert_twins(&frame)));
        assert!(found.is_err(), "{} {}", frame.twins[i].pass, frame.twins[i].buffer);
        frame.twins[i].gpu = good;
    }
}

#[test]
fn the_whole_chain_gives_the_same_image() {
    let Some(context) = testkit::gpu() else { return };
    for (list, method) in settings() {
        let frame =
            frame(context, &corner(lights()[0], 1.0), CAMERA, &options(list, method), &Params::default());
        let mean: Vec3 = frame.image.iter().map(|v| v.vec3()).sum::<Vec3>() / frame.image.len() as f32;
        let expected = frame.cpu.image.mean();
        // Silhouettes, a texel in a hundred or fewer of 45², carry their flux elsewhere.
        let error = (mean - expected).abs().max_element() / expected.max_element();
        println!("{list:?} {method:?}: {error:.1e}");
        assert!(error < 1e-2, "{list:?} {method:?}: {mean} {expected}");
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
        for (list, method) in settings() {
            let frame = frame(context, &scene, CAMERA, &options(list, method), &Params::default());
            assert!(frame.image.iter().all(|v| *v == Vec3Pad::default()), "{list:?} {method:?}");
        }
    }
}
