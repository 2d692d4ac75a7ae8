//! The numbers a spherical harmonic is made of: scalars, and values that scalars weigh.

use core::fmt::Debug;
use core::ops::{Add, Mul, Neg, Sub};

use glam::{DMat3, DVec3, Mat3, Vec3, Vec3A, Vec4};

use crate::table::Table;

#[cfg(not(any(feature = "std", feature = "libm")))]
compile_error!("sh-math needs floating-point functions: enable the feature `std` (default) or `libm`");

/// Floating-point functions that `core` lacks, in f64.
pub(crate) mod float {
    macro_rules! functions {
        ($($name:ident / $libm:ident ($($arg:ident),*);)*) => {$(
            #[cfg(feature = "std")]
            #[inline]
            pub(crate) fn $name($($arg: f64),*) -> f64 { f64::$name($($arg),*) }
            #[cfg(not(feature = "std"))]
            #[inline]
            pub(crate) fn $name($($arg: f64),*) -> f64 { libm::$libm($($arg),*) }
        )*};
    }
    functions! { sqrt / sqrt(x); sin / sin(x); cos / cos(x); atan2 / atan2(y, x); }
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// A scalar: `f32` or `f64`. Sealed.
pub trait Real:
    sealed::Sealed
    + Value<Scalar = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
    + PartialOrd
    + Into<f64>
    + Send
    + Sync
    + 'static
{
    /// A 3×3 matrix of this scalar.
    type Mat3: Copy;
    /// The least increment above 1.
    const EPSILON: Self;
    /// The scalar nearest to `x`.
    fn from_f64(x: f64) -> Self;
    /// Square root.
    #[must_use]
    fn sqrt(self) -> Self;
    /// The matrix in f64.
    fn matrix(m: &Self::Mat3) -> DMat3;
    /// Constants of the Legendre recurrence.
    #[doc(hidden)]
    fn recurrence<const N: usize>() -> &'static [[Self; 2]; N];
    /// Constants of the gradient.
    #[doc(hidden)]
    fn lowering<const N: usize>() -> &'static [[Self; 3]; N];
}

impl Real for f32 {
    type Mat3 = Mat3;
    const EPSILON: Self = Self::EPSILON;
    #[inline]
    fn from_f64(x: f64) -> Self {
        x as Self
    }
    #[inline]
    fn sqrt(self) -> Self {
        #[cfg(feature = "std")]
        return Self::sqrt(self);
        #[cfg(not(feature = "std"))]
        return libm::sqrtf(self);
    }
    fn matrix(m: &Mat3) -> DMat3 {
        m.as_dmat3()
    }
    #[inline]
    fn recurrence<const N: usize>() -> &'static [[Self; 2]; N] {
        &Table::<N>::F32
    }
    #[inline]
    fn lowering<const N: usize>() -> &'static [[Self; 3]; N] {
        &Table::<N>::LOWERING_F32
    }
}

impl Real for f64 {
    type Mat3 = DMat3;
    const EPSILON: Self = Self::EPSILON;
    #[inline]
    fn from_f64(x: f64) -> Self {
        x
    }
    #[inline]
    fn sqrt(self) -> Self {
        float::sqrt(self)
    }
    fn matrix(m: &DMat3) -> DMat3 {
        *m
    }
    #[inline]
    fn recurrence<const N: usize>() -> &'static [[Self; 2]; N] {
        &Table::<N>::F64
    }
    #[inline]
    fn lowering<const N: usize>() -> &'static [[Self; 3]; N] {
        &Table::<N>::LOWERING_F64
    }
}

/// What a function on the sphere may return: a scalar, or several channels of one (`Vec3` for RGB).
pub trait Value:
    Copy
    + Default
    + PartialEq
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Self::Scalar, Output = Self>
{
    /// The scalar of each channel.
    type Scalar: Real;
    /// Number of channels.
    const CHANNELS: usize;
    /// One channel, `index < CHANNELS`.
    fn channel(self, index: usize) -> Self::Scalar;
    /// Replaces one channel, `index < CHANNELS`.
    fn set_channel(&mut self, index: usize, value: Self::Scalar);
}

macro_rules! scalar_value {
    ($($t:ty),*) => {$(
        impl Value for $t {
            type Scalar = $t;
            const CHANNELS: usize = 1;
            #[inline]
            fn channel(self, _: usize) -> $t { self }
            #[inline]
            fn set_channel(&mut self, _: usize, value: $t) { *self = value; }
        }
    )*};
}
scalar_value!(f32, f64);

macro_rules! vector_value {
    ($($t:ty: $s:ty, $n:literal;)*) => {$(
        impl Value for $t {
            type Scalar = $s;
            const CHANNELS: usize = $n;
            #[inline]
            fn channel(self, index: usize) -> $s { self[index] }
            #[inline]
            fn set_channel(&mut self, index: usize, value: $s) { self[index] = value; }
        }
    )*};
}
vector_value! { Vec3: f32, 3; Vec3A: f32, 3; Vec4: f32, 4; DVec3: f64, 3; }
