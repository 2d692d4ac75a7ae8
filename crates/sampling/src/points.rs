//! Point sets without a seed: Hammersley's and the R2 sequence.
//!
//! ```
//! use glam::DVec2;
//! use indirect_sampling::points::{hammersley_2d, r2};
//!
//! assert_eq!(hammersley_2d(3, 8), DVec2::new(3.0 / 8.0, 0.75));
//! assert_eq!(r2(0), DVec2::new(0.5, 0.5));
//! ```

use glam::DVec2;

use crate::{radical::radical_inverse, rng::unit_f64};

/// Point `index` of `count`: `(index/count, Φ₂(index))`. The set has to be known in size beforehand; it is then more even than
/// the start of a sequence. A `count` of 0 counts as 1.
#[must_use]
#[inline]
pub fn hammersley_2d(index: u32, count: u32) -> DVec2 {
    DVec2::new(f64::from(index) / f64::from(count.max(1)), radical_inverse(2, u64::from(index)).to_f64())
}

/// Point `index` of the additive recurrence of the plastic number, `½ + index·(1/g, 1/g²)` modulo 1 with `g³ = g + 1`
/// (Roberts 2018). In 64-bit fixed point, so that no index is too large.
#[must_use]
#[inline]
pub const fn r2(index: u64) -> DVec2 {
    const HALF: u64 = 1 << 63;
    DVec2::new(
        unit_f64(index.wrapping_mul(INVERSE_PLASTIC).wrapping_add(HALF)),
        unit_f64(index.wrapping_mul(INVERSE_PLASTIC_SQUARED).wrapping_add(HALF)),
    )
}

/// ⌊2⁶⁴/g⌋ and ⌊2⁶⁴/g²⌋ for g = 1.32471795724474602596…
const INVERSE_PLASTIC: u64 = 0xC13F_A9A9_02A6_328F;
const INVERSE_PLASTIC_SQUARED: u64 = 0x91E1_0DA5_C79E_7B1C;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hammersley_is_a_net() {
        // 2^m points have one in each 2^-a × 2^-(m-a) box.
        for m in 0..=8 {
            for a in 0..=m {
                let mut seen = vec![false; 1 << m];
                for i in 0..1 << m {
                    let p = hammersley_2d(i, 1 << m);
                    let cell = ((p.x * f64::from(1 << a)) as usize) << (m - a)
                        | (p.y * f64::from(1 << (m - a))) as usize;
                    assert!(!core::mem::replace(&mut seen[cell], true));
                }
            }
        }
    }

    #[test]
    fn r2_constants_are_the_plastic_number() {
        let inverse = unit_f64(INVERSE_PLASTIC);
        assert!((inverse.powi(-3) - inverse.recip() - 1.0).abs() < 1e-15);
        assert!((inverse * inverse - unit_f64(INVERSE_PLASTIC_SQUARED)).abs() < 1e-15);
        // Consecutive points differ by the step, at any index.
        for i in [0, 1 << 24, u64::MAX - 1] {
            let d = r2(i + 1) - r2(i);
            assert!((d.x.rem_euclid(1.0) - inverse).abs() < 1e-15);
        }
    }
}
