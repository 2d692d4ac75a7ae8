//! The figures of the README: error against the path tracer, time by stage, equal time, memory; on the CPU.
//!
//!     cargo run --release -p sh-grid-raytracer --example figures -- [error|bounces|stages|gather|time|memory|wall]… [FIXTURE|FILE.glb] [WIDTHxHEIGHT]
//!
//! Without a word all of them. Errors are relative RMS errors of the luminance over what the camera sees.

#![allow(clippy::print_stdout, reason = "an example's output")]

use std::error::Error;
use std::time::Instant;

use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::settings::Settings as _;
use indirect_core::{GBuffer, Image, Scene, View, math::luminance};
use indirect_metrics::{Reference, compare};
use indirect_scene::fixtures;
use indirect_technique::cpu::{Fit, run, run_without};
use reference_pathtracer::{Bounces, Components, Samples, Settings, render};
use sh_grid_raytracer::cpu::Frame;
use sh_grid_raytracer::{FIELD_PASSES, Options, Output, Params, Setup, ShGridRaytracer};

type Outcome<T = ()> = Result<T, Box<dyn Error>>;

type Part = fn(&Stage<'_>) -> Outcome;

/// Milliseconds by pass.
type Times = Vec<(&'static str, f64)>;

/// A scene, its camera, and what it sees.
struct Stage<'a> {
    accel: Accel<'a>,
    view: View,
    camera: GBuffer,
    seen: Vec<bool>,
}

/// The path tracer's image and its relative standard error, RMS over the pixels.
struct Truth {
    image: Image,
    noise: f64,
}

impl<'a> Stage<'a> {
    fn new(scene: &'a Scene, size: [u32; 2]) -> Self {
        let accel = Accel::build(scene, BuildPreset::Best);
        let view = scene.cameras[0].view(size);
        let camera = cast::gbuffer(&accel, &view, size);
        let seen = (0..camera.len()).map(|i| camera.is_surface(i)).collect();
        Self { accel, view, camera, seen }
    }

    fn truth(&self, bounces: Bounces, samples: u32) -> Outcome<Truth> {
        let settings = Self::traced_settings(bounces, samples, 9);
        let found = render(&self.accel, &self.view, self.camera.size, &settings)?;
        // One number stands for the noise of all channels.
        let noise = (0..self.camera.len()).filter(|i| self.seen[*i]);
        let count = noise.clone().count().max(1) as f64;
        let [mut variance, mut mean] = [0.0, 0.0];
        for i in noise {
            variance += f64::from(luminance(found.indirect_variance.pixels[i])) / count;
            mean += f64::from(luminance(found.indirect.pixels[i])) / count;
        }
        Ok(Truth { image: found.indirect, noise: variance.sqrt() / mean.max(f64::MIN_POSITIVE) })
    }

    fn traced_settings(bounces: Bounces, samples: u32, seed: u32) -> Settings {
        let samples = Samples::count(samples);
        Settings { components: Components::Indirect, bounces, samples, seed, ..Settings::default() }
    }

    /// The path tracer's image and its time, s.
    fn traced(&self, bounces: Bounces, samples: u32, seed: u32) -> Outcome<(Image, f64)> {
        let settings = Self::traced_settings(bounces, samples, seed);
        let start = Instant::now();
        let image = render(&self.accel, &self.view, self.camera.size, &settings)?.indirect;
        Ok((image, start.elapsed().as_secs_f64()))
    }

    fn setup(&self, pairs: &str) -> Outcome<Setup> {
        let (mut options, mut params) = (Options::default(), Params::default());
        for (key, value) in pairs.split_whitespace().filter_map(|p| p.split_once('=')) {
            if Options::key(key).is_some() { options.set(key, value) } else { params.set(key, value) }?;
        }
        Ok(ShGridRaytracer::fit(&self.accel, options, params)?)
    }

    /// A frame, the times of its passes and of the fit, ms.
    fn frame(&self, pairs: &str) -> Outcome<(Setup, Output, Times)> {
        let start = Instant::now();
        let setup = self.setup(pairs)?;
        let mut times = vec![("voxelise", start.elapsed().as_secs_f64() * 1e3)];
        let mut output = Output::default();
        let passes =
            run::<ShGridRaytracer>(&Frame::new(&self.accel, &self.view, &self.camera, &setup), &mut output);
        times.extend(passes.iter().map(|p| (p.name, p.ms)));
        Ok((setup, output, times))
    }

    /// `rel_rmse`, from which the truth's own noise is taken off, and `bias`, %, and FLIP.
    fn judge(&self, image: &Image, truth: &Truth) -> Outcome<[f64; 3]> {
        let found = compare(image, &Reference::exact(&truth.image, &self.seen))?;
        let rms = (found.luminance.rel_rmse.powi(2) - truth.noise.powi(2)).max(0.0).sqrt();
        Ok([rms * 100.0, found.luminance.bias * 100.0, found.flip])
    }

    /// Pixels that lie within two texels of another surface that touches theirs: corners.
    fn corners(&self) -> Vec<bool> {
        let [width, height] = self.camera.size;
        let meets = |i: u32| {
            let (x, y) = (i % width, i / width);
            let (p, n) = (self.camera.position[i as usize], self.camera.normal[i as usize]);
            let near = |qx: u32, qy: u32| {
                let q = (qy * width + qx) as usize;
                let step = self.camera.depth[i as usize] * 0.03;
                self.camera.is_surface(q)
                    && self.camera.normal[q].dot(n) < 0.7
                    && self.camera.position[q].distance(p) < step
            };
            let range = |c: u32, n: u32| c.saturating_sub(2)..(c + 3).min(n);
            range(y, height).any(|qy| range(x, width).any(|qx| near(qx, qy)))
        };
        (0..width * height).map(|i| self.seen[i as usize] && meets(i)).collect()
    }

    /// Relative RMS error over pixels of a mask, %.
    fn over(image: &Image, truth: &Image, mask: &[bool]) -> f64 {
        let pairs = || image.pixels.iter().zip(&truth.pixels).zip(mask).filter(|(_, m)| **m).map(|(p, _)| p);
        let value = |p: &glam::Vec3| f64::from(luminance(*p));
        let error: f64 = pairs().map(|(a, b)| (value(a) - value(b)).powi(2)).sum();
        let (sum, n) = pairs().fold((0.0, 0.0), |(s, n), (_, b)| (s + value(b), n + 1.0_f64));
        100.0 * (error / n).sqrt() / (sum / n)
    }
}

/// Error against the truth by settings.
fn error(stage: &Stage<'_>) -> Outcome {
    println!(
        "error against all indirect light: settings, rel_rmse % / bias % / FLIP, corners' rel_rmse %; s, build and pixels"
    );
    let truth = stage.truth(Bounces::Infinite, 512)?;
    let corners = stage.corners();
    for pairs in [
        "",
        "grid=16",
        "grid=24",
        "grid=48",
        "grid=64",
        "photons=65536",
        "photons=1048576",
        "directions=100",
        "directions=200",
        "directions=1600",
        "turned=off",
        "order=2",
        "order=4",
        "traverse=voxels",
        "open-points=0",
        "least-area=0",
        "footprint=on",
        "weights=side",
        "weights=as-printed",
        "gather=samples",
        "gather=final",
        "gather=final samples=256",
        "bounces=5",
        "reconstruct=as-printed",
        "reconstruct=as-printed weights=as-printed traverse=voxels footprint=on open-points=0 bounces=5 turned=off gather=samples",
    ] {
        let (_, output, times) = stage.frame(pairs)?;
        let [rms, bias, flip] = stage.judge(&output.image, &truth)?;
        let corner = Stage::over(&output.image, &truth.image, &corners);
        let of = |pixels: bool| -> f64 {
            times.iter().filter(|t| (t.0 == "gather" || t.0 == "shade") == pixels).map(|t| t.1).sum()
        };
        println!(
            "  {:<26} {rms:>5.1} {bias:>+5.1} {flip:.3} {corner:>6.1}   {:>5.2} {:>6.3}",
            if pairs.is_empty() { "defaults" } else { pairs },
            of(false) / 1e3,
            of(true) / 1e3,
        );
    }
    Ok(())
}

/// Photons of 1, 2 and 5 reflections against references of equal bounces.
fn bounces(stage: &Stage<'_>) -> Outcome {
    println!(
        "bounces, against the path tracer of as many: rel_rmse % / bias %, and bias % against all light"
    );
    let all = stage.truth(Bounces::Infinite, 512)?;
    for count in [1, 2, 5, 16] {
        let truth = stage.truth(Bounces::Count(count), 512)?;
        let (_, output, _) = stage.frame(&format!("bounces={count}"))?;
        let [rms, bias, _] = stage.judge(&output.image, &truth)?;
        let [_, of_all, _] = stage.judge(&output.image, &all)?;
        println!("  {count:>2} {rms:>5.1} {bias:>+5.1} {of_all:>+6.1}");
    }
    Ok(())
}

/// The paper's table 1, and what the most crowded cell costs.
fn stages(stage: &Stage<'_>) -> Outcome {
    for pairs in ["", "grid=64", "traverse=voxels"] {
        let (setup, output, times) = stage.frame(pairs)?;
        let total: f64 = times.iter().map(|t| t.1).sum();
        let voxels = &setup.fitted.voxels;
        println!(
            "stages [{pairs}]: {} triangles, {} boundary cells of {}, {} active, {} photons stored, {total:.0} ms",
            stage.accel.scene().mesh.triangles.len(),
            voxels.boundary,
            voxels.index.len(),
            voxels.cells.len(),
            output.stored.len(),
        );
        for (name, ms) in &times {
            println!("  {name:<10} {ms:>8.1} ms {:>5.1} %", 100.0 * ms / total);
        }
        let mut counts = vec![0_u32; voxels.boundary as usize];
        output.stored.iter().for_each(|p| counts[p.cell as usize] += 1);
        let runs = sh_grid_raytracer::cpu::runs(&output.stored, &output.order).len();
        println!(
            "  the most crowded cell has {} photons, {:.1} % of all; {runs} runs of at most {}",
            counts.iter().max().unwrap_or(&0),
            100.0 * f64::from(*counts.iter().max().unwrap_or(&0)) / output.stored.len().max(1) as f64,
            sh_grid_raytracer::cpu::RUN,
        );
    }
    Ok(())
}

/// Closed form against samples: time of the pixels, and their difference from closed form.
fn gather(stage: &Stage<'_>) -> Outcome {
    println!("gather: ms, and relative RMS difference from closed form, %");
    let (setup, closed, _) = stage.frame("")?;
    for pairs in
        ["", "gather=samples samples=8", "gather=samples", "gather=samples samples=128", "weights=side"]
    {
        let other = stage.setup(pairs)?;
        let frame = Frame::new(&stage.accel, &stage.view, &stage.camera, &setup);
        let mut output = closed.clone();
        let mut times: Vec<f64> = (0..9)
            .map(|_| {
                let frame = Frame { setup: &other, ..frame };
                let start = Instant::now();
                run_without::<ShGridRaytracer>(&frame, &mut output, |name| FIELD_PASSES.contains(&name));
                start.elapsed().as_secs_f64() * 1e3
            })
            .collect();
        times.sort_by(f64::total_cmp);
        let noise = Stage::over(&output.image, &closed.image, &stage.seen);
        println!("  {:<28} {:>6.1} {noise:>5.2}", if pairs.is_empty() { "closed" } else { pairs }, times[4]);
    }
    Ok(())
}

/// The path tracer, plain and filtered, in as long as a frame takes.
fn time(stage: &Stage<'_>) -> Outcome {
    // As many paths whatever the size of the image.
    let pixels = stage.camera.len() as u32;
    let truth = stage.truth(Bounces::Infinite, (1024 * 192 * 108 / pixels.max(1)).max(64))?;
    println!(
        "equal time: seconds, rel_rmse % / bias % / FLIP; the truth's own noise, {:.1} %, is taken off",
        truth.noise * 100.0
    );
    let say = |name: &str, seconds: f64, image: &Image| -> Outcome {
        let [rms, bias, flip] = stage.judge(image, &truth)?;
        println!("  {name:<34} {seconds:>7.3} {rms:>6.1} {bias:>+5.1} {flip:.3}");
        Ok(())
    };
    let mut build = 0.0;
    for pairs in ["grid=16 directions=200", "", "gather=final", "grid=48 directions=800"] {
        let (setup, mut output, times) = stage.frame(pairs)?;
        let seconds = times.iter().map(|t| t.1).sum::<f64>() / 1e3;
        say(
            &format!("all passes, {}", if pairs.is_empty() { "defaults" } else { pairs }),
            seconds,
            &output.image,
        )?;
        if pairs.is_empty() {
            build = seconds;
            let frame = Frame::new(&stage.accel, &stage.view, &stage.camera, &setup);
            let start = Instant::now();
            run_without::<ShGridRaytracer>(&frame, &mut output, |name| FIELD_PASSES.contains(&name));
            say("a frame of a flight, defaults", start.elapsed().as_secs_f64(), &output.image)?;
        }
    }
    let (_, one) = stage.traced(Bounces::Infinite, 8, 77)?;
    for factor in [1.0 / 16.0, 0.25, 1.0, 4.0, 16.0] {
        let samples = ((build * factor / one * 8.0).round() as u32).max(1);
        let (image, seconds) = stage.traced(Bounces::Infinite, samples, 77)?;
        say(&format!("path tracer, {samples} a pixel"), seconds, &image)?;
        for rounds in [1, 2, 3] {
            let start = Instant::now();
            let filtered = filtered(&image, &stage.camera, rounds);
            let name = format!("  filtered over {0}×{0} pixels", (4 << rounds) - 3);
            say(&name, seconds + start.elapsed().as_secs_f64(), &filtered)?;
        }
    }
    Ok(())
}

/// An edge-avoiding à-trous filter of the irradiance (Dammertz et al. 2010): rounds of 5×5 pixels, guided by planes and normals.
fn filtered(image: &Image, camera: &GBuffer, rounds: u32) -> Image {
    let [width, height] = camera.size.map(i64::from);
    let albedo = |i: usize| camera.albedo[i].max(glam::Vec3::splat(1e-3));
    let mut now: Vec<_> = image.pixels.iter().enumerate().map(|(i, p)| *p / albedo(i)).collect();
    let kernel = [1.0 / 16.0, 0.25, 0.375, 0.25, 1.0 / 16.0];
    for round in 0..rounds {
        let step = 1_i64 << round;
        let past = now.clone();
        for (i, out) in now.iter_mut().enumerate().filter(|(i, _)| camera.is_surface(*i)) {
            let (x, y) = (i as i64 % width, i as i64 / width);
            let (p, n, depth) = (camera.position[i], camera.normal[i], camera.depth[i]);
            let (mut sum, mut total) = (glam::Vec3::ZERO, 0.0);
            for k in 0..25_i64 {
                let (qx, qy) = (x + (k % 5 - 2) * step, y + (k / 5 - 2) * step);
                let q = (qy * width + qx) as usize;
                if qx < 0 || qy < 0 || qx >= width || qy >= height || !camera.is_surface(q) {
                    continue;
                }
                let plane = (camera.position[q] - p).dot(n).abs() / (0.01 * depth);
                let weight = kernel[(k % 5) as usize]
                    * kernel[(k / 5) as usize]
                    * (-plane).exp()
                    * camera.normal[q].dot(n).max(0.0).powi(32);
                sum += past[q] * weight;
                total += weight;
            }
            *out = sum / total;
        }
    }
    let pixels = now.iter().enumerate().map(|(i, e)| *e * albedo(i));
    Image { size: image.size, pixels: pixels.collect() }
}

/// Memory of the grids.
fn memory(stage: &Stage<'_>) -> Outcome {
    println!(
        "memory: fine cells along the longest side, boundary cells, MiB of the grids, of the V-grid as a cube of normals"
    );
    for grid in [8, 16, 32, 64, 128] {
        let setup = stage.setup(&format!("grid={grid} photons=1"))?;
        let voxels = &setup.fitted.voxels;
        let mib = |bytes: usize| bytes as f64 / f64::from(1 << 20);
        let cube = 64 * voxels.index.len() * 4;
        println!("  {:>3} {:>8} {:>7.1} {:>7.1}", 4 * grid, voxels.boundary, mib(voxels.bytes()), mib(cube));
    }
    Ok(())
}

/// The wall test of the errata: radiance read from the R-grid over that of a Lambertian wall, by slope and view.
fn wall(_: &Stage<'_>) -> Outcome {
    println!(
        "a wall of known radiance, read from afar: least, mean and largest ratio over 200 views, by its normal"
    );
    for n in
        [[0.0, 0.0, 1.0], [0.0, 0.5, 0.866], [0.0, 0.707, 0.707], [0.577, 0.577, 0.577], [0.27, 0.53, 0.80]]
    {
        let n = glam::Vec3::from_array(n).normalize();
        let found = [false, true].map(|printed| wall_ratios(n, printed));
        let [area, printed] = found.map(|r| {
            let mean = r.iter().sum::<f32>() / r.len() as f32;
            let [least, most] = r.iter().fold([f32::MAX, 0.0], |[l, m], x| [l.min(*x), f32::max(m, *x)]);
            format!("{least:.3} {mean:.3} {most:.3}")
        });
        println!("  {n:.2}   area {area}   as printed {printed}");
    }
    Ok(())
}

fn wall_ratios(n: glam::Vec3, printed: bool) -> Vec<f32> {
    use glam::{Vec2, Vec3};
    use indirect_sampling::{mapping::hemisphere_cosine, sobol};
    use sh_grid_raytracer::cpu::{Look, Lookup, levels, radiance, sort};
    use sh_grid_raytracer::layout::StoredPhoton;
    use sh_grid_raytracer::{Grid, Openness, Pyramid, Voxeliser, spiral};

    let (t, b) = indirect_core::math::orthonormal_basis(n);
    let mut scene = Scene { materials: vec![indirect_core::Material::default()], ..Scene::default() };
    scene.mesh.push_polygon(&[-t - b, t - b, t + b, -t + b], 0);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let bounds = scene.bounds().map_or(Grid::default(), |bounds| Grid::around(&bounds, 8));
    let voxels = Voxeliser::new(&accel, bounds, Openness { points: 0, reach: 0.0 }).voxels();
    let pyramid = Pyramid::over(&voxels);
    // The wall's radiosity is 1: its flux is its area.
    let count = 1 << 19;
    let photon = |i: u32| {
        let u: Vec2 = sobol::sample_2d(i, 1) * 2.0 - 1.0;
        let w = hemisphere_cosine(sobol::sample_2d(i, 2));
        let p = t * u.x + b * u.y;
        let axis = if printed { t * w.x + b * w.y + n * w.z } else { n };
        let cell = voxels.boundary_at(voxels.grid.local(p)).unwrap_or(u32::MAX);
        StoredPhoton { flux: Vec3::splat(4.0 / count as f32), cell, axis, photon: i }
    };
    let photons: Vec<_> = (0..count).map(photon).filter(|p| p.cell != u32::MAX).collect();
    let mut faces = radiance(&photons, &sort(&photons), &voxels, printed);
    levels(&mut faces, &pyramid);
    let lookup = Lookup { pyramid: &pyramid, faces: &faces, least_area: 0.05, printed };
    let place = voxels.boundary_at(voxels.grid.local(Vec3::splat(1e-3))).unwrap_or(0);
    let cell = voxels.grid.cell_of(voxels.cells[place as usize]);
    spiral(400)
        .into_iter()
        .filter(|v| v.dot(n) > 0.1)
        .map(|v| {
            let origin = voxels.grid.local(v * 5.0);
            let look = Look { place, cell, normal: n, origin, direction: -v, area: 0.0, mark: 1 };
            lookup.radiance(&look).x * std::f32::consts::PI
        })
        .collect()
}

fn main() -> Outcome {
    let parts: [(&str, Part); 7] = [
        ("error", error),
        ("bounces", bounces),
        ("stages", stages),
        ("gather", gather),
        ("time", time),
        ("memory", memory),
        ("wall", wall),
    ];
    let (files, words): (Vec<_>, Vec<_>) = std::env::args()
        .skip(1)
        .partition(|a| std::path::Path::new(a).extension().is_some_and(|e| e == "glb"));
    let fixture = words.iter().find(|w| fixtures::NAMES.contains(&w.as_str())).map_or("cornell_spot", |w| w);
    let scene = match files.first() {
        Some(file) => indirect_scene::load(file.as_ref(), &indirect_scene::LoadOptions::default())?.scene,
        None => fixtures::build(fixture).ok_or("no such fixture")?,
    };
    let size = words.iter().find_map(|w| {
        let (x, y) = w.split_once('x')?;
        Some([x.parse().ok()?, y.parse().ok()?])
    });
    let stage = Stage::new(&scene, size.unwrap_or(if files.is_empty() { [192, 192] } else { [192, 108] }));
    let named = |name: &&str| words.iter().any(|w| w == name);
    let all = !parts.iter().any(|(name, _)| named(name));
    for (_, part) in parts.iter().filter(|(name, _)| all || named(name)) {
        part(&stage)?;
    }
    Ok(())
}
