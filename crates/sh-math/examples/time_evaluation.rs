//! Nanoseconds per direction, the least of many repetitions: what `xtask/peers/sphericart_eval.py` measures of its peer.
#![allow(clippy::print_stdout, reason = "it prints the table")]

use std::hint::black_box;
use std::time::Instant;

use sh_math::{Sh, basis_and_gradient, basis_batch};

const DIRECTIONS: usize = 1024;

fn least(mut call: impl FnMut()) -> f64 {
    (0..2000)
        .map(|_| {
            let start = Instant::now();
            call();
            start.elapsed().as_nanos() as f64 / DIRECTIONS as f64
        })
        .fold(f64::INFINITY, f64::min)
}

fn row<const N: usize>(directions: &[[f32; 3]]) {
    let wide: Vec<[f64; 3]> = directions.iter().map(|d| d.map(f64::from)).collect();
    let (mut rows, mut wide_rows) = (vec![[0.0_f32; N]; DIRECTIONS], vec![[0.0_f64; N]; DIRECTIONS]);
    let mut gradients = vec![([0.0_f32; N], [[0.0; 3]; N]); DIRECTIONS];
    let single = least(|| {
        let _ = basis_batch(black_box(directions), &mut rows);
        black_box(&mut rows);
    });
    let double = least(|| {
        let _ = basis_batch(black_box(&wide), &mut wide_rows);
        black_box(&mut wide_rows);
    });
    let gradient = least(|| {
        for (row, d) in gradients.iter_mut().zip(black_box(directions)) {
            *row = basis_and_gradient::<N, f32>(*d);
        }
        black_box(&mut gradients);
    });
    let l = Sh::<N>::BANDS - 1;
    println!("| {l} | {single:.2} | {double:.2} | {gradient:.2} |");
}

fn main() {
    let golden = core::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
    let directions: Vec<[f32; 3]> = (0..DIRECTIONS)
        .map(|i| {
            let z = 1.0 - (2 * i + 1) as f32 / DIRECTIONS as f32;
            let (r, phi) = ((1.0 - z * z).sqrt(), golden * i as f32);
            [r * phi.cos(), r * phi.sin(), z]
        })
        .collect();
    println!("| l ≤ | f32 | f64 | f32 with gradient |\n|---|---|---|---|");
    row::<4>(&directions);
    row::<9>(&directions);
    row::<16>(&directions);
    row::<25>(&directions);
    row::<121>(&directions);
}
