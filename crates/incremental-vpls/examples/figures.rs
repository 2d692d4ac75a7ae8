//! What keeping lights is worth: a spot that moves slowly in the Cornell box.
//!
//! `cargo run --release -p incremental-vpls --example figures`
#![allow(clippy::print_stdout, reason = "an example's output")]

use core::f32::consts::TAU;
use std::error::Error;
use std::time::Instant;

use glam::Vec3;
use incremental_vpls::pattern::{Pattern, Shape};
use incremental_vpls::{Settings, Start, State, Update};
use indirect_accel::{Accel, BuildPreset};
use indirect_core::math::{luminance, offset_ray_origin_scaled};
use indirect_core::{Light, LightKind, Ray, Scene, form_factor};
use indirect_sampling::{mapping, sobol};
use rayon::prelude::*;
use rsm::Vpl;

/// Frames of a full circle.
const FRAMES: u32 = 60;

/// Radius of the circle, as a share of the scene's diagonal.
const RADIUS: f32 = 0.04;

/// Receivers at which irradiance is compared.
const RECEIVERS: u32 = 500;

/// Lights of the converged gather, and every how many frames it is made.
const CONVERGED: (u32, u32) = (4096, 4);

/// Sets of lights over which errors are averaged.
const SEEDS: u32 = 4;

/// Times an update is timed; the least counts.
const REPEATS: u32 = 5;

type Receiver = (Vec3, Vec3);

fn main() -> Result<(), Box<dyn Error>> {
    let scene = indirect_scene::fixtures::build("cornell_spot").ok_or("no such fixture")?;
    let accel = Accel::build(&scene, BuildPreset::Best);
    let spot = scene.lights.first().ok_or("no light")?;
    let point = Light { kind: LightKind::Point { position: Vec3::new(0.278, 0.42, 0.28) }, ..spot.clone() };
    let receivers = receivers(&scene);
    for (name, light) in [("spot", spot), ("point", &point)] {
        println!("{name}: {FRAMES} frames on a circle of {RADIUS} of the diagonal");
        for count in [256, 1024] {
            quality(&accel, light, &receivers, count)?;
        }
        println!();
    }
    times(&accel, spot)?;
    areas();
    Ok(())
}

/// The light in a frame: its position on a circle in the horizontal plane.
fn at(light: &Light, accel: &Accel<'_>, frame: u32) -> Light {
    let (y, x) = (frame as f32 / FRAMES as f32 * TAU).sin_cos();
    let step = Vec3::new(x, 0.0, y) * (RADIUS * accel.unit());
    let mut light = light.clone();
    if let LightKind::Spot { position, .. } | LightKind::Point { position } = &mut light.kind {
        *position += step;
    }
    light
}

/// Points spread over the scene's surfaces by area, on the side of the scene's middle, each with its normal.
fn receivers(scene: &Scene) -> Vec<Receiver> {
    let mesh = &scene.mesh;
    let triangles = 0..mesh.triangles.len() as u32;
    let areas: Vec<f32> = triangles.map(|t| mesh.area(t)).collect();
    let whole: f32 = areas.iter().sum();
    let centre = scene.bounds().map_or(Vec3::ZERO, |b| b.centre());
    let pick = |i: u32| {
        let mut x = sobol::sample_1d(i, 5) * whole;
        let chosen = areas.iter().position(|&a| {
            x -= a;
            x < 0.0
        });
        let uv = mapping::triangle_uniform(sobol::sample_2d(i, 6));
        let s = scene.surface(chosen.unwrap_or(0) as u32, uv.x, uv.y);
        // The walls are seen from within, the blocks from outside: their normals point there.
        let inside = (s.position - centre).abs().max_element() > 0.27;
        let normal = if inside { s.facing(centre - s.position).1 } else { s.geometric_normal };
        (s.position, normal)
    };
    (0..RECEIVERS).map(pick).collect()
}

/// Luminance of the irradiance at each receiver, with exact visibility.
fn gather(accel: &Accel<'_>, vpls: &[Vpl], receivers: &[Receiver]) -> Vec<f64> {
    let one = |&(p, n): &Receiver| {
        let from = offset_ray_origin_scaled(p, n, accel.unit());
        let mut sum = 0.0;
        for v in vpls {
            let factor = form_factor::point_to_disc(p, n, v.position, v.normal, v.area);
            if factor > 0.0 {
                let to = offset_ray_origin_scaled(v.position, v.normal, accel.unit()) - from;
                if !accel.any_hit(&Ray { t_max: 1.0, ..Ray::new(from, to) }) {
                    // A patch of radiosity Φ/A.
                    sum += f64::from(factor * luminance(v.flux) / v.area);
                }
            }
        }
        sum
    };
    receivers.par_iter().map(one).collect()
}

/// Ways to have lights in every frame.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Way {
    /// Kept; at least and at most so many new ones, evenness.
    Kept(u32, u32, f32),
    /// All anew by dispersion.
    Dispersion,
    /// All anew at the same sequence.
    Sequence,
    /// All anew at another sequence in every frame.
    Noise,
}

impl Way {
    fn name(self) -> String {
        match self {
            Self::Kept(min, max, evenness) => format!("kept, {min}..={max} new, {evenness}"),
            Self::Dispersion => "anew, dispersion".into(),
            Self::Sequence => "anew, same sequence".into(),
            Self::Noise => "anew, other sequence".into(),
        }
    }

    fn settings(self, count: u32, frame: u32, seed: u32) -> Settings {
        let Settings { recalc_min, recalc_max, evenness, .. } = Settings::default();
        let (recalc_min, recalc_max, evenness) = if let Self::Kept(min, max, even) = self {
            (min, max, even)
        } else {
            (recalc_min, recalc_max, evenness)
        };
        let start =
            if matches!(self, Self::Sequence | Self::Noise) { Start::Sequence } else { Start::Dispersion };
        let seed = if self == Self::Noise { seed + SEEDS * frame } else { seed };
        Settings { count, recalc_min, recalc_max, evenness, seed, start, ..Settings::default() }
    }
}

/// Share of lights kept, error against a converged gather, flicker.
fn quality(
    accel: &Accel<'_>,
    light: &Light,
    receivers: &[Receiver],
    count: u32,
) -> Result<(), Box<dyn Error>> {
    let (converged, every) = CONVERGED;
    let truth: Vec<Vec<f64>> = (0..FRAMES)
        .step_by(every as usize)
        .map(|f| {
            let settings =
                Settings { start: Start::Sequence, seed: 99, ..Way::Sequence.settings(converged, f, 0) };
            let mut state = State::new(settings)?;
            state.update(accel, &at(light, accel, f));
            Ok(gather(accel, state.vpls(), receivers))
        })
        .collect::<Result<_, Box<dyn Error>>>()?;
    let mean = |e: &[f64]| e.iter().sum::<f64>() / e.len() as f64;
    println!("  {count} lights                 kept     rays    error   flicker");
    // As in the paper, without and with a least number of new ones; by evenness alone; both, which is the default at
    // 256; more of both.
    let kept = [(0, 0.0), (count / 64, 0.0), (0, 0.5), (count / 64, 0.5), (count / 16, 0.5)];
    let kept = kept.map(|(min, evenness)| Way::Kept(min, count / 8, evenness));
    for way in kept.into_iter().chain([Way::Dispersion, Way::Sequence, Way::Noise]) {
        let mut total = Update::default();
        let (mut error, mut flicker) = (0.0, 0.0);
        for seed in 0..SEEDS {
            let frames = animate(accel, light, receivers, (way, count, seed), &mut total)?;
            for (t, frame) in truth.iter().zip(frames.iter().step_by(every as usize)) {
                let level = mean(t);
                let squares = frame.iter().zip(t).map(|(a, b)| ((a - b) / level).powi(2));
                error += squares.sum::<f64>() / (truth.len() * receivers.len()) as f64;
            }
            // Second differences: what changes but does not go on changing.
            for w in frames.windows(3) {
                let level = mean(&w[1]);
                let second =
                    (0..receivers.len()).map(|i| ((w[0][i] - 2.0 * w[1][i] + w[2][i]) / level).powi(2));
                flicker += second.sum::<f64>() / ((frames.len() - 2) * receivers.len()) as f64;
            }
        }
        println!(
            "    {:26} {:5.1} %  {:5}  {:5.2} %   {:5.2} %",
            way.name(),
            100.0 * f64::from(total.reused) / f64::from(total.reused + total.inserted),
            total.rays / (FRAMES * SEEDS),
            100.0 * (error / f64::from(SEEDS)).sqrt(),
            100.0 * (flicker / f64::from(SEEDS)).sqrt()
        );
    }
    Ok(())
}

/// Irradiance at the receivers in every frame.
fn animate(
    accel: &Accel<'_>,
    light: &Light,
    receivers: &[Receiver],
    (way, count, seed): (Way, u32, u32),
    total: &mut Update,
) -> Result<Vec<Vec<f64>>, Box<dyn Error>> {
    let mut state = State::new(way.settings(count, 0, seed))?;
    // One frame before, so that none of those that count is the first.
    state.update(accel, &at(light, accel, FRAMES - 1));
    let mut frames = Vec::new();
    for f in 0..FRAMES {
        if !matches!(way, Way::Kept(..)) {
            state = State::new(way.settings(count, f, seed))?;
        }
        let u = state.update(accel, &at(light, accel, f));
        total.reused += u.reused;
        total.inserted += u.inserted;
        total.rays += u.rays;
        frames.push(gather(accel, state.vpls(), receivers));
    }
    Ok(frames)
}

/// Rays of a visibility cache of one light, as a low-resolution hemispherical shadow map.
const CACHE: u32 = 1024;

/// Every how many frames the caches are timed.
const CACHE_FRAMES: usize = 10;

/// Casts the rays of the caches of some lights; how many hit, so that nothing is left out.
fn caches<'a>(accel: &Accel<'_>, vpls: impl Iterator<Item = &'a Vpl>) -> usize {
    let vpls: Vec<_> = vpls.collect();
    let one = |v: &&Vpl| {
        let (t, b) = indirect_core::math::orthonormal_basis(v.normal);
        let from = offset_ray_origin_scaled(v.position, v.normal, accel.unit());
        let hits = (0..CACHE).filter(|&i| {
            let d = mapping::hemisphere_uniform(sobol::sample_2d(i, 0));
            accel.closest_hit(&Ray::new(from, t * d.x + b * d.y + v.normal * d.z)).is_some()
        });
        hits.count()
    };
    vpls.par_iter().map(one).sum()
}

/// Time of an update, alone and with a visibility cache for each new light.
fn times(accel: &Accel<'_>, light: &Light) -> Result<(), Box<dyn Error>> {
    println!("time per frame, ms: lights alone, and with {CACHE} visibility rays for each new light");
    for count in [256, 512, 1024] {
        let mut row = format!("  {count:5}");
        let mut base = [0.0; 2];
        for way in [Way::Kept(count / 64, count / 8, 0.5), Way::Dispersion, Way::Sequence] {
            // The least time of each frame: the work is the same in all repeats.
            let mut least = [[f64::INFINITY; 2]; FRAMES as usize];
            for _ in 0..REPEATS {
                let mut state = State::new(way.settings(count, 0, 0))?;
                state.update(accel, &at(light, accel, FRAMES - 1));
                for (f, least) in least.iter_mut().enumerate() {
                    let light = at(light, accel, f as u32);
                    let start = Instant::now();
                    if matches!(way, Way::Kept(..)) {
                        state.update(accel, &light);
                    } else {
                        state.rebuild(accel, &light);
                    }
                    least[0] = least[0].min(start.elapsed().as_secs_f64());
                    if f % CACHE_FRAMES == 0 {
                        let start = Instant::now();
                        let new = state.vpls().iter().zip(state.fresh()).filter(|(_, f)| **f).map(|(v, _)| v);
                        std::hint::black_box(caches(accel, new));
                        least[1] = least[1].min(start.elapsed().as_secs_f64());
                    }
                }
            }
            let sum = |k: usize| least.iter().map(|l| l[k]).filter(|t| t.is_finite()).sum::<f64>();
            let alone = sum(0) * 1e3 / f64::from(FRAMES);
            let ms = [alone, alone + sum(1) * 1e3 / f64::from(FRAMES) * CACHE_FRAMES as f64];
            if let Way::Kept(..) = way {
                base = ms;
            }
            row += &format!(
                "   {}: {:.2} ({:.1}x), {:.1} ({:.1}x)",
                way.name(),
                ms[0],
                ms[0] / base[0],
                ms[1],
                ms[1] / base[1]
            );
        }
        println!("{row}");
    }
    Ok(())
}

/// How far the sums of Voronoi areas are from their domain.
fn areas() {
    for shape in [Shape::Disc, Shape::Sphere] {
        let mut worst = 0.0_f64;
        for n in [1, 2, 3, 10, 100, 1000, 4000] {
            let mut pattern = Pattern::new(shape, &[]);
            pattern.insert_sparsest(n, 1);
            let sum: f64 = pattern.areas().iter().sum();
            worst = worst.max((sum / shape.area() - 1.0).abs());
        }
        println!("Voronoi areas of {shape:?}: sum off its area by at most {worst:.1e}");
    }
}
