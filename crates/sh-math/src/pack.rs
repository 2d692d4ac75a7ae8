//! Coefficients as IEEE half floats.

use half::f16;

use crate::real::Value;
use crate::sh::Sh;

/// SH coefficients of one channel in half floats with one power of two as a common scale: `2N + 4` bytes.
///
/// Unpacked coefficient `i` is within `2⁻¹¹·|c_i| + 2⁻³⁹·max_j |c_j|` of the original, at any brightness: half a half
/// float's ulp, and half its least subnormal once the largest coefficient is scaled to `[2¹⁴, 2¹⁵)`. Without the scale,
/// values above 65 504 would become infinite and the least ones lose their digits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PackedSh<const N: usize> {
    /// A power of two.
    pub scale: f32,
    /// Coefficients in units of `scale`.
    pub coefficients: [f16; N],
}

impl<const N: usize> PackedSh<N> {
    /// Packs; a coefficient that is not finite makes them all 0, so that it does not spread.
    #[must_use]
    pub fn new(sh: &Sh<N, f32>) -> Self {
        let largest = sh.0.iter().fold(0.0_f32, |a, c| a.max(c.abs()));
        if !(largest > 0.0 && sh.0.iter().all(|c| c.is_finite())) {
            return Self { scale: 1.0, coefficients: [f16::ZERO; N] };
        }
        // 2^(exponent − 14), kept inside the normal numbers.
        let exponent = (largest.to_bits() >> 23).clamp(15, 254);
        let scale = f32::from_bits((exponent - 14) << 23);
        Self { scale, coefficients: sh.0.map(|c| f16::from_f32(c / scale)) }
    }

    /// The coefficients again.
    #[must_use]
    pub fn unpack(&self) -> Sh<N, f32> {
        Sh(self.coefficients.map(|c| c.to_f32() * self.scale))
    }
}

impl<const N: usize, T: Value<Scalar = f32>> Sh<N, T> {
    /// The values that an `f16` buffer or texture keeps of these coefficients, without a scale. Values beyond ±65 504 become ±65 504 and
    /// not-a-number 0, where the plain conversion makes an infinity that later sums spread. Error: `2⁻¹¹·|c_i| + 2⁻²⁵`
    /// within the range.
    #[must_use]
    pub fn saturate_to_f16(&self) -> Self {
        let mut out = *self;
        for c in &mut out.0 {
            for channel in 0..T::CHANNELS {
                let value = c.channel(channel);
                let value = if value.is_nan() { 0.0 } else { value.clamp(-65_504.0, 65_504.0) };
                c.set_channel(channel, f16::from_f32(value).to_f32());
            }
        }
        out
    }
}
