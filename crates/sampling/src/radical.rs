//! Radical inverses as exact fractions, and their rounding.
//!
//! The radical inverse mirrors the digits of an index at the point: in base 10, 123 becomes 0.321. Here it is a fraction
//! of integers, so that nothing is lost before the one rounding to a float.
//!
//! ```
//! use indirect_sampling::radical::radical_inverse;
//!
//! let x = radical_inverse(10, 123);
//! assert_eq!((x.numerator(), x.denominator()), (321, 1000));
//! assert_eq!(x.to_f64(), 0.321);
//! // Exact far beyond what floats can count.
//! assert_eq!(radical_inverse(2, 1 << 60).to_f64(), 0.5_f64.powi(61));
//! ```

/// A fraction in `[0, 1)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fraction {
    numerator: u128,
    denominator: u128,
}

impl Fraction {
    /// `numerator/denominator`. The caller keeps `numerator < denominator ≤ 2⁹⁶`.
    pub(crate) const fn new(numerator: u128, denominator: u128) -> Self {
        Self { numerator, denominator }
    }

    /// Below [`Self::denominator`]; the two may have common factors.
    #[must_use]
    pub const fn numerator(self) -> u128 {
        self.numerator
    }

    /// Positive, at most 2⁹⁶.
    #[must_use]
    pub const fn denominator(self) -> u128 {
        self.denominator
    }

    /// The nearest number, ties to even; the largest below 1 instead of 1.
    #[must_use]
    #[inline]
    pub fn to_f64(self) -> f64 {
        if self.denominator <= 1 << 53 {
            // Both are exact and IEEE division rounds correctly; 1 − 2⁻⁵³ is a float, so that 1 cannot come out.
            return self.numerator as u64 as f64 / self.denominator as u64 as f64;
        }
        let (mantissa, exponent) = self.round(53);
        (mantissa as f64 * power_of_two(exponent)).min(1.0 - f64::EPSILON / 2.0)
    }

    /// The nearest number, ties to even; the largest below 1 instead of 1.
    #[must_use]
    #[inline]
    pub fn to_f32(self) -> f32 {
        if self.denominator <= 1 << 53 {
            let q = self.numerator as u64 as f64 / self.denominator as u64 as f64;
            // Rounding twice goes wrong only if the first rounding lands on a tie of the second.
            if q.to_bits() & 0x1FFF_FFFF != 0x1000_0000 {
                return (q as f32).min(1.0 - f32::EPSILON / 2.0);
            }
        }
        let (mantissa, exponent) = self.round(24);
        ((mantissa as f64 * power_of_two(exponent)) as f32).min(1.0 - f32::EPSILON / 2.0)
    }

    /// The fraction to `bits` significant bits, as `mantissa·2^exponent`.
    #[cold]
    fn round(self, bits: u32) -> (u64, i32) {
        let (mut rest, denominator) = (self.numerator, self.denominator);
        if rest == 0 {
            return (0, 0);
        }
        let mut exponent = 0;
        while rest < denominator {
            rest *= 2;
            exponent -= 1;
        }
        // rest/denominator is in [1, 2) here: one bit before the point, the others follow by long division.
        rest -= denominator;
        let mut mantissa = 1_u64;
        for _ in 1..bits {
            rest *= 2;
            let bit = rest >= denominator;
            rest -= if bit { denominator } else { 0 };
            mantissa = 2 * mantissa + u64::from(bit);
        }
        rest *= 2;
        let up = rest > denominator || (rest == denominator && mantissa % 2 == 1);
        (mantissa + u64::from(up), exponent - (bits as i32 - 1))
    }
}

/// 2 to a power within the normal range of `f64`.
const fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((1023 + exponent) as u64) << 52)
}

/// The radical inverse of `index` in `base ≥ 2`, exactly. Bases 0 and 1, which have no digits, give 0.
#[must_use]
#[inline]
pub const fn radical_inverse(base: u32, index: u64) -> Fraction {
    if base == 2 {
        let digits = u64::BITS - index.leading_zeros();
        let numerator = if index == 0 { 0 } else { index.reverse_bits() >> (u64::BITS - digits) };
        return Fraction::new(numerator as u128, 1 << digits);
    }
    let (mut numerator, mut denominator) = (0_u128, 1_u128);
    if base < 2 {
        return Fraction::new(numerator, denominator);
    }
    let mut rest = index;
    // In 64 bits as long as they suffice.
    let (mut n, mut d) = (0_u64, 1_u64);
    while rest > 0 && d <= u64::MAX / base as u64 {
        n = n * base as u64 + rest % base as u64;
        d *= base as u64;
        rest /= base as u64;
    }
    (numerator, denominator) = (numerator + n as u128, denominator * d as u128);
    while rest > 0 {
        numerator = numerator * base as u128 + (rest % base as u64) as u128;
        denominator *= base as u128;
        rest /= base as u64;
    }
    Fraction::new(numerator, denominator)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn rounding_at_the_edges() {
        // The largest index whose inverse has all digits b − 1 is nearest to 1.
        for base in [2_u32, 3, 7, 10, 65_521, u32::MAX] {
            let mut index = u64::from(base) - 1;
            while let Some(next) =
                index.checked_mul(u64::from(base)).and_then(|i| i.checked_add(u64::from(base) - 1))
            {
                let x = radical_inverse(base, index);
                assert!(x.to_f32() < 1.0 && x.to_f64() < 1.0);
                index = next;
            }
        }
        assert_eq!(radical_inverse(3, 0).to_f32(), 0.0);
        // 2⁻²⁵ above and below a tie between two floats, with a denominator that needs the slow path.
        let tie = (1_u128 << 24) + 1; // over 2^25: halfway between 2^24/2^25 and its successor
        let at = |n: u128| Fraction::new(n, 1 << 55).to_f32();
        assert_eq!(at(tie << 30), 0.5);
        assert_eq!(at((tie << 30) + 1), 0.5_f32.next_up());
        assert_eq!(at((tie << 30) - 1), 0.5);
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 8192, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn base_two_is_bit_reversal(index: u64) {
            let x = radical_inverse(2, index);
            let digits = x.denominator().trailing_zeros();
            prop_assert_eq!(x.numerator() << (64 - digits), u128::from(index.reverse_bits()));
            if index < 1 << 53 {
                prop_assert_eq!(x.to_f64(), index.reverse_bits() as f64 / 18_446_744_073_709_551_616.0);
            }
        }

        #[test]
        fn mirroring_twice_gives_the_index_back(base in 2_u32..=u32::MAX, index: u64) {
            let x = radical_inverse(base, index);
            let (mut n, mut d, mut back) = (x.numerator(), x.denominator(), 0_u128);
            while d > 1 {
                back = back * u128::from(base) + n % u128::from(base);
                n /= u128::from(base);
                d /= u128::from(base);
            }
            prop_assert_eq!(back, u128::from(index));
            prop_assert!(x.numerator() < x.denominator() && x.denominator() <= 1 << 96);
        }

        /// `f = m/2ˢ` is within half an ulp of `n/d`: `2·|m·d − n·2ˢ| ≤ d`, in integers.
        #[test]
        fn rounding_is_to_nearest(d in 2_u64..1 << 53, share in 0.0_f64..1.0) {
            let n = ((d as f64 * share) as u64).clamp(1, d - 1);
            for (n, d) in [(n, d), (n, d | 1 << 52)] {
                let f = Fraction::new(u128::from(n), u128::from(d)).to_f32();
                let (m, s) = (u128::from(f.to_bits() & 0x7F_FFFF | 0x80_0000), 150 - (f.to_bits() >> 23));
                prop_assert!(f == 1.0 - f32::EPSILON / 2.0 || 2 * (m * u128::from(d)).abs_diff(u128::from(n) << s) <= u128::from(d));
            }
        }
    }
}
