//! What a gather by cuts through a light tree costs and errs, against the flat gather of the same list:
//!
//!     cargo run --release -p rsm --features gpu --example tree -- [FIXTURE] [SIDE]
//!
//! Lists hold three bounces: half of the lights are drawn from the reflective shadow maps, a quarter each are hit by
//! rays from those before. Errors are relative root mean squares over the receivers, times the least of 15 runs.
//! Without `--features gpu`, the CPU alone.

#![allow(clippy::print_stdout, reason = "an example's output")]

#[path = "../tests/common/bounces.rs"]
mod bounces;

use std::error::Error;
use std::time::Instant;

use indirect_accel::{Accel, BuildPreset};
use indirect_scene::{LoadOptions, resolve};
use rsm::cpu::{self, LightTree, Receivers};
use rsm::{Bound, Form};

/// Least milliseconds of some runs, and the result of the last: what other programs take of the machine is not
/// counted.
fn timed<T>(mut run: impl FnMut() -> T) -> (f64, T) {
    let mut result = run();
    let mut least = f64::INFINITY;
    for _ in 0..15 {
        let start = Instant::now();
        result = run();
        least = least.min(start.elapsed().as_secs_f64() * 1e3);
    }
    (least, result)
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "cornell_spot".to_owned());
    let side = arguments.next().map_or(Ok(104), |s| s.parse())?;
    let scene = resolve(&name, &LoadOptions::default())?.scene;
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let maps = cpu::generate(&accel, 512)?;
    let view = scene.cameras.first().ok_or("the scene has no camera")?.view([side; 2]);
    let (positions, normals) = bounces::receivers(&accel, &view, [side; 2]);
    let points: Receivers = positions.iter().copied().zip(normals.iter().copied()).collect();
    println!("{name}: {} receivers, {} threads", points.len(), rayon::current_num_threads());
    println!(
        "{:>7} {:>9} {:>9} {:>8} {:>9} {:>9} {:>8} {:>9} {:>9}",
        "lights", "flat ms", "build ms", "tau", "reach ms", "walk ms", "cut", "RMS %", "all/1k flat"
    );
    let mut unit = f64::NAN;
    for count in [1 << 10, 1 << 12, 1 << 14, 1 << 16] {
        let vpls = bounces::vpls(&accel, &maps, count);
        let (flat, truth) = timed(|| cpu::gather(&vpls, &points, Form::Disc));
        if count == 1 << 10 {
            unit = flat;
        }
        #[cfg(feature = "gpu")]
        gpu::measure(&vpls, &positions, &normals)?;
        let mut tree = LightTree::default();
        let (build, ()) = timed(|| tree.rebuild(&vpls, 0));
        for tau in [0.1, 0.03, 0.01, 0.003, 0.001] {
            let (solve, ()) = timed(|| {
                let threshold = tau * tree.reference_irradiance(&positions, &normals);
                tree.solve_reach(Bound::Error, threshold);
            });
            let (walk, (found, cuts)) =
                timed(|| cpu::traverse(&tree.branches, &positions, &normals, Form::Disc));
            let cut = cuts.iter().map(|c| f64::from(*c)).sum::<f64>() / cuts.len().max(1) as f64;
            let (error, all) = (100.0 * bounces::rel_rmse(&found, &truth), build + solve + walk);
            println!(
                "{:>7} {flat:>9.2} {build:>9.2} {tau:>8} {solve:>9.2} {walk:>9.2} {cut:>8.0} {error:>9.2} {:>9.2}",
                vpls.len(),
                all / unit
            );
        }
    }
    Ok(())
}

#[cfg(feature = "gpu")]
mod gpu {
    use std::error::Error;

    use glam::Vec3;
    use indirect_gpu::wgpu::{CommandEncoderDescriptor, PollType};
    use indirect_gpu::{
        AdapterChoice, Context, GpuError, Pass, PassTimer, Pipelines, Vec3Pad, empty_storage_buffer, named,
        storage_buffer,
    };
    use rsm::Vpl;
    use rsm::gpu::{LightTree, TreeParams, VplList};

    /// Prints milliseconds of the flat gather, of the tree and of its cuts.
    pub(super) fn measure(vpls: &[Vpl], positions: &[Vec3], normals: &[Vec3]) -> Result<(), Box<dyn Error>> {
        let gpu = Context::new(&AdapterChoice::from_env())?;
        let (device, queue, n) = (&gpu.device, &gpu.queue, positions.len() as u64);
        let column = |of: &[Vec3]| {
            let data: Vec<_> = of.iter().map(|v| Vec3Pad::new(*v, 0.0)).collect();
            storage_buffer(device, "receivers", &data)
        };
        let (positions, normals) = (column(positions)?, column(normals)?);
        let irradiance = empty_storage_buffer::<Vec3Pad>(device, "irradiance", n)?;
        let own =
            [named("positions", &positions), named("normals", &normals), named("irradiance", &irradiance)];
        let pipelines = Pipelines::new(device);
        let params = TreeParams { receivers: n as u32, tau: 0.01, ..TreeParams::default() };
        let list = VplList::new(device, vpls.len() as u32)?;
        let tree = LightTree::new(device, vpls.len() as u64, n)?;
        list.prepare(queue, params.receivers, params.form);
        list.write(queue, vpls);
        tree.prepare(queue, &params);
        let passes = {
            let pass = |make: &dyn Fn(&mut Pass) -> Result<(), GpuError>| {
                let mut pass = Pass::new("pass");
                make(&mut pass).map(|()| pass)
            };
            [
                pass(&|p| list.gather(&pipelines, p, n, &own))?,
                pass(&|p| {
                    tree.build(&pipelines, p, &list.buffers.named())?;
                    tree.reference(&pipelines, p, &own)?;
                    tree.solve_reach(&pipelines, p)
                })?,
                pass(&|p| tree.traverse(&pipelines, p, &own))?,
            ]
        };
        let [flat, build, walk] = passes.map(|pass| {
            let run = || {
                let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
                pass.encode(&mut encoder, &mut PassTimer::off(), None);
                queue.submit([encoder.finish()]);
                device.poll(PollType::wait_indefinitely()).is_ok()
            };
            super::timed(run).0
        });
        let (count, tau, name) = (vpls.len(), params.tau, &gpu.info.name);
        println!("{count:>7} {flat:>9.2} {build:>9.2} {tau:>8} {:>9} {walk:>9.2}   {name}", "");
        Ok(())
    }
}
