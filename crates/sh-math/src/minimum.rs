//! The least value of a function on the sphere, with proof.

use crate::gradient::basis_and_gradient;
use crate::real::{Real, float};
use crate::sh::Sh;
use crate::table::Table;

/// The least value of a function, as found by [`Sh::minimum`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Minimum {
    /// Where the least value was found.
    pub direction: [f64; 3],
    /// The function there.
    pub value: f64,
    /// No direction has less than this; `value − tolerance`, or a little below where the search was cut short.
    pub lower_bound: f64,
}

/// A square on a face of the cube `[−1, 1]³`.
#[derive(Clone, Copy, Default)]
struct Cell {
    face: usize,
    u: f64,
    v: f64,
    half: f64,
}

/// The unit vector through the point `(u, v)` of a face of the cube `[−1, 1]³`.
pub(crate) fn cube_direction(face: usize, u: f64, v: f64) -> [f64; 3] {
    let mut d = [0.0; 3];
    d[face % 3] = if face < 3 { 1.0 } else { -1.0 };
    d[(face + 1) % 3] = u;
    d[(face + 2) % 3] = v;
    let length = float::sqrt(1.0 + u * u + v * v);
    d.map(|x| x / length)
}

/// Depth-first search keeps three siblings per level, and halving stops at 2⁻²⁴.
const STACK: usize = 6 + 3 * 24;

impl<const N: usize, S: Real> Sh<N, S> {
    /// The least value over all directions to within `tolerance > 0`, with a certified lower bound.
    ///
    /// Branch and bound over the faces of a cube. Along a great circle band `l` is a trigonometric polynomial of degree
    /// `l`, bounded by `b_l = √((2l+1)/4π)·‖c_l‖` (addition theorem), so its second derivative is bounded by `l² b_l`
    /// (Bernstein): within the angle `δ` of a direction, `f ≥ f₀ − |∇f₀|δ − Σ l² b_l·δ²/2`. Deterministic; some hundred
    /// evaluations at a tolerance of 1e-3 of the function's range. Not-a-number coefficients give a NaN.
    #[must_use]
    pub fn minimum(&self, tolerance: f64) -> Minimum {
        let c = self.0.map(Into::into);
        minimum(&c, tolerance)
    }
}

/// `b_l` of [`Sh::minimum`].
pub(crate) fn band_bound<const N: usize>(c: &[f64; N], l: usize) -> f64 {
    let energy: f64 = c[l * l..(l + 1) * (l + 1)].iter().map(|c| c * c).sum();
    float::sqrt((2 * l + 1) as f64 / (4.0 * core::f64::consts::PI) * energy)
}

/// No second derivative along a great circle is larger.
pub(crate) fn curvature_bound<const N: usize>(c: &[f64; N]) -> f64 {
    (1..Table::<N>::BANDS).map(|l| (l * l) as f64 * band_bound(c, l)).sum()
}

pub(crate) fn minimum<const N: usize>(c: &[f64; N], tolerance: f64) -> Minimum {
    let curvature = curvature_bound(c);
    let mut best = Minimum { direction: [0.0, 0.0, 1.0], value: f64::INFINITY, lower_bound: f64::NAN };
    // An infinite coefficient, or the overflow of its square, has no minimum to find either.
    if !(curvature + c[0]).is_finite() {
        best.value = f64::NAN;
        return best;
    }
    let mut lowest = f64::INFINITY;
    let mut stack = [Cell::default(); STACK];
    for (face, cell) in stack.iter_mut().take(6).enumerate() {
        *cell = Cell { face, half: 1.0, ..Cell::default() };
    }
    let mut top = 6;
    while top > 0 {
        top -= 1;
        let cell = stack[top];
        let direction = cube_direction(cell.face, cell.u, cell.v);
        let (y, gradient) = basis_and_gradient::<N, f64>(direction);
        let value: f64 = c.iter().zip(&y).map(|(c, y)| c * y).sum();
        if value < best.value {
            best = Minimum { direction, value, ..best };
        }
        let mut slope = [0.0; 3];
        for (c, g) in c.iter().zip(&gradient) {
            for axis in 0..3 {
                slope[axis] += c * g[axis];
            }
        }
        let slope = float::sqrt(slope.iter().map(|s| s * s).sum());
        // Central projection to the sphere does not lengthen; the cell's corner is √2 half sides away.
        let delta = core::f64::consts::SQRT_2 * cell.half;
        let bound = value - slope * delta - 0.5 * curvature * delta * delta;
        let half = 0.5 * cell.half;
        if bound >= best.value - tolerance || top + 4 > STACK {
            lowest = lowest.min(bound);
            continue;
        }
        for (su, sv) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            stack[top] = Cell { u: cell.u + su * half, v: cell.v + sv * half, half, ..cell };
            top += 1;
        }
    }
    best.lower_bound = lowest.min(best.value);
    best
}
