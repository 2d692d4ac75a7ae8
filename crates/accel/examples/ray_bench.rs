//! Measures ray throughput and prints one JSON object.
//!
//! `ray_bench [--scene NAME] [--size N] [--repeats N] [--dump DIR]`: million rays per second of every build preset and
//! of the two trees of `obvhs` on one thread (medians of `--repeats`), and what a second thread gains. `--scene` names a
//! fixture; `primary` rays go through the pixels of its first camera, `diffuse` ones leave what those hit.
//!
//! `--dump` writes the geometry and the rays as raw little-endian f32, so that another tracer can be measured on the
//! same input: `triangles.f32` (9 per triangle), and `primary.f32` and `diffuse.f32` (origin and direction, 6 per ray).
#![allow(clippy::print_stdout, reason = "a command-line tool")]

use std::path::Path;
use std::time::{Duration, Instant};

use glam::{Vec2, Vec3, Vec3A};
use indirect_accel::{Accel, BuildPreset};
use indirect_core::math::{offset_ray_origin_scaled, orthonormal_basis};
use indirect_core::{Ray, Scene};
use obvhs::BvhBuildParams;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray as ObvhsRay, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;

fn main() -> Result<(), String> {
    let mut options = std::env::args().skip(1);
    let (mut name, mut size, mut repeats, mut dump) = ("atrium".to_owned(), 1024, 5, None);
    while let Some(option) = options.next() {
        let value = options.next().ok_or(format!("{option} needs a value"))?;
        let number = || value.parse::<u32>().map_err(|e| format!("{option} {value}: {e}"));
        match option.as_str() {
            "--scene" => name = value,
            "--size" => size = number()?,
            "--repeats" => repeats = number()? as usize,
            "--dump" => dump = Some(value),
            _ => return Err(format!("unknown option {option}")),
        }
    }
    let scene = indirect_scene::fixtures::build(&name).ok_or(format!("no fixture is called {name}"))?;
    let camera = scene.cameras.first().ok_or(format!("{name} has no camera"))?;
    let view = camera.view([size, size]);
    let pixel = |i: u32| Vec2::new((i % size) as f32 + 0.5, (i / size) as f32 + 0.5);
    let primary: Vec<Ray> =
        (0..size * size).map(|i| Ray { t_max: f32::INFINITY, ..view.ray(pixel(i), [size; 2]) }).collect();
    let best = Accel::build(&scene, BuildPreset::Best);
    let diffuse = bounce(&best, &primary);
    if let Some(folder) = dump {
        write_raw(Path::new(&folder), &scene, &primary, &diffuse).map_err(|e| format!("{folder}: {e}"))?;
    }

    let mut rows = Vec::new();
    for (label, preset) in
        [("Fast", BuildPreset::Fast), ("Balanced", BuildPreset::Balanced), ("Best", BuildPreset::Best)]
    {
        let build = Instant::now();
        let accel = Accel::build(&scene, preset);
        let build = build.elapsed();
        let closest = |r: &Ray| accel.closest_hit(r).is_some();
        let any = |r: &Ray| accel.any_hit(r);
        rows.push(row(label, build, repeats, &primary, &diffuse, closest, any));
    }
    rows.extend(obvhs_rows(&scene, repeats, &primary, &diffuse));

    println!(
        "{{\"scene\": \"{name}\", \"triangles\": {}, \"bytes\": {}, \"speedup_two_threads\": {:.2}, \
         \"mrays_per_second\": [\n  {}\n]}}",
        scene.mesh.triangles.len(),
        best.bytes(),
        speedup(&best, repeats, &diffuse),
        rows.join(",\n  ")
    );
    Ok(())
}

/// How much faster two threads share the rays than one alone: running time of the one over the longer of the two.
fn speedup(accel: &Accel<'_>, repeats: usize, rays: &[Ray]) -> f64 {
    let time = |rays: &[Ray]| {
        let start = busy();
        for _ in 0..repeats.max(1) {
            for ray in rays {
                std::hint::black_box(accel.closest_hit(ray));
            }
        }
        (busy() - start).as_secs_f64()
    };
    let (a, b) = rays.split_at(rays.len() / 2);
    let alone = time(a) + time(b);
    std::thread::scope(|scope| {
        let other = scope.spawn(|| time(b));
        let longer = time(a).max(other.join().unwrap_or(f64::INFINITY));
        alone / longer
    })
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

/// Time that this thread has been running: what a busy machine does not disturb. Wall time where the system does not tell.
fn busy() -> Duration {
    static START: std::sync::LazyLock<Instant> = std::sync::LazyLock::new(Instant::now);
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|text| text.split(' ').next()?.parse().ok())
        .map_or_else(|| START.elapsed(), Duration::from_nanos)
}

/// Median million rays per second and the number of hits of `f`.
fn median(repeats: usize, rays: usize, f: impl Fn() -> usize) -> (f64, usize) {
    let mut hits = f();
    let mut times: Vec<Duration> = (0..repeats.max(1))
        .map(|_| {
            let start = busy();
            hits = f();
            busy().saturating_sub(start)
        })
        .collect();
    times.sort();
    (rays as f64 * 1e-6 / times[times.len() / 2].as_secs_f64(), hits)
}

fn row(
    label: &str,
    build: Duration,
    repeats: usize,
    primary: &[Ray],
    diffuse: &[Ray],
    closest: impl Fn(&Ray) -> bool,
    any: impl Fn(&Ray) -> bool,
) -> String {
    let mut text = format!("{{\"tree\": \"{label}\", \"build_ms\": {:.1}", build.as_secs_f64() * 1e3);
    for (key, rays) in [("primary", primary), ("diffuse", diffuse)] {
        let (c, hits) = median(repeats, rays.len(), || rays.iter().filter(|r| closest(r)).count());
        let (a, any_hits) = median(repeats, rays.len(), || rays.iter().filter(|r| any(r)).count());
        text += &format!(
            ", \"{key}_closest\": {c:.3}, \"{key}_any\": {a:.3}, \"{key}_hits\": [{hits}, {any_hits}, {}]",
            rays.len()
        );
    }
    text + "}"
}

/// The same for the trees and the triangle test that `obvhs` brings.
fn obvhs_rows(scene: &Scene, repeats: usize, primary: &[Ray], diffuse: &[Ray]) -> Vec<String> {
    let triangles: Vec<Triangle> = (0..scene.mesh.triangles.len() as u32)
        .map(|i| scene.mesh.corners(i).map(Vec3A::from))
        .map(|[v0, v1, v2]| Triangle { v0, v1, v2 })
        .collect();
    let ray = |r: &Ray| ObvhsRay::new(r.origin.into(), r.direction.into(), 0.0, r.t_max);
    let best = BvhBuildParams::very_slow_build();
    let packed = |indices: &[u32]| -> Vec<RtTriangle> {
        indices.iter().map(|&i| RtTriangle::from(&triangles[i as usize])).collect()
    };

    let start = Instant::now();
    let bvh = build_bvh2_from_tris(&triangles, best, &mut Duration::default());
    let build = start.elapsed();
    let leaves = packed(&bvh.primitive_indices);
    let closest = |r: &Ray| bvh.ray_traverse(ray(r), &mut RayHit::none(), |r, i| leaves[i].intersect(r));
    let any = |r: &Ray| !bvh.ray_traverse_miss(ray(r), |r, i| leaves[i].intersect(r));
    let binary = row("obvhs Bvh2", build, repeats, primary, diffuse, closest, any);

    let start = Instant::now();
    let bvh = build_cwbvh_from_tris(&triangles, best, &mut Duration::default());
    let build = start.elapsed();
    let leaves = packed(&bvh.primitive_indices);
    let closest = |r: &Ray| bvh.ray_traverse(ray(r), &mut RayHit::none(), |r, i| leaves[i].intersect(r));
    let any = |r: &Ray| !bvh.ray_traverse_miss(ray(r), |r, i| leaves[i].intersect(r));
    let wide = row("obvhs CwBvh", build, repeats, primary, diffuse, closest, any);
    vec![binary, wide]
}

fn write_raw(folder: &Path, scene: &Scene, primary: &[Ray], diffuse: &[Ray]) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    let write = |name: &str, vectors: &mut dyn Iterator<Item = Vec3>| {
        let bytes: Vec<u8> = vectors.flat_map(|v| v.to_array()).flat_map(f32::to_le_bytes).collect();
        std::fs::write(folder.join(name), bytes)
    };
    let triangles = 0..scene.mesh.triangles.len() as u32;
    write("triangles.f32", &mut triangles.flat_map(|i| scene.mesh.corners(i)))?;
    write("primary.f32", &mut primary.iter().flat_map(|r| [r.origin, r.direction]))?;
    write("diffuse.f32", &mut diffuse.iter().flat_map(|r| [r.origin, r.direction]))
}
