//! The vector of coefficients.

use core::ops::{Add, AddAssign, Index, IndexMut, Mul, Neg, Sub};

use crate::basis::basis;
use crate::real::{Real, Value};
use crate::table::Table;

/// A function on the sphere of directions as `N = (l+1)²` coefficients, `f(d) = Σ_i c_i Y_i(d)`.
///
/// `T` is the function's value: `f32`, `f64`, or `Vec3`, `Vec3A`, `Vec4`, `DVec3` for several channels, stored channel
/// next to channel. `N` must be a square, else the program does not compile.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(transparent)]
pub struct Sh<const N: usize, T = f32>(pub [T; N]);

/// `l ≤ 1`: 4 coefficients.
pub type ShL1<T = f32> = Sh<4, T>;
/// `l ≤ 2`: 9 coefficients.
pub type ShL2<T = f32> = Sh<9, T>;
/// `l ≤ 3`: 16 coefficients.
pub type ShL3<T = f32> = Sh<16, T>;
/// `l ≤ 4`: 25 coefficients.
pub type ShL4<T = f32> = Sh<25, T>;

/// The band `l` of coefficient `i = l(l+1) + m`.
#[must_use]
#[inline]
pub const fn band(i: usize) -> usize {
    i.isqrt()
}

impl<const N: usize, T: Value> Default for Sh<N, T> {
    fn default() -> Self {
        Self([T::default(); N])
    }
}

impl<const N: usize, T: Value> Sh<N, T> {
    /// Number of bands, `l + 1`.
    pub const BANDS: usize = Table::<N>::BANDS;

    /// The function that is `value` in every direction.
    #[must_use]
    pub fn constant(value: T) -> Self {
        let mut sh = Self::default();
        // ∫ Y_0 = √(4π)
        sh.0[0] = value * T::Scalar::from_f64(3.544_907_701_811_032);
        sh
    }

    /// The value at the unit direction `d`.
    #[must_use]
    #[inline]
    pub fn evaluate(&self, d: impl Into<[T::Scalar; 3]>) -> T {
        self.weigh(&basis(d))
    }

    /// `Σ_i c_i w_i`: the value where `w` is the basis at a direction, an integral where it is another function's.
    #[must_use]
    #[inline]
    pub fn weigh(&self, w: &[T::Scalar; N]) -> T {
        let mut sum = self.0[0] * w[0];
        for (&c, &w) in self.0.iter().zip(w).skip(1) {
            sum = sum + c * w;
        }
        sum
    }

    /// `∫ f g dω` over the sphere, `g` of one channel.
    #[must_use]
    pub fn dot(&self, g: &Sh<N, T::Scalar>) -> T {
        self.weigh(&g.0)
    }

    /// `∫ f dω` over the sphere.
    #[must_use]
    pub fn integral(&self) -> T {
        self.0[0] * T::Scalar::from_f64(3.544_907_701_811_032)
    }

    /// The mean over the sphere.
    #[must_use]
    pub fn mean(&self) -> T {
        self.0[0] * T::Scalar::from_f64(0.282_094_791_773_878_14)
    }

    /// Adds a sample of the function to its projection: `c_i += weighted·Y_i(d)`, where `weighted` is the value times
    /// the solid angle that the sample stands for (`4π/n` for `n` uniform samples, `1/(n·pdf)` in general).
    #[inline]
    pub fn project_add(&mut self, d: impl Into<[T::Scalar; 3]>, weighted: T) {
        let w = basis::<N, _>(d);
        for (c, w) in self.0.iter_mut().zip(w) {
            *c = *c + weighted * w;
        }
    }

    /// The same function with more bands (zeros) or fewer (the least-squares fit).
    #[must_use]
    pub fn resize<const M: usize>(&self) -> Sh<M, T> {
        let mut out = Sh::default();
        for (to, &from) in out.0.iter_mut().zip(&self.0) {
            *to = from;
        }
        out
    }

    /// One channel, `index < T::CHANNELS`.
    #[must_use]
    pub fn channel(&self, index: usize) -> Sh<N, T::Scalar> {
        Sh(self.0.map(|c| c.channel(index)))
    }

    /// Replaces one channel, `index < T::CHANNELS`.
    pub fn set_channel(&mut self, index: usize, channel: &Sh<N, T::Scalar>) {
        for (to, &from) in self.0.iter_mut().zip(&channel.0) {
            to.set_channel(index, from);
        }
    }

    /// Applies `f` to each channel.
    #[must_use]
    pub fn map_channels(&self, mut f: impl FnMut(Sh<N, T::Scalar>) -> Sh<N, T::Scalar>) -> Self {
        let mut out = *self;
        for index in 0..T::CHANNELS {
            out.set_channel(index, &f(self.channel(index)));
        }
        out
    }

    /// Applies `f` to each coefficient.
    #[must_use]
    pub fn map<U: Value>(&self, f: impl FnMut(T) -> U) -> Sh<N, U> {
        Sh(self.0.map(f))
    }
}

impl<const N: usize, S: Real> Sh<N, S> {
    /// `Σ_m c_lm²` of band `l`: what a rotation keeps. 0 where there is no such band.
    #[must_use]
    pub fn band_energy(&self, l: usize) -> S {
        self.0.iter().skip(l * l).take(2 * l + 1).fold(S::default(), |sum, &c| sum + c * c)
    }
}

impl<const N: usize, T> Index<usize> for Sh<N, T> {
    type Output = T;
    #[inline]
    fn index(&self, i: usize) -> &T {
        &self.0[i]
    }
}

impl<const N: usize, T> IndexMut<usize> for Sh<N, T> {
    #[inline]
    fn index_mut(&mut self, i: usize) -> &mut T {
        &mut self.0[i]
    }
}

impl<const N: usize, T: Value> Add for Sh<N, T> {
    type Output = Self;
    #[inline]
    fn add(mut self, other: Self) -> Self {
        self += other;
        self
    }
}

impl<const N: usize, T: Value> AddAssign for Sh<N, T> {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        for (a, b) in self.0.iter_mut().zip(other.0) {
            *a = *a + b;
        }
    }
}

impl<const N: usize, T: Value> Sub for Sh<N, T> {
    type Output = Self;
    #[inline]
    fn sub(mut self, other: Self) -> Self {
        for (a, b) in self.0.iter_mut().zip(other.0) {
            *a = *a - b;
        }
        self
    }
}

impl<const N: usize, T: Value> Neg for Sh<N, T> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        self * T::Scalar::from_f64(-1.0)
    }
}

impl<const N: usize, T: Value> Mul<T::Scalar> for Sh<N, T> {
    type Output = Self;
    #[inline]
    fn mul(self, factor: T::Scalar) -> Self {
        Self(self.0.map(|c| c * factor))
    }
}
