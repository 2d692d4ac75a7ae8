//! Speed against quality of three ways to draw from an importance image, as a table.
//!
//! ```text
//! cargo run --release -p indirect-sampling --example warp_quality
//! ```
//!
//! The image is the kind that a spot light leaves in a reflective shadow map: a lobe, a hard shadow edge, texture. `error` is the root
//! mean square relative error, over 256 seeds, of the mean of a smooth function of position; `discrepancy` the largest
//! difference, over boxes `[0, x) × [0, y)` at texel corners, between the share of points and the share of importance.

use std::{error::Error, hint::black_box, time::Instant};

use glam::Vec2;
use indirect_sampling::{
    discrete::{AliasTable, RowCdf},
    rng::{hash_combine, pcg_hash, unit_f32},
    sobol,
    warp::{Empty, Pyramid, Sample},
};

const SIZE: u32 = 512;
const SEEDS: u32 = 256;

fn importance() -> Vec<f32> {
    (0..SIZE * SIZE)
        .map(|i| {
            let p = Vec2::new((i % SIZE) as f32 + 0.5, (i / SIZE) as f32 + 0.5) / SIZE as f32;
            let lobe = (-12.0 * p.distance_squared(Vec2::new(0.4, 0.55))).exp();
            let lit = p.x + 0.3 * p.y < 0.8;
            let texture = 0.5 + 0.5 * unit_f32(pcg_hash(i / SIZE / 16 * 64 + i % SIZE / 16));
            if lit { lobe * texture } else { 0.0 }
        })
        .collect()
}

fn integrand(p: Vec2) -> f64 {
    let d = p / SIZE as f32 - Vec2::new(0.2, 0.3);
    1.0 / (0.1 + f64::from(d.length_squared()))
}

/// Largest difference of the shares of points and importance over boxes that begin at the origin and end at texel corners.
fn discrepancy(points: &[Vec2], sums: &[f64]) -> f64 {
    let side = SIZE as usize;
    let mut counts = vec![0.0; side * side];
    for p in points {
        counts[p.y as usize * side + p.x as usize] += 1.0 / points.len() as f64;
    }
    summed_area(&counts).iter().zip(sums).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn summed_area(values: &[f64]) -> Vec<f64> {
    let side = SIZE as usize;
    let mut sums = values.to_vec();
    for i in 0..sums.len() {
        let (x, y) = (i % side, i / side);
        let at = |x: Option<usize>, y: Option<usize>| x.zip(y).map_or(0.0, |(x, y)| sums[y * side + x]);
        let (left, above) = (x.checked_sub(1), y.checked_sub(1));
        sums[i] = values[i] + at(left, Some(y)) + at(Some(x), above) - at(left, above);
    }
    sums
}

fn main() -> Result<(), Box<dyn Error>> {
    let image = importance();
    let total: f64 = image.iter().map(|w| f64::from(*w)).sum();
    let shares: Vec<f64> = image.iter().map(|w| f64::from(*w) / total).collect();
    let sums = summed_area(&shares);
    // The mean over each texel by its centre: the function is smooth over a texel to 1e-5.
    let centre = |i: usize| Vec2::new((i % SIZE as usize) as f32 + 0.5, (i / SIZE as usize) as f32 + 0.5);
    let truth: f64 = shares.iter().enumerate().map(|(i, p)| p * integrand(centre(i))).sum();

    let pyramid = Pyramid::build([SIZE; 2], &image)?;
    let warp = pyramid.warp(Empty::Error)?;
    let alias = AliasTable::build([SIZE; 2], &image)?;
    let cdf = RowCdf::build([SIZE; 2], &image)?;
    let scrambled = |i: u32, seed: u32| sobol::sample_2d(i, seed);
    let random = |i: u32, seed: u32| {
        let h = hash_combine(seed, i);
        Vec2::new(unit_f32(h), unit_f32(pcg_hash(h)))
    };
    type Method<'a> = (&'a str, &'a dyn Fn(Vec2) -> Sample, &'a dyn Fn(u32, u32) -> Vec2);
    let methods: [Method<'_>; 4] = [
        ("hierarchical warp", &|u| warp.sample(u), &scrambled),
        ("row CDF", &|u| cdf.sample(u), &scrambled),
        ("alias table", &|u| alias.sample(u), &scrambled),
        ("any, random points", &|u| alias.sample(u), &random),
    ];
    let mut table = String::from(
        "| method | ns | error 64 | error 1024 | discrepancy 64 | discrepancy 1024 |\n|---|---|---|---|---|---|\n",
    );
    for (name, sample, points) in methods {
        // Short runs and the best of many: a long one would time whatever else runs on the machine.
        let inputs: Vec<Vec2> = (0..1 << 12).map(|i| points(i, 7)).collect();
        let time = (0..300)
            .map(|_| {
                let start = Instant::now();
                for u in &inputs {
                    black_box(sample(black_box(*u)));
                }
                start.elapsed().as_secs_f64() / inputs.len() as f64
            })
            .fold(f64::INFINITY, f64::min);
        let measure = |count: u32| {
            let (mut square, mut worst) = (0.0, 0.0);
            for seed in 0..SEEDS {
                let set: Vec<Vec2> = (0..count).map(|i| sample(points(i, seed)).point).collect();
                let mean = set.iter().map(|p| integrand(*p)).sum::<f64>() / f64::from(count);
                square += (mean / truth - 1.0).powi(2) / f64::from(SEEDS);
                if seed < 16 {
                    worst += discrepancy(&set, &sums) / 16.0;
                }
            }
            (square.sqrt(), worst)
        };
        let ((e0, d0), (e1, d1)) = (measure(64), measure(1024));
        table += &format!(
            "| {name} | {:.1} | {:.3} % | {:.4} % | {d0:.4} | {d1:.4} |\n",
            time * 1e9,
            100.0 * e0,
            100.0 * e1
        );
    }
    eprint!("{table}");
    Ok(())
}
