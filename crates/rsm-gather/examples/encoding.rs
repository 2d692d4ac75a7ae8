//! What a frame costs the CPU on the GPU's side, for 1, 6 and 24 maps: `prepare`, `encode`, and wgpu's own `finish` and `submit` of what
//! was encoded. Medians of 200 frames.
//!
//!     cargo run --release -p rsm-gather --all-features --example encoding

#![allow(clippy::print_stdout, reason = "an example's output")]

use std::error::Error;
use std::time::Instant;

use glam::Vec3;
use indirect_core::{LightKind, Scene};
use indirect_gpu::wgpu::{CommandEncoderDescriptor, PollType};
use indirect_gpu::{AdapterChoice, Context, GBufferTarget, PassTimer, Pipelines, SceneBuffers};
use rsm::views::views;
use rsm_gather::gpu::{Inputs, Resources};
use rsm_gather::{Options, Setup};
use testkit::scenes;

const FRAMES: usize = 200;

/// A spot light is one map, a point light six.
fn scene(points: u32) -> Scene {
    let mut scene = scenes::corner(scenes::lights()[0], 1.0);
    if points > 0 {
        scene.lights.clear();
    }
    for i in 0..points {
        let position = Vec3::new(0.3 + 0.1 * i as f32, 1.5, 0.2);
        scene.lights.push(scenes::light(LightKind::Point { position }));
    }
    scene
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn main() -> Result<(), Box<dyn Error>> {
    let context = Context::new(&AdapterChoice::from_env())?;
    let (device, queue) = (&context.device, &context.queue);
    let pipelines = Pipelines::new(device);
    println!("{}\nmaps  prepare  encode  finish  submit  (µs of CPU a frame)", context.describe());
    for points in [0, 1, 4] {
        let scene = scene(points);
        let views = views(&scene);
        let setup =
            Setup { options: Options { resolution: 32, vpls: 64, ..Options::default() }, ..Setup::default() };
        let buffers = SceneBuffers::upload(device, &scene)?;
        let camera = GBufferTarget::new(device, [32, 32])?;
        let view = scenes::view(1.0);
        camera.prepare(queue, &view);
        let mut resources = Resources::new(&pipelines, queue, &setup, views.len(), &camera)?;
        let mut times = [(); 4].map(|()| Vec::new());
        for _ in 0..FRAMES {
            let mut last = Instant::now();
            let mut lap = |i: usize| {
                times[i].push(last.elapsed().as_secs_f64() * 1e6);
                last = Instant::now();
            };
            let inputs = Inputs { lights: &scene.lights, views: &views, camera: &view };
            resources.prepare(queue, &inputs, &setup)?;
            lap(0);
            let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
            lap(1);
            resources.encode(&mut encoder, &mut PassTimer::off(), &buffers);
            lap(1);
            let commands = encoder.finish();
            lap(2);
            queue.submit([commands]);
            lap(3);
            device.poll(PollType::wait_indefinitely())?;
        }
        // The encoder's own creation is every other entry.
        let encode = times[1].iter().skip(1).step_by(2).copied().collect();
        let [prepare, _, finish, submit] = times;
        let row = [prepare, encode, finish, submit].map(median);
        println!("{:4} {:8.0} {:7.0} {:7.0} {:7.0}", views.len(), row[0], row[1], row[2], row[3]);
    }
    Ok(())
}
