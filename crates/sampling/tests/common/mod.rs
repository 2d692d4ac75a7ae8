//! Random points and the χ² test.
#![allow(dead_code, reason = "each test binary uses its part")]

use glam::Vec2;
use indirect_sampling::rng::{philox4x32, unit_f32};

/// χ² tests in all test binaries of this crate together: the level of each is 0.01 divided by it (Bonferroni), so that one in a
/// hundred builds with fresh seeds would fail.
pub(crate) const TESTS_IN_THIS_CRATE: f64 = 60.0;

/// Independent uniform points.
pub(crate) fn random_points(count: usize, stream: u32) -> impl Iterator<Item = Vec2> {
    (0..count as u32).map(move |i| {
        let [x, y, ..] = philox4x32([i, 0, 0, 0], [stream, 0]);
        Vec2::new(unit_f32(x), unit_f32(y))
    })
}

/// Pearson's statistic and the number of cells that went into it. Cells with fewer than 5 expected samples are pooled;
/// a cell of probability 0 must be empty.
pub(crate) fn chi_square(counts: &[u32], probabilities: &[f64], samples: f64) -> (f64, usize) {
    let (mut statistic, mut cells) = (0.0, 0);
    let mut pool = (0.0, 0.0);
    for (&count, &p) in counts.iter().zip(probabilities) {
        let (count, expected) = (f64::from(count), p * samples);
        if p == 0.0 {
            assert_eq!(count, 0.0, "samples where the density is 0");
        } else if expected < 5.0 {
            pool = (pool.0 + count, pool.1 + expected);
        } else {
            statistic += (count - expected).powi(2) / expected;
            cells += 1;
        }
    }
    if pool.1 >= 5.0 {
        statistic += (pool.0 - pool.1).powi(2) / pool.1;
        cells += 1;
    }
    (statistic, cells)
}

/// The value that χ² with `freedom` degrees exceeds with the probability `alpha` (Wilson & Hilferty 1931; for 100 degrees and more
/// within 0.1 %).
pub(crate) fn chi_square_critical(freedom: usize, alpha: f64) -> f64 {
    // The normal quantile by bisection of the tail, the tail by its continued fraction.
    let tail = |z: f64| {
        let fraction = (1..=60).rev().fold(z, |f, k| z + f64::from(k) / f);
        (-0.5 * z * z).exp() / ((2.0 * std::f64::consts::PI).sqrt() * fraction)
    };
    let (mut low, mut high) = (0.5, 10.0);
    for _ in 0..60 {
        let z = 0.5 * (low + high);
        if tail(z) > alpha { low = z } else { high = z }
    }
    let (k, z) = (freedom as f64, 0.5 * (low + high));
    let c = 2.0 / (9.0 * k);
    k * (1.0 - c + z * c.sqrt()).powi(3)
}
