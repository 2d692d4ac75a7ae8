//! The directions in which cells and pixels look.

use glam::{Mat3, Vec3};
use indirect_core::math::orthonormal_basis;
use indirect_sampling::rng::{hash_combine, unit_f32};

/// Directions of a set at most: what a uniform buffer of any device holds beside the turns.
pub(crate) const MOST_DIRECTIONS: u32 = 2048;

/// Different turns of a set.
pub const TURNS: u32 = 64;

/// Unit vectors that are spread evenly: a spiral from pole to pole (Swinbank & Purser 2006, "Fibonacci grids").
#[must_use]
pub fn spiral(count: u32) -> Vec<Vec3> {
    let turn = core::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..count)
        .map(|i| {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
            // Half a turn on: along no axis, in whose plane through a cell's centre fine cells meet.
            let (r, phi) = ((1.0 - z * z).sqrt(), turn * (f64::from(i) + 0.5));
            Vec3::new((r * phi.cos()) as f32, (r * phi.sin()) as f32, z as f32)
        })
        .collect()
}

/// Rotations, evenly drawn from all.
#[must_use]
pub fn turns() -> Vec<Mat3> {
    let turn = |i: u32| {
        let u = |k: u32| unit_f32(hash_combine(i, k));
        let z = 1.0 - 2.0 * u(1);
        let r = (1.0 - z * z).max(0.0).sqrt();
        let (s, c) = (core::f32::consts::TAU * u(2)).sin_cos();
        let n = Vec3::new(r * c, r * s, z);
        let (t, b) = orthonormal_basis(n);
        let (s, c) = (core::f32::consts::TAU * u(3)).sin_cos();
        Mat3::from_cols(t * c + b * s, b * c - t * s, n)
    };
    (0..TURNS).map(turn).collect()
}

/// Which turn a cell or a pixel takes.
#[cfg(feature = "cpu")]
#[must_use]
#[inline]
pub(crate) const fn turn_of(number: u32, seed: u32) -> u32 {
    hash_combine(seed, number) % TURNS
}
