//! Non-negative functions from ones that ring.

use crate::basis::{basis, unit};
use crate::minimum::{Minimum, band_bound, cube_direction, curvature_bound, minimum};
use crate::real::{Real, Value};
use crate::sh::{Sh, band};
use crate::table::Table;
use crate::zonal::Zonal;

/// What de-ringing does with the mean of a function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mean {
    /// Keeps it, so that energy is conserved. A function of negative mean becomes 0.
    Keep,
    /// Lets it grow where that changes the function less: at most 9 % for one distant light's irradiance at `l ≤ 2`.
    Adjust,
}

impl<const N: usize, T: Value> Sh<N, T> {
    /// The nearest function (in the mean square) that is nowhere negative, channel by channel.
    ///
    /// Use it on radiance, or on irradiance: `radiance.convolve(&Zonal::clamped_cosine()).non_negative(Mean::Keep)`. It
    /// leaves a function without negative values as it is, commutes with rotation, and damps only what rings, where a
    /// window of fixed shape damps every input alike. No other non-negative function of `l ≤` this one's last band (and
    /// the same mean, for [`Mean::Keep`]) adds less to the root-mean-square error of a truncated series.
    ///
    /// The projection onto this convex set is found by cutting planes in f64: the least value over all directions
    /// ([`Sh::minimum`]) becomes a linear constraint until it is above −1/1000 of the mean; a final scaling toward the
    /// mean makes the certified minimum ≥ 0, with room for the rounding of storage and evaluation in `T`. Some
    /// hundred microseconds at `l ≤ 2`, some milliseconds at `l ≤ 4`: for probes and environments, not for pixels.
    ///
    /// ```
    /// use sh_math::{Mean, Sh, Zonal};
    /// // Irradiance of one distant light: −0.040 opposite to it without de-ringing.
    /// let e: Sh<9> = Zonal::clamped_cosine().toward([0.0, 0.0, 1.0]);
    /// assert!(e.minimum(1e-4).value < -0.039);
    /// assert!(e.non_negative(Mean::Keep).minimum(1e-6).lower_bound >= 0.0);
    /// ```
    #[must_use]
    pub fn non_negative(&self, mean: Mean) -> Self {
        self.map_channels(|channel| {
            let c: [f64; N] = channel.0.map(Into::into);
            Sh(nearest(&c, mean, slack::<T::Scalar>()).map(T::Scalar::from_f64))
        })
    }
}

impl<const N: usize, S: Real> Sh<N, S> {
    /// The window (one factor per band, 1 for `l = 0`) that makes this function nowhere negative at the least
    /// mean-square change among windows: `f.convolve(&f.non_negative_window())`.
    ///
    /// A window turns with any rotation and is a handful of numbers; [`Sh::non_negative`] changes the function less. All
    /// ones where nothing is negative, all zeros beyond `l = 0` where the mean is not positive.
    #[must_use]
    pub fn non_negative_window(&self) -> Zonal<N, S> {
        let c: [f64; N] = self.0.map(Into::into);
        let w = window(&c, slack::<S>());
        Zonal::from_factors(|l| w[l])
    }
}

/// Directions that constrain the solution; more than ever bind at once for `l ≤ 10`.
const CUTS: usize = 96;

/// Share of `Σ b_l` that rounding of the coefficients and of an evaluation in `S` may take from a value: half an ulp each,
/// and the 4 ulp per band of the basis.
fn slack<S: Real>() -> f64 {
    let epsilon: f64 = S::EPSILON.into();
    5.0 * epsilon
}

fn total_bound<const N: usize>(c: &[f64; N]) -> f64 {
    (0..Table::<N>::BANDS).map(|l| band_bound(c, l)).sum()
}

/// Nearest point to `target` with `offset + a_k·x ≥ 0` for every direction, where `row(d)` makes `a_k` and `expand(x)`
/// the coefficients whose minimum finds the next `k`. `None` where the target needs no change.
fn cutting_planes<const N: usize>(
    target: &[f64; N],
    offset: f64,
    tolerance: f64,
    row: impl Fn(&[f64; 3]) -> [f64; N],
    expand: impl Fn(&[f64; N]) -> [f64; N],
) -> ([f64; N], Minimum) {
    let dot = |a: &[f64; N], b: &[f64; N]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut x = *target;
    let mut rows = [[0.0; N]; CUTS];
    let mut multipliers = [0.0; CUTS];
    let mut used = 0;
    loop {
        let f = expand(&x);
        // Any direction below 0 makes a cut; only where a quick look finds none, the certified search decides.
        let quick = low_direction(&f);
        if quick.1 < -tolerance && used < CUTS {
            rows[used] = row(&quick.0);
        } else {
            let least = minimum(&f, 0.25 * tolerance);
            if least.value >= -tolerance || used == CUTS {
                return (x, least);
            }
            rows[used] = row(&least.direction);
        }
        used += 1;
        // Hildreth's dual coordinate ascent.
        for _ in 0..2000 {
            let mut worst = 0.0_f64;
            for (a, multiplier) in rows.iter().zip(&mut multipliers).take(used) {
                let norm = dot(a, a);
                if norm <= 0.0 {
                    continue;
                }
                let violation = offset + dot(a, &x);
                let step = (-violation / norm).max(-*multiplier);
                *multiplier += step;
                for (x, a) in x.iter_mut().zip(a) {
                    *x += step * a;
                }
                worst = worst.max((step * norm).abs());
            }
            if worst < 0.1 * tolerance {
                break;
            }
        }
    }
}

/// A direction where `f` is low, and its value: the best of a coarse grid, moved down the slope.
fn low_direction<const N: usize>(c: &[f64; N]) -> ([f64; 3], f64) {
    const SIDE: usize = 6;
    let value = |d: &[f64; 3]| basis::<N, f64>(*d).iter().zip(c).map(|(y, c)| y * c).sum::<f64>();
    let mut best = ([0.0, 0.0, 1.0], f64::INFINITY);
    for i in 0..6 * SIDE * SIDE {
        let at = |k: usize| (2 * k + 1) as f64 / SIDE as f64 - 1.0;
        let direction = cube_direction(i / (SIDE * SIDE), at(i % SIDE), at(i / SIDE % SIDE));
        let f = value(&direction);
        if f < best.1 {
            best = (direction, f);
        }
    }
    let curvature = curvature_bound(c);
    for _ in 0..8 {
        let slope = Sh(*c).gradient(best.0);
        let d: [f64; 3] = core::array::from_fn(|a| best.0[a] - slope[a] / curvature);
        let Some(d) = unit::<f64>(d) else { break };
        let f = value(&d);
        if f >= best.1 {
            break;
        }
        best = (d, f);
    }
    best
}

/// Share of the mean that the cutting planes may leave below 0.
const TOLERANCE: f64 = 1e-3;

/// `√(1/4π)`.
const Y0: f64 = 0.282_094_791_773_878_14;

fn nearest<const N: usize>(c: &[f64; N], mean: Mean, slack: f64) -> [f64; N] {
    let room = slack * total_bound(c);
    if !room.is_finite() || c.iter().all(|&c| c == 0.0) {
        return *c;
    }
    let (fixed, scale) = match mean {
        Mean::Keep if c[0] <= 0.0 => return [0.0; N],
        Mean::Keep => (Y0 * c[0], Y0 * c[0]),
        // A mean far below the ringing would ask for a needless precision.
        Mean::Adjust => (0.0, (Y0 * c[0]).max(0.1 * total_bound(c))),
    };
    let keep = mean == Mean::Keep;
    let mut target = *c;
    if keep {
        target[0] = 0.0;
    }
    let whole = |x: &[f64; N]| {
        let mut x = *x;
        if keep {
            x[0] = c[0];
        }
        x
    };
    let row = |d: &[f64; 3]| {
        let mut y = basis::<N, f64>(*d);
        if keep {
            y[0] = 0.0;
        }
        y
    };
    let (x, least) = cutting_planes(&target, fixed - room, TOLERANCE * scale, row, whole);
    let mut out = whole(&x);
    if least.lower_bound < room {
        if keep {
            let share = ((out[0] * Y0 - room) / (out[0] * Y0 - least.lower_bound)).max(0.0);
            out[1..].iter_mut().for_each(|c| *c *= share);
        } else {
            out[0] += (room - least.lower_bound) / Y0;
        }
    }
    out
}

fn window<const N: usize>(c: &[f64; N], slack: f64) -> [f64; N] {
    let bands = Table::<N>::BANDS;
    let mut w = [0.0; N];
    w[0] = 1.0;
    let room = slack * total_bound(c);
    if c[0] <= 0.0 || !room.is_finite() {
        return w;
    }
    // In units where the cost is the plain square: x_l = w_l·‖c_l‖.
    let norm = |l: usize| crate::real::float::sqrt(c[l * l..(l + 1) * (l + 1)].iter().map(|c| c * c).sum());
    let norms: [f64; N] = core::array::from_fn(|l| if l > 0 && l < bands { norm(l) } else { 0.0 });
    let share = |x: &[f64; N], l: usize| if norms[l] > 0.0 { x[l] / norms[l] } else { 1.0 };
    let expand = |x: &[f64; N]| {
        let mut out = *c;
        for (i, c) in out.iter_mut().enumerate().skip(1) {
            *c *= share(x, band(i));
        }
        out
    };
    let row = |d: &[f64; 3]| {
        let y = basis::<N, f64>(*d);
        let mut a = [0.0; N];
        for i in 1..N {
            let l = band(i);
            if norms[l] > 0.0 {
                a[l] += c[i] * y[i] / norms[l];
            }
        }
        a
    };
    let mean = Y0 * c[0];
    let (x, least) = cutting_planes(&norms, mean - room, TOLERANCE * mean, row, expand);
    let scale =
        if least.lower_bound < room { ((mean - room) / (mean - least.lower_bound)).max(0.0) } else { 1.0 };
    for (l, w) in w.iter_mut().enumerate().take(bands).skip(1) {
        *w = share(&x, l) * scale;
    }
    w
}
