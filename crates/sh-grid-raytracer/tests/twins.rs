//! Every pass on the GPU against its twin on the CPU, and the whole chain.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use common::{Stage, corner, lamp, lights, options, view};
use glam::Vec3;
use indirect_core::Scene;
use indirect_gpu::wgpu::CommandEncoderDescriptor;
use indirect_gpu::{Context, GBufferTarget, PassTimer, Pipelines, SceneBuffers, Vec3Pad};
use indirect_technique::cpu::Fit;
use indirect_technique::gpu::{Inputs, Twin, twins};
use sh_grid_raytracer::gpu::Resources;
use sh_grid_raytracer::{
    Error, Gather, Options, Output, Params, Reconstruct, Setup, ShGridRaytracer, Switch, Traverse, Weights,
};
use testkit::judge;

/// Neither a power of two nor a multiple of a workgroup.
const CAMERA: [u32; 2] = [67, 41];

struct Frame {
    twins: Vec<Twin>,
    cpu: Output,
    /// The image of the whole GPU chain.
    image: Vec<Vec3>,
}

fn frame(context: &Context, scene: &Scene, options: Options, params: Params) -> Frame {
    let setup = Stage::new(scene, view(1.0), [1, 1]).setup(options, params);
    frame_after(context, scene, &setup, &setup)
}

/// A frame with buffers that were made for `first`.
fn frame_after(context: &Context, scene: &Scene, first: &Setup, setup: &Setup) -> Frame {
    let (device, queue) = (&context.device, &context.queue);
    let stage = Stage::new(scene, view(1.0), CAMERA);
    let buffers = SceneBuffers::upload(device, scene).unwrap();
    let pipelines = Pipelines::new(device);
    let target = GBufferTarget::new(device, CAMERA).unwrap();
    let mut resources = Resources::new(&pipelines, queue, first, 0, &target).unwrap();
    let inputs = Inputs { lights: &scene.lights, views: &[], camera: &stage.view };
    resources.prepare(queue, &inputs, setup).unwrap();
    target.prepare(queue, &stage.view);
    let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
    let timer = &mut PassTimer::off();
    pipelines.raster().encode(&mut encoder, timer, "camera", &buffers, [&target]);
    resources.encode(&mut encoder, timer, &buffers);
    queue.submit([encoder.finish()]);
    let image: Vec<Vec3Pad> = context.read(resources.image()).unwrap();
    let image = image.iter().map(|v| v.vec3()).collect();
    let twins = twins((device, queue), &stage.frame(setup), &resources, &buffers).unwrap();
    Frame { twins, cpu: stage.run(setup), image }
}

#[test]
fn every_pass_agrees_for_every_light_and_option() {
    let Some(context) = testkit::gpu() else { return };
    let scenes = [corner(lights()[0], 1.0), corner(lights()[1], 1.0), corner(lights()[2], 1.0), lamp(1.0)];
    let base = options();
    let params = Params { seed: 7, ..Params::default() };
    let cases = [
        (&scenes[0], base),
        (&scenes[1], Options { traverse: Traverse::Voxels, weights: Weights::Side, ..base }),
        (&scenes[2], Options { gather: Gather::Samples, order: 4, obscurance: Switch::On, ..base }),
        (&scenes[3], Options { gather: Gather::Final, ..base }),
        (&scenes[0], Options { gather: Gather::Final, open_points: 0, ..base }),
        (
            &scenes[0],
            Options {
                reconstruct: Reconstruct::AsPrinted,
                footprint: Switch::On,
                turned: Switch::Off,
                traverse: Traverse::Voxels,
                weights: Weights::AsPrinted,
                order: 2,
                ..base
            },
        ),
        (&scenes[3], Options { footprint: Switch::On, grid: 7, directions: 200, ..base }),
        (&scenes[0], Options { grid: 1, ..base }),
    ];
    for (i, (scene, options)) in cases.into_iter().enumerate() {
        let frame = frame(context, scene, options, params);
        println!("case {i}");
        judge(&frame.twins);
        let expected = frame.cpu.image.mean();
        let mean = frame.image.iter().sum::<Vec3>() / frame.image.len() as f32;
        println!("case {i}: {mean} {expected}");
        // Means over 2747 pixels of light from cells that hundreds of photons make: one photon in 4096 that decides otherwise moves them by
        // about its share.
        assert!((mean - expected).length() < 3e-3 * expected.length(), "{mean} {expected}");
    }
}

/// The scene with its small square, whose four vertices are the last, moved.
fn moved(scene: &Scene, by: Vec3) -> Scene {
    let mut scene = scene.clone();
    scene.mesh.positions.iter_mut().rev().take(4).for_each(|p| *p += by);
    scene
}

/// Buffers follow a scene that moves: both sides then compute it as it is now.
#[test]
fn what_moved_is_seen_where_it_is() {
    let Some(context) = testkit::gpu() else { return };
    let before = corner(lights()[0], 1.0);
    let after = moved(&before, Vec3::new(-0.6, 0.3, 0.4));
    for traverse in [Traverse::Rays, Traverse::Voxels] {
        let first = Stage::new(&before, view(1.0), [1, 1])
            .setup(Options { traverse, ..options() }, Params::default());
        let mut setup = first.clone();
        ShGridRaytracer::refit(&mut setup, &Stage::new(&after, view(1.0), [1, 1]).accel);
        assert_ne!(setup.fitted.voxels, first.fitted.voxels);
        let frame = frame_after(context, &after, &first, &setup);
        judge(&frame.twins);
        let mean = |image: &[Vec3]| image.iter().sum::<Vec3>() / image.len() as f32;
        let (found, expected) = (mean(&frame.image), mean(&frame.cpu.image.pixels));
        // As above: one photon that decides otherwise.
        assert!((found - expected).length() < 3e-3 * expected.length(), "{found} {expected}");
        // A fault: buffers that do not follow give another picture.
        let still = Stage::new(&before, view(1.0), CAMERA).run(&first);
        let stale = mean(&still.image.pixels);
        assert!((stale - expected).length() > 3e-3 * expected.length(), "{stale} {expected} passed");
    }
}

/// A scene that comes to fill more cells than there is room for is refused, and says so.
#[test]
fn more_cells_than_there_is_room_for_are_refused() {
    let Some(context) = testkit::gpu() else { return };
    let mut small = corner(lights()[0], 1.0);
    // Sixteen squares that lie in one another, and then apart.
    for _ in 0..16 {
        common::square(&mut small, Vec3::new(0.0, 2.0, 0.0), Vec3::X, Vec3::Y, 1.8, 1);
    }
    let mut large = small.clone();
    let first = large.mesh.positions.len() - 64;
    for (i, p) in large.mesh.positions[first..].iter_mut().enumerate() {
        p.z += -1.9 + 0.24 * (i / 4) as f32;
    }
    let options = Options { grid: 16, open_points: 0, ..options() };
    let setup = Stage::new(&small, view(1.0), [1, 1]).setup(options, Params::default());
    let mut grown = setup.clone();
    ShGridRaytracer::refit(&mut grown, &Stage::new(&large, view(1.0), [1, 1]).accel);
    let pipelines = Pipelines::new(&context.device);
    let target = GBufferTarget::new(&context.device, CAMERA).unwrap();
    let mut resources = Resources::new(&pipelines, &context.queue, &setup, 0, &target).unwrap();
    let view = view(1.0);
    let inputs = Inputs { lights: &large.lights, views: &[], camera: &view };
    assert!(resources.prepare(&context.queue, &inputs, &setup).is_ok());
    assert!(resources.prepare(&context.queue, &inputs, &grown).is_err());
    let error = resources.prepare(&context.queue, &inputs, &grown).unwrap_err();
    assert!(
        matches!(error, Error::Capacity { .. }) && error.to_string().contains("make new resources"),
        "{error}"
    );
}
