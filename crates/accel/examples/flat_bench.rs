//! Measures the flat tree and prints one JSON object: million rays per second of the CPU's [`Accel`], of the flat tree on the CPU (both
//! on one thread), and of the GPU's kernels.
//!
//! `flat_bench [--scene NAME] [--size N] [--repeats N] [--preset Fast|Balanced|Best]`: `primary` rays go through the pixels of the
//! fixture's first camera, `diffuse` ones leave what those hit. Medians of `--repeats`. The CPU's times are
//! its thread's running time; the GPU's are wall time from submission to the end of the work, without uploads and read-back. `INDIRECT_ADAPTER` names another adapter.
#![allow(clippy::print_stdout, reason = "a command-line tool")]

use std::time::{Duration, Instant};

use glam::Vec2;
use indirect_accel::gpu::{AccelBuffers, HitUniform, Rays};
use indirect_accel::{Accel, BuildPreset, FlatTree};
use indirect_core::Ray;
use indirect_core::math::{offset_ray_origin_scaled, orthonormal_basis};
use indirect_gpu::{AdapterChoice, Context, Pass, PassTimer, Pipelines, SceneBuffers, wgpu};

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let mut options = std::env::args().skip(1);
    let (mut name, mut size, mut repeats, mut preset) = ("atrium".to_owned(), 512, 5, BuildPreset::Best);
    while let Some(option) = options.next() {
        let value = options.next().ok_or(format!("{option} needs a value"))?;
        match option.as_str() {
            "--scene" => name = value,
            "--size" => size = value.parse::<u32>()?.max(1),
            "--repeats" => repeats = value.parse::<usize>()?.max(1),
            "--preset" => {
                preset = match value.as_str() {
                    "Fast" => BuildPreset::Fast,
                    "Balanced" => BuildPreset::Balanced,
                    "Best" => BuildPreset::Best,
                    _ => return Err(format!("no preset is called {value}").into()),
                }
            }
            _ => return Err(format!("unknown option {option}").into()),
        }
    }
    let scene = indirect_scene::fixtures::build(&name).ok_or(format!("no fixture is called {name}"))?;
    let camera = scene.cameras.first().ok_or(format!("{name} has no camera"))?;
    let view = camera.view([size, size]);
    let pixel = |i: u32| Vec2::new((i % size) as f32 + 0.5, (i / size) as f32 + 0.5);
    let primary: Vec<Ray> =
        (0..size * size).map(|i| Ray { t_max: f32::INFINITY, ..view.ray(pixel(i), [size; 2]) }).collect();

    let start = Instant::now();
    let accel = Accel::build(&scene, preset);
    let build = start.elapsed().as_secs_f64() * 1e3;
    let start = Instant::now();
    let mut tree = FlatTree::of(&accel);
    let flatten = start.elapsed().as_secs_f64() * 1e3;
    let start = Instant::now();
    tree.refit(&scene)?;
    let refit = start.elapsed().as_secs_f64() * 1e3;
    let tree = FlatTree::of(&accel);
    let diffuse = bounce(&accel, &primary);

    let gpu = Context::new(&AdapterChoice::from_env())?;
    let (device, queue) = (&gpu.device, &gpu.queue);
    let pipelines = Pipelines::new(device);
    let buffers = AccelBuffers::upload(device, queue, &tree)?;
    let masked = tree.is_masked();
    let uploaded = if masked { Some(SceneBuffers::upload(device, &scene)?) } else { None };
    let solid = |t, u, v| scene.is_solid(t, u, v);

    let mut rows = Vec::new();
    for (kind, rays) in [("primary", &primary), ("diffuse", &diffuse)] {
        let count = rays.len() as u32;
        let room = Rays::new(device, count)?;
        room.write(queue, rays);
        let (mut closest, mut any) = (Pass::new("closest"), Pass::new("any"));
        room.cast_closest(&pipelines, &mut closest, &buffers, masked)?;
        room.cast_any(&pipelines, &mut any, &buffers, masked)?;
        let run = |pass: &Pass| {
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            pass.encode(&mut encoder, &mut PassTimer::off(), uploaded.as_ref());
            queue.submit([encoder.finish()]);
            // An error is a lost device, which the read-back reports.
            let _ = device.poll(wgpu::PollType::wait_indefinitely());
        };
        let speed = |clock: fn() -> Duration, f: &dyn Fn()| {
            f();
            let mut times: Vec<f64> = (0..repeats)
                .map(|_| {
                    let start = clock();
                    f();
                    clock().saturating_sub(start).as_secs_f64()
                })
                .collect();
            times.sort_by(f64::total_cmp);
            rays.len() as f64 * 1e-6 / times[repeats / 2]
        };
        let over = |f: &dyn Fn(&Ray) -> bool| {
            speed(busy, &|| {
                std::hint::black_box(rays.iter().filter(|r| f(r)).count());
            })
        };
        let wide = [over(&|r| accel.closest_hit(r).is_some()), over(&|r| accel.any_hit(r))];
        let flat = [over(&|r| tree.closest_hit(r, solid).is_some()), over(&|r| tree.any_hit(r, solid))];
        let shader = [speed(elapsed, &|| run(&closest)), speed(elapsed, &|| run(&any))];

        let found = room.read_hits(device, queue, count)?;
        let rounds: Vec<usize> = rays.iter().map(|r| tree.closest_hit_counted(r, solid).1).collect();
        let (mut same, mut unfinished) = (0, 0);
        for (ray, hit) in rays.iter().zip(&found) {
            let triangle = |h: Option<indirect_core::Hit>| h.map(|h| h.triangle);
            same += usize::from(triangle(hit.hit()) == triangle(tree.closest_hit(ray, solid)));
            unfinished += usize::from(hit.triangle == HitUniform::UNFINISHED);
        }
        let text = |[c, a]: [f64; 2]| format!("{{\"closest\": {c:.3}, \"any\": {a:.3}}}");
        rows.push(format!(
            "{{\"rays\": \"{kind}\", \"count\": {count}, \"accel\": {}, \"flat\": {}, \"gpu\": {}, \
             \"same_triangle\": {same}, \"unfinished\": {unfinished}, \"rounds_mean\": {:.1}, \"rounds_max\": {}}}",
            text(wide),
            text(flat),
            text(shader),
            rounds.iter().sum::<usize>() as f64 / rounds.len().max(1) as f64,
            rounds.iter().max().unwrap_or(&0),
        ));
    }
    println!(
        "{{\"scene\": \"{name}\", \"adapter\": \"{}\", \"triangles\": {}, \"nodes\": {}, \"leaf_triangles\": {}, \
         \"bytes\": {}, \"depth\": {}, \"build_ms\": {build:.1}, \"flatten_ms\": {flatten:.1}, \"refit_ms\": {refit:.1}, \
         \"mrays_per_second\": [\n  {}\n]}}",
        gpu.describe(),
        scene.mesh.triangles.len(),
        tree.nodes().len(),
        tree.triangles().len(),
        tree.bytes(),
        tree.depth(),
        rows.join(",\n  ")
    );
    Ok(())
}

/// Wall time.
fn elapsed() -> Duration {
    static START: std::sync::LazyLock<Instant> = std::sync::LazyLock::new(Instant::now);
    START.elapsed()
}

/// Time that this thread has been running: what a busy machine does not disturb. Wall time where the system does not tell.
fn busy() -> Duration {
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|text| text.split(' ').next()?.parse().ok())
        .map_or_else(elapsed, Duration::from_nanos)
}

/// One cosine-distributed ray from every point that `rays` hit.
fn bounce(accel: &Accel<'_>, rays: &[Ray]) -> Vec<Ray> {
    let mut state = 1_u32;
    let mut uniform = move || {
        // Any full-period generator serves: only the spread of the directions matters.
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / 16_777_216.0
    };
    let bounced = |ray: &Ray| {
        let hit = accel.closest_hit(ray)?;
        let surface = accel.scene().surface(hit.triangle, hit.u, hit.v);
        let n = surface.facing(-ray.direction).0;
        let (t, b) = orthonormal_basis(n);
        let (r, phi) = (uniform().sqrt(), core::f32::consts::TAU * uniform());
        let direction = t * (r * phi.cos()) + b * (r * phi.sin()) + n * (1.0 - r * r).sqrt();
        Some(Ray::new(offset_ray_origin_scaled(surface.position, n, accel.unit()), direction))
    };
    rays.iter().filter_map(bounced).collect()
}
