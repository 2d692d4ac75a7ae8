//! What keeping lights is worth: a spot that moves slowly in the Cornell box.
//!
//! `cargo run --release -p incremental-vpls --example figures`
#![allow(clippy::print_stdout, reason = "an example's output")]

use core::f32::consts::{FRAC_1_PI, TAU};
use std::error::Error;
use std::time::Instant;

use glam::Vec3;
use incremental_vpls::pattern::{Pattern, Shape};
use incremental_vpls::{Density, Settings, Start, State, Update};
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
    /// Kept, at most and at least so many new ones.
    Kept(u32, u32),
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
            Self::Kept(min, max) => format!("kept, {min} to {max} new"),
            Self::Dispersion => "anew, dispersion".into(),
            Self::Sequence => "anew, same sequence".into(),
            Self::Noise => "anew, other sequence".into(),
        }
    }

    fn settings(self, count: u32, frame: u32) -> Settings {
        let (recalc_min, recalc_max) = if let Self::Kept(min, max) = self { (min, max) } else { (4, 32) };
        let start =
            if matches!(self, Self::Sequence | Self::Noise) { Start::Sequence } else { Start::Dispersion };
        let seed = if self == Self::Noise { frame } else { 0 };
        Settings { count, recalc_min, recalc_max, seed, start, ..Settings::default() }
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
                Settings { start: Start::Sequence, seed: 99, ..Way::Sequence.settings(converged, f) };
            let mut state = State::new(settings)?;
            state.update(accel, &at(light, accel, f));
            Ok(gather(accel, state.vpls(), receivers))
        })
        .collect::<Result<_, Box<dyn Error>>>()?;
    let mean = |e: &[f64]| e.iter().sum::<f64>() / e.len() as f64;
    println!("  {count} lights             kept     rays    error   flicker");
    for way in [
        Way::Kept(0, 32),
        Way::Kept(4, 32),
        Way::Kept(count / 16, count / 8),
        Way::Dispersion,
        Way::Sequence,
        Way::Noise,
    ] {
        let mut state = State::new(way.settings(count, 0))?;
        let mut total = Update::default();
        let mut frames: Vec<Vec<f64>> = Vec::new();
        // One frame before, so that none of those that count is the first.
        state.update(accel, &at(light, accel, FRAMES - 1));
        for f in 0..FRAMES {
            if !matches!(way, Way::Kept(..)) {
                state = State::new(way.settings(count, f))?;
            }
            let u = state.update(accel, &at(light, accel, f));
            total.reused += u.reused;
            total.inserted += u.inserted;
            total.rays += u.rays;
            frames.push(gather(accel, state.vpls(), receivers));
        }
        let (mut square, mut n) = (0.0, 0);
        for (k, t) in truth.iter().enumerate() {
            let level = mean(t);
            let off = frames[k * every as usize].iter().zip(t).map(|(a, b)| ((a - b) / level).powi(2));
            square += off.sum::<f64>();
            n += t.len();
        }
        // Second differences: what changes but does not go on changing.
        let mut second = 0.0;
        for w in frames.windows(3) {
            let level = mean(&w[1]);
            second +=
                (0..w[0].len()).map(|i| ((w[0][i] - 2.0 * w[1][i] + w[2][i]) / level).powi(2)).sum::<f64>();
        }
        let flicker = (second / (frames.len() - 2) as f64 / receivers.len() as f64).sqrt();
        println!(
            "    {:22} {:5.1} %  {:5}  {:5.2} %   {:5.2} %",
            way.name(),
            100.0 * f64::from(total.reused) / f64::from(total.reused + total.inserted),
            total.rays / FRAMES,
            100.0 * (square / f64::from(n as u32)).sqrt(),
            100.0 * flicker
        );
    }
    Ok(())
}

/// Rays of a visibility cache of one light, as a low-resolution hemispherical shadow map.
const CACHE: u32 = 1024;

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
    for count in [256, 512, 1024, 4096] {
        let mut row = format!("  {count:5}");
        let mut base = [0.0; 2];
        for way in [Way::Kept(4, 32), Way::Dispersion, Way::Sequence] {
            let mut least = [f64::INFINITY; 2];
            for _ in 0..REPEATS {
                let mut sum = [0.0; 2];
                let mut state = State::new(way.settings(count, 0))?;
                state.update(accel, &at(light, accel, FRAMES - 1));
                for f in 0..FRAMES {
                    let light = at(light, accel, f);
                    let start = Instant::now();
                    if matches!(way, Way::Kept(..)) {
                        state.update(accel, &light);
                    } else {
                        state.rebuild(accel, &light);
                    }
                    sum[0] += start.elapsed().as_secs_f64();
                    if count <= 1024 && f % 10 == 0 {
                        let start = Instant::now();
                        let new = state.vpls().iter().zip(state.fresh()).filter(|(_, f)| **f).map(|(v, _)| v);
                        std::hint::black_box(caches(accel, new));
                        sum[1] += 10.0 * start.elapsed().as_secs_f64();
                    }
                }
                least = [least[0].min(sum[0]), least[1].min(sum[1])];
            }
            let ms = [least[0], least[0] + least[1]].map(|s| s * 1e3 / f64::from(FRAMES));
            if let Way::Kept(..) = way {
                base = ms;
            }
            row += &format!("   {} {:.2} ({:.1}x)", way.name(), ms[0], ms[0] / base[0]);
            if count <= 1024 {
                row += &format!(", {:.1} ({:.1}x)", ms[1], ms[1] / base[1]);
            }
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
    let _ = (Density::ALL, FRAC_1_PI);
}
