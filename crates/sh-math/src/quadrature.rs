//! Projection of functions by a rule that is exact to a chosen degree.

use core::f64::consts::{PI, TAU};

use crate::real::{Real, Value, float};
use crate::sh::Sh;

/// Point `k < n` of the `n`-point Gauss–Legendre rule on `[−1, 1]`: `(x, weight)`, exact for degree `2n − 1`.
#[must_use]
pub fn gauss_legendre(n: usize, k: usize) -> (f64, f64) {
    let nf = n as f64;
    // Tricomi's estimate is good to O(n⁻⁴); Newton's iteration squares the error, so four steps reach rounding even
    // from n = 1.
    let mut x = float::cos(PI * (k as f64 + 0.75) / (nf + 0.5));
    let mut slope = 1.0;
    for _ in 0..5 {
        let (mut below, mut p) = (1.0, x);
        for l in 2..=n {
            let lf = l as f64;
            (below, p) = (p, ((2.0 * lf - 1.0) * x * p - (lf - 1.0) * below) / lf);
        }
        slope = nf * (below - x * p) / (1.0 - x * x);
        x -= p / slope;
    }
    (x, 2.0 / ((1.0 - x * x) * slope * slope))
}

/// A rule of `∫ f dω` over the sphere that is exact for every spherical harmonic up to `l = degree`: Gauss–Legendre in
/// `z` times the trapezoid rule in `φ`, `(degree/2 + 1)·(degree + 1)` points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quadrature {
    degree: usize,
}

impl Quadrature {
    /// The rule that is exact up to `l = degree`. A product of two functions of `l ≤ a` and `l ≤ b` has the degree `a+b`.
    #[must_use]
    pub const fn new(degree: usize) -> Self {
        Self { degree }
    }

    /// Number of points.
    #[must_use]
    pub const fn points(&self) -> usize {
        (self.degree / 2 + 1) * (self.degree + 1)
    }

    /// Calls `f(direction, weight)` for each point; the weights sum to `4π`.
    pub fn for_each(&self, mut f: impl FnMut([f64; 3], f64)) {
        let rings = self.degree / 2 + 1;
        let turns = self.degree + 1;
        for ring in 0..rings {
            let (z, w) = gauss_legendre(rings, ring);
            let r = float::sqrt(1.0 - z * z);
            for turn in 0..turns {
                let phi = TAU * (turn as f64 + 0.5) / turns as f64;
                f([r * float::cos(phi), r * float::sin(phi), z], w * TAU / turns as f64);
            }
        }
    }
}

impl<const N: usize, T: Value> Sh<N, T> {
    /// Projects a function, `c_i = ∫ f Y_i dω`, by [`Quadrature`]. Exact up to rounding where `f` has no band above
    /// `degree − l`, `l` this vector's last band: `2l` for a function that this vector can hold. A function with a jump
    /// converges as `1/degree`; the lights with closed forms need none of this.
    ///
    /// ```
    /// use sh_math::Sh;
    /// let f = Sh::<4, f64>::project_fn(2, |[x, _, z]| 1.0 + 2.0 * x - z);
    /// assert!((f.evaluate([1.0, 0.0, 0.0]) - 3.0).abs() < 1e-12);
    /// ```
    #[must_use]
    pub fn project_fn(degree: usize, mut f: impl FnMut([T::Scalar; 3]) -> T) -> Self {
        let mut out = Self::default();
        Quadrature::new(degree).for_each(|d, w| {
            let d = d.map(T::Scalar::from_f64);
            out.project_add(d, f(d) * T::Scalar::from_f64(w));
        });
        out
    }
}
