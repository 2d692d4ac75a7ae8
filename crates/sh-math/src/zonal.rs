//! Rotationally symmetric kernels: convolution, lobes, windows.

use core::f64::consts::{PI, TAU};

use crate::basis::basis;
use crate::quadrature::gauss_legendre;
use crate::real::{Real, Value, float};
use crate::sh::Sh;
use crate::table::Table;

/// A kernel `k(cos θ)` as one factor per band, `A_l = 2π ∫ k(t) P_l(t) dt` over `t ∈ [−1, 1]` (Funk–Hecke).
///
/// Convolving `f` with it multiplies each `f_lm` by `A_l` ([`Sh::convolve`]); the kernel about the axis `d`, as a
/// function, has the coefficients `A_l·Y_lm(d)` ([`Zonal::toward`]). `N` is that of the [`Sh`] it works on; the factor of
/// a band is stored for each of its coefficients.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Zonal<const N: usize, S = f32>([S; N]);

impl<const N: usize, S: Real> Zonal<N, S> {
    /// The kernel with the factor `factor(l)` in band `l`; called once for each band, in order.
    #[must_use]
    pub fn from_factors(mut factor: impl FnMut(usize) -> f64) -> Self {
        let mut out = [S::default(); N];
        for l in 0..Table::<N>::BANDS {
            out[l * l..(l + 1) * (l + 1)].fill(S::from_f64(factor(l)));
        }
        Self(out)
    }

    /// `A_l`; 0 where there is no such band.
    #[must_use]
    pub fn factor(&self, l: usize) -> S {
        self.0.get(l * l).copied().unwrap_or_default()
    }

    /// `max(0, cos θ)`: `π, 2π/3, π/4, 0, −π/24, …`. Radiance convolved with it is irradiance.
    #[must_use]
    pub fn clamped_cosine() -> Self {
        Self::phong(1.0)
    }

    /// `max(0, cos θ)^exponent`, any real `exponent ≥ 0`: with `I_l = ∫₀¹ tⁿ P_l dt`, `I_0 = 1/(n+1)`, `I_1 = 1/(n+2)`,
    /// `I_l = I_{l−2}·(n−l+2)/(n+l+1)`.
    #[must_use]
    pub fn phong(exponent: f64) -> Self {
        let mut integral = [1.0 / (exponent + 1.0), 1.0 / (exponent + 2.0)];
        Self::from_factors(|l| {
            let lf = l as f64;
            if l >= 2 {
                integral[l % 2] *= (exponent - lf + 2.0) / (exponent + lf + 1.0);
            }
            TAU * integral[l % 2]
        })
    }

    /// 1 within the angle `half_angle` (radians, `[0, π]`) of the axis, else 0: `A_0 = 2π (1 − cos θ)` and
    /// `A_l = 2π ∫_c^1 P_l dt = 2π sin²θ·P'_l(c)/(l(l+1))`, `c = cos θ` (Legendre's equation, integrated).
    ///
    /// All factors of a small cap are right to some ulp; the textbooks' `P_{l−1}(c) − P_{l+1}(c)` cancels there.
    #[must_use]
    pub fn cap(half_angle: f64) -> Self {
        let (c, sin) = (float::cos(half_angle), float::sin(half_angle));
        // 1 − cos without the cancellation.
        let h = float::sin(0.5 * half_angle);
        // P_{l−1}, P_l, P'_{l−1}, P'_l at c; P'_{l+1} = P'_{l−1} + (2l+1)·P_l.
        let (mut below, mut p, mut slope_below, mut slope) = (0.0, 1.0, 0.0, 0.0);
        Self::from_factors(|l| {
            let lf = l as f64;
            let factor = if l == 0 { 2.0 * h * h } else { sin * sin * slope / (lf * (lf + 1.0)) };
            let step = 2.0 * lf + 1.0;
            (slope_below, slope) = (slope, slope_below + step * p);
            (below, p) = (p, (step * c * p - lf * below) / (lf + 1.0));
            TAU * factor
        })
    }

    /// 1 on the hemisphere about the axis: `2π, π, 0, −π/4, 0, …`.
    #[must_use]
    pub fn hemisphere() -> Self {
        Self::cap(0.5 * PI)
    }

    /// All of the kernel on the axis: every factor is 1. Convolution with it is the identity.
    #[must_use]
    pub fn delta() -> Self {
        Self::from_factors(|_| 1.0)
    }

    /// `kernel(cos θ)` where `cos θ` is within `[lo, hi]`, 0 elsewhere, by a Gauss–Legendre rule of `points` points:
    /// exact for a polynomial of degree `d` where `2·points − 1 ≥ d + l`.
    #[must_use]
    pub fn from_fn(points: usize, lo: f64, hi: f64, mut kernel: impl FnMut(f64) -> f64) -> Self {
        let mut sum = [0.0; N];
        let (centre, half) = (0.5 * (lo + hi), 0.5 * (hi - lo));
        for k in 0..points {
            let (x, w) = gauss_legendre(points, k);
            let t = centre + half * x;
            let weighted = TAU * half * w * kernel(t);
            let (mut below, mut p) = (0.0, 1.0);
            for (l, s) in sum[..Table::<N>::BANDS].iter_mut().enumerate() {
                *s += weighted * p;
                let lf = l as f64;
                (below, p) = (p, ((2.0 * lf + 1.0) * t * p - lf * below) / (lf + 1.0));
            }
        }
        Self::from_factors(|l| sum[l])
    }

    /// Hann's window `(1 + cos(π l/(l_max+1)))/2`: damps ringing, and contrast with it.
    #[must_use]
    pub fn hann() -> Self {
        Self::from_factors(|l| 0.5 * (1.0 + float::cos(PI * l as f64 / Table::<N>::BANDS as f64)))
    }

    /// Lanczos' window `sinc(π l/(l_max+1))`: a gentler one.
    #[must_use]
    pub fn lanczos() -> Self {
        Self::from_factors(|l| {
            let x = PI * l as f64 / Table::<N>::BANDS as f64;
            if l == 0 { 1.0 } else { float::sin(x) / x }
        })
    }

    /// The kernel of one convolution after the other: the factors' product.
    #[must_use]
    pub fn then(&self, next: &Self) -> Self {
        Self(core::array::from_fn(|l| self.0[l] * next.0[l]))
    }

    /// Scaled to the integral 1 over the sphere (`A_0 = 1`).
    #[must_use]
    pub fn normalized(&self) -> Self {
        let a0: f64 = self.0[0].into();
        Self(self.0.map(|a| S::from_f64(a.into() / a0)))
    }

    /// The kernel turned toward the unit direction `axis`: `A_l·Y_lm(axis)`. This is the fast rotation of a zonal lobe.
    ///
    /// ```
    /// use sh_math::{Sh, Zonal};
    /// // Irradiance from a distant light of 1 W/m² above: l ≤ 2 gives 17/16 where the truth is 1.
    /// let lobe: Sh<9> = Zonal::clamped_cosine().toward([0.0, 1.0, 0.0]);
    /// assert!((lobe.evaluate([0.0, 1.0, 0.0]) - 1.0625).abs() < 1e-6);
    /// ```
    #[must_use]
    #[inline]
    pub fn toward(&self, axis: impl Into<[S; 3]>) -> Sh<N, S> {
        let mut out = basis::<N, S>(axis);
        for (c, &a) in out.iter_mut().zip(&self.0) {
            *c = *c * a;
        }
        Sh(out)
    }
}

impl<const N: usize, T: Value> Sh<N, T> {
    /// `∫ f(ω) k(ω·d) dω` as a function of `d`: each band times the kernel's factor.
    #[must_use]
    #[inline]
    pub fn convolve(&self, kernel: &Zonal<N, T::Scalar>) -> Self {
        let mut out = *self;
        for (c, &a) in out.0.iter_mut().zip(&kernel.0) {
            *c = *c * a;
        }
        out
    }

    /// Irradiance on a surface with the unit normal `n` in this radiance field: `E(n) = Σ A_l L_lm Y_lm(n)` with the
    /// clamped cosine's `A_l`, in closed form.
    ///
    /// ```
    /// use sh_math::Sh;
    /// let sky = Sh::<9>::constant(1.0);
    /// assert!((sky.irradiance([0.0, 0.0, 1.0]) - core::f32::consts::PI).abs() < 1e-6);
    /// ```
    #[must_use]
    #[inline]
    pub fn irradiance(&self, n: impl Into<[T::Scalar; 3]>) -> T {
        self.weigh_bands(n, &Table::<N>::COSINE)
    }

    /// `∫ f dω` over the hemisphere about the unit direction `n`.
    #[must_use]
    pub fn hemisphere_integral(&self, n: impl Into<[T::Scalar; 3]>) -> T {
        self.weigh_bands(n, &Table::<N>::HEMISPHERE)
    }

    #[inline]
    fn weigh_bands(&self, n: impl Into<[T::Scalar; 3]>, factors: &[f64; N]) -> T {
        let mut w = basis::<N, T::Scalar>(n);
        for (w, &a) in w.iter_mut().zip(factors) {
            *w = *w * T::Scalar::from_f64(a);
        }
        self.weigh(&w)
    }
}
