//! How even a point set is: star discrepancies and correlation.
//!
//! ```
//! use indirect_sampling::analysis::{correlation, l2_star_discrepancy, star_discrepancy};
//! use indirect_sampling::halton::{Halton, Scrambling};
//!
//! // Bases 59 and 61, unscrambled, and 256 points: all of them near a few diagonals.
//! let [x, y] = [16, 17].map(|d| Halton::dimension(d, Scrambling::None));
//! let points: Vec<[f64; 2]> = (0..256).map(|i| [x.fraction(i).to_f64(), y.fraction(i).to_f64()]).collect();
//! assert!(correlation(&points) > 0.5 && star_discrepancy(&points) > 0.15 && l2_star_discrepancy(&points) > 0.08);
//! ```

use alloc::vec::Vec;

/// The star discrepancy in the mean: the root of the mean square, over all boxes `[0, x)`, of the share of points inside minus
/// the volume (Warnock 1972). Points lie in `[0, 1]^D`; `O(N²)`; 0 for no points.
#[must_use]
pub fn l2_star_discrepancy<const D: usize>(points: &[[f64; D]]) -> f64 {
    let n = points.len() as f64;
    if points.is_empty() {
        return 0.0;
    }
    let power = |x: f64| (0..D).fold(1.0, |p, _| p * x);
    let single: f64 = points.iter().map(|p| p.iter().map(|x| 1.0 - x * x).product::<f64>()).sum();
    let pair = |p: &[f64; D], q: &[f64; D]| p.iter().zip(q).map(|(x, y)| 1.0 - x.max(*y)).product::<f64>();
    let pairs: f64 = points.iter().map(|p| points.iter().map(|q| pair(p, q)).sum::<f64>()).sum();
    let square = power(1.0 / 3.0) - 2.0 * power(0.5) / n * single + pairs / (n * n);
    crate::math::sqrt64(square.max(0.0))
}

/// The star discrepancy: the largest difference, over all boxes `[0, x) × [0, y)`, between the share of points inside and the
/// area. Exact; `O(N²)`; 0 for no points.
#[must_use]
pub fn star_discrepancy(points: &[[f64; 2]]) -> f64 {
    if points.is_empty() {
        return 0.0;
    }
    let n = points.len() as f64;
    let mut by_x: Vec<[f64; 2]> = points.to_vec();
    by_x.sort_by(|a, b| a[0].total_cmp(&b[0]));
    // The y of all points left of the current x, in order. Between the coordinates of points only the area changes, so that the
    // extremes are at corners made of coordinates: just beyond the points there (too many), or just before (too few).
    let mut ys: Vec<f64> = Vec::with_capacity(points.len());
    let mut worst = 0.0_f64;
    let mut next = 0;
    while next <= by_x.len() {
        let right = by_x.get(next).map_or(1.0, |p| p[0]);
        // Too few: the open box that ends at x = right holds what lies left of it.
        for (below, y) in ys.iter().chain([&1.0]).enumerate() {
            let open = ys[..below].partition_point(|other| other < y);
            worst = worst.max(right * y - open as f64 / n);
        }
        if next == by_x.len() {
            break;
        }
        while by_x.get(next).is_some_and(|p| p[0] == right) {
            let y = by_x[next][1];
            ys.insert(ys.partition_point(|other| *other < y), y);
            next += 1;
        }
        // Too many: the closed box that ends at x = right.
        for (i, y) in ys.iter().enumerate() {
            worst = worst.max((i + 1) as f64 / n - right * y);
        }
    }
    worst
}

/// Pearson's correlation of the two coordinates; 0 if one of them is constant.
#[must_use]
pub fn correlation(points: &[[f64; 2]]) -> f64 {
    let n = points.len() as f64;
    let mean = |axis: usize| points.iter().map(|p| p[axis]).sum::<f64>() / n;
    let means = [mean(0), mean(1)];
    let moment =
        |a: usize, b: usize| points.iter().map(|p| (p[a] - means[a]) * (p[b] - means[b])).sum::<f64>();
    let variance = moment(0, 0) * moment(1, 1);
    if variance > 0.0 { moment(0, 1) / crate::math::sqrt64(variance) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn known_values() {
        // One point at the far corner: no box short of the whole holds it. At the centre: 3/4 from [0, ½]².
        assert_eq!(star_discrepancy(&[[1.0, 1.0]]), 1.0);
        assert_eq!(star_discrepancy(&[[0.5, 0.5]]), 0.75);
        // ∫(1[x>½] − x)² over [0, 1] = 1/12 in one dimension.
        assert!((l2_star_discrepancy(&[[0.5]]) - (1.0_f64 / 12.0).sqrt()).abs() < 1e-15);
        assert!((correlation(&[[0.0, 1.0], [0.5, 0.5], [1.0, 0.0]]) + 1.0).abs() < 1e-15);
        assert_eq!(correlation(&[[0.5, 0.0], [0.5, 1.0]]), 0.0);
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2048, failure_persistence: None, ..ProptestConfig::default() })]

        /// Against the definition, over all corners made of coordinates; a coarse lattice makes ties common.
        #[test]
        fn star_discrepancy_is_the_supremum(lattice in prop::collection::vec((0..=8_u32, 0..=8_u32), 1..24)) {
            let points: Vec<[f64; 2]> = lattice.iter().map(|&(x, y)| [f64::from(x) / 8.0, f64::from(y) / 8.0]).collect();
            let n = points.len() as f64;
            let mut worst = 0.0_f64;
            for i in 0..=8 {
                for j in 0..=8 {
                    let (x, y) = (f64::from(i) / 8.0, f64::from(j) / 8.0);
                    let open = points.iter().filter(|p| p[0] < x && p[1] < y).count() as f64 / n;
                    let closed = points.iter().filter(|p| p[0] <= x && p[1] <= y).count() as f64 / n;
                    worst = worst.max(x * y - open).max(closed - x * y);
                }
            }
            prop_assert!((star_discrepancy(&points) - worst).abs() < 1e-12);
        }

        /// Warnock's formula against the mean over a fine midpoint grid of boxes: the integrand is smooth between lattice
        /// lines, on which the grid's cells begin. Along each axis its second derivative is at most 2, of which the midpoint
        /// rule leaves h²/24 = 2.04e-5 in all for h = 1/64; two axes.
        #[test]
        fn l2_is_the_mean(lattice in prop::collection::vec((0..=4_u32, 0..=4_u32), 1..12)) {
            let points: Vec<[f64; 2]> = lattice.iter().map(|&(x, y)| [f64::from(x) / 4.0, f64::from(y) / 4.0]).collect();
            let mut sum = 0.0;
            for i in 0..64 {
                for j in 0..64 {
                    let (x, y) = ((f64::from(i) + 0.5) / 64.0, (f64::from(j) + 0.5) / 64.0);
                    let inside = points.iter().filter(|p| p[0] < x && p[1] < y).count() as f64 / points.len() as f64;
                    sum += (inside - x * y).powi(2);
                }
            }
            let square = l2_star_discrepancy(&points).powi(2);
            prop_assert!((square - sum / 4096.0).abs() < 4.1e-5, "{} {}", square, sum / 4096.0);
        }
    }
}
