//! What it costs to move a part of a scene: all of it uploaded anew, the vertices that moved, or one matrix. CPU until the submission's
//! work is done, milliseconds, medians of 20.
//!
//!     cargo run --release -p indirect-gpu --example moving

#![allow(clippy::print_stdout, reason = "an example's output")]

use std::error::Error;
use std::time::Instant;

use glam::{Affine3A, Vec3};
use indirect_core::{Material, Scene};
use indirect_gpu::wgpu::{CommandEncoderDescriptor, PollType};
use indirect_gpu::{AdapterChoice, Context, MovingObjects, PassTimer, Pipelines, SceneBuffers};

/// Squares along each side of the scene: two triangles and four vertices each.
const SIDE: u32 = 316;

/// Squares that move.
const MOVED: u32 = 500;

fn main() -> Result<(), Box<dyn Error>> {
    let context = Context::new(&AdapterChoice::from_env())?;
    let (device, queue) = (&context.device, &context.queue);
    let mut scene = Scene { materials: vec![Material::diffuse("", Vec3::splat(0.5))], ..Scene::default() };
    for i in 0..SIDE * SIDE {
        let at = Vec3::new((i % SIDE) as f32, 0.0, (i / SIDE) as f32);
        scene.mesh.push_polygon(&[at, at + Vec3::Z, at + Vec3::X + Vec3::Z, at + Vec3::X], 0);
    }
    let pipelines = Pipelines::new(device);
    let buffers = SceneBuffers::upload(device, &scene)?;
    let objects =
        MovingObjects::new(&pipelines, &buffers, &scene.mesh, &[0..2 * MOVED, 2 * MOVED..4 * MOVED])?;
    let time = |work: &dyn Fn() -> Result<(), Box<dyn Error>>| -> Result<f64, Box<dyn Error>> {
        let mut times = Vec::new();
        for _ in 0..20 {
            let start = Instant::now();
            work()?;
            queue.submit([]);
            device.poll(PollType::wait_indefinitely())?;
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
        times.sort_by(f64::total_cmp);
        Ok(times[10])
    };
    let whole = time(&|| {
        SceneBuffers::upload(device, &scene)?;
        Ok(())
    })?;
    let part = time(&|| Ok(buffers.update(queue, &scene.mesh, 0..4 * MOVED)?))?;
    let posed = time(&|| {
        for i in 0..2 {
            objects.prepare(queue, i, &Affine3A::from_translation(Vec3::Y))?;
        }
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        objects.encode(&mut encoder, &mut PassTimer::off());
        queue.submit([encoder.finish()]);
        Ok(())
    })?;
    println!("{}\n{} triangles, of which {} move", context.describe(), scene.mesh.triangles.len(), 2 * MOVED);
    println!("upload {whole:.2} ms, update {part:.2} ms, two matrices {posed:.2} ms");
    Ok(())
}
