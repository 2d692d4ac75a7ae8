//! Every pass on the GPU against its twin on the CPU, and the whole chain.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use common::{Stage, corner, lamp, lights, options, view};
use glam::Vec3;
use indirect_core::Scene;
use indirect_gpu::wgpu::CommandEncoderDescriptor;
use indirect_gpu::{Context, GBufferTarget, PassTimer, Pipelines, SceneBuffers, Vec3Pad};
use indirect_technique::gpu::{Inputs, Twin, twins};
use sh_grid_raytracer::gpu::Resources;
use sh_grid_raytracer::{Gather, Options, Output, Params, Reconstruct, Setup, Switch, Traverse, Weights};
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
    let (device, queue) = (&context.device, &context.queue);
    let stage = Stage::new(scene, view(1.0), CAMERA);
    let setup: Setup = stage.setup(options, params);
    let buffers = SceneBuffers::upload(device, scene).unwrap();
    let pipelines = Pipelines::new(device);
    let target = GBufferTarget::new(device, CAMERA).unwrap();
    let mut resources = Resources::new(&pipelines, queue, &setup, 0, &target).unwrap();
    let inputs = Inputs { lights: &scene.lights, views: &[], camera: &stage.view };
    resources.prepare(queue, &inputs, &setup).unwrap();
    target.prepare(queue, &stage.view);
    let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
    let timer = &mut PassTimer::off();
    pipelines.raster().encode(&mut encoder, timer, "camera", &buffers, [&target]);
    resources.encode(&mut encoder, timer, &buffers);
    queue.submit([encoder.finish()]);
    let image: Vec<Vec3Pad> = context.read(resources.image()).unwrap();
    let image = image.iter().map(|v| v.vec3()).collect();
    let twins = twins((device, queue), &stage.frame(&setup), &resources, &buffers).unwrap();
    Frame { twins, cpu: stage.run(&setup), image }
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
