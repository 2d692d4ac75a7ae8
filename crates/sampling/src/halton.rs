//! The Halton sequence: radical inverses in prime bases, scrambled.
//!
//! In high bases the plain sequence is useless until it has run through a few multiples of the base: coordinates of
//! neighbouring bases rise together. Scrambling permutes digits, which keeps the stratification (every aligned block of `b^m`
//! indices has one point in each of `b^m` equal intervals) and breaks that up:
//!
//! ![Bases 59 and 61, first 256 points: plain, Faure, Owen](https://raw.githubusercontent.com/indirect-gi/indirect/main/docs/images/halton_scrambling.png)
//!
//! | [`Scrambling`] | what | use |
//! |---|---|---|
//! | `None` | the classical sequence | comparisons |
//! | `Faure` | one fixed permutation per base (Faure 1992) | deterministic point sets |
//! | `Owen(seed)` | random, a different one per seed | error estimates, one per pixel |
//!
//! `Owen` multiplies the index by a random unit and adds a random number modulo a power of the base, and then applies
//! Faure's permutation. Two indices that first differ in digit `k` differ by `bᵏ·unit` before and by a uniformly random `bᵏ·unit`
//! after it, at a uniformly random place: the joint distribution of every pair of points is that of Owen's nested scrambling
//! (1995), and so is the variance of every integral, at the cost of one multiplication.
//!
//! WGSL twin of `None` and `Faure`: `sampling/halton.wgsl`.
//!
//! ```
//! use indirect_sampling::halton::{Halton, Scrambling};
//!
//! let (x, y) = (Halton::dimension(16, Scrambling::Owen(7)), Halton::dimension(17, Scrambling::Owen(7)));
//! assert_eq!((x.base(), y.base()), (59, 61));
//! // Any index at once, or all in turn, every third for example.
//! let fifth = x.sample(12);
//! assert_eq!(x.iter(0, 3).nth(4), Some(fifth));
//! ```

use alloc::sync::Arc;

use crate::{
    radical::Fraction,
    rng::{hash_combine, pcg_hash, philox4x32},
};

/// Number of dimensions.
pub const DIMENSIONS: usize = 256;

/// The first primes, the base of each dimension.
pub const PRIMES: [u16; DIMENSIONS] = primes();

const fn primes() -> [u16; DIMENSIONS] {
    let mut primes = [2; DIMENSIONS];
    let (mut count, mut candidate) = (1, 3_u16);
    while count < DIMENSIONS {
        let mut i = 0;
        while i < count && candidate % primes[i] != 0 {
            i += 1;
        }
        if i == count {
            primes[count] = candidate;
            count += 1;
        }
        candidate += 2;
    }
    primes
}

/// How digits are permuted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Scrambling {
    /// Not at all.
    None,
    /// By Faure's permutation of the base.
    Faure,
    /// As Owen does, at random by this seed.
    Owen(u32),
}

/// Faure's permutation of the digits of `base`: `digit < base` to its image (Faure 1992, "Good Permutations for Extreme
/// Discrepancy", Journal of Number Theory 42).
#[must_use]
pub const fn faure_permutation(base: u32, digit: u32) -> u32 {
    let (mut base, mut digit) = (base, digit);
    // Steps of the recursion that are still to be applied to the result, the last one first: bit pairs of kind and value.
    let (mut kinds, mut odd_bases, mut depth) = (0_u64, [0_u32; 64], 0);
    while base > 2 {
        if base % 2 == 1 {
            let middle = base / 2;
            if digit == middle {
                // The middle digit stays.
                break;
            }
            digit -= (digit > middle) as u32;
            odd_bases[depth] = middle;
            base -= 1;
        } else {
            let half = base / 2;
            kinds |= ((digit >= half) as u64) << depth;
            digit %= half;
            base = half;
        }
        depth += 1;
    }
    while depth > 0 {
        depth -= 1;
        let middle = odd_bases[depth];
        digit = if middle > 0 {
            digit + (digit >= middle) as u32
        } else {
            2 * digit + (kinds >> depth & 1) as u32
        };
    }
    digit
}

/// One coordinate of a Halton sequence.
///
/// Coordinates are fractions `n/bᵏ`, `k` the most digits with `bᵏ ≤ 2³²`. They are exact below the index `bᵏ`, the period,
/// and repeat from there on, as the index's further digits, which would add less than `b⁻ᵏ`, are left out. Base 2 repeats after
/// 2³² points, base 257 after 257³ ≈ 2²⁴·⁰¹, the shortest period; there every point is drawn once more. Where that
/// matters, [`radical_inverse`](crate::radical::radical_inverse) keeps all digits.
#[derive(Debug, Clone)]
pub struct Halton {
    base: u32,
    dimension: u32,
    /// Permuted and mirrored digits of every number below the block, a power of the base.
    table: Arc<[u32]>,
    /// ⌊2⁶⁴/block⌋ + 1.
    reciprocal: u64,
    /// How many blocks make an index.
    blocks: u32,
    /// The block to the power of `blocks`, and of `blocks − 1`.
    period: u64,
    highs: u64,
    inverse_period: f64,
    factor: u64,
    term: u64,
    random: bool,
}

impl Halton {
    /// Largest table.
    const MAX_BLOCK: u32 = 2048;

    /// Coordinate number `dimension`, in base [`PRIMES`]`[dimension]`. Dimensions repeat after [`DIMENSIONS`]; with
    /// [`Scrambling::Owen`] they are scrambled anew, each on its own.
    #[must_use]
    pub fn dimension(dimension: usize, scrambling: Scrambling) -> Self {
        let base = u32::from(PRIMES[dimension % DIMENSIONS]);
        let (block, blocks) = Self::division(base);
        let period = u64::from(block).pow(blocks);
        let permute =
            |digit| if scrambling == Scrambling::None { digit } else { faure_permutation(base, digit) };
        let table = (0..block).map(|i| {
            let (mut rest, mut size, mut mirrored) = (i, 1, 0);
            while size < block {
                mirrored = mirrored * base + permute(rest % base);
                rest /= base;
                size *= base;
            }
            mirrored
        });
        let (factor, term) = match scrambling {
            Scrambling::Owen(seed) => Self::random_affine(base, period, dimension as u32, seed),
            _ => (1, 0),
        };
        Self {
            base,
            dimension: dimension as u32,
            table: table.collect(),
            reciprocal: u64::MAX / u64::from(block) + 1,
            blocks,
            period,
            highs: period / u64::from(block),
            inverse_period: 1.0 / period as f64,
            factor,
            term,
            random: matches!(scrambling, Scrambling::Owen(_)),
        }
    }

    /// The same coordinate with another seed of [`Scrambling::Owen`], what [`Halton::dimension`] makes of it, without
    /// building the table again: one per pixel, say. `None` where the scrambling is another.
    #[must_use]
    pub fn with_seed(&self, seed: u32) -> Option<Self> {
        if !self.random {
            return None;
        }
        let (factor, term) = Self::random_affine(self.base, self.period, self.dimension, seed);
        Some(Self { factor, term, ..self.clone() })
    }

    /// The block, and how many of them make a period: as many digits as fit 32 bits, in as few blocks as tables allow.
    fn division(base: u32) -> (u32, u32) {
        let digits = u32::MAX.ilog(base) + u32::from(base == 2);
        let whole = |per_block: &u32| digits / per_block * per_block;
        let per_block = (1..=Self::MAX_BLOCK.ilog(base)).max_by_key(whole).unwrap_or(1);
        (base.pow(per_block), digits / per_block)
    }

    /// A unit and a number modulo `period`, uniformly to within 2⁻³².
    fn random_affine(base: u32, period: u64, dimension: u32, seed: u32) -> (u64, u64) {
        let below = |words: [u32; 2], n: u64| {
            let word = u64::from(words[0]) << 32 | u64::from(words[1]);
            ((u128::from(word) * u128::from(n)) >> 64) as u64
        };
        let seed = hash_combine(seed, pcg_hash(dimension));
        let [a, b, c, d] = philox4x32([0, 0, 0, 0], [seed, base]);
        // Units are the numbers whose last digit is not 0.
        let unit = below([a, b], period / u64::from(base) * (u64::from(base) - 1));
        let (rest, last) = (unit / (u64::from(base) - 1), unit % (u64::from(base) - 1));
        (rest * u64::from(base) + last + 1, below([c, d], period))
    }

    /// The base.
    #[must_use]
    pub const fn base(&self) -> u32 {
        self.base
    }

    /// The scrambled place of an index in the sequence.
    #[inline]
    fn place(&self, index: u64) -> u64 {
        let index = if index < self.period { index } else { index % self.period };
        // Both factors are below 2³² and the term is below it too: 2⁶⁴ is not reached.
        if self.factor == 1 { index } else { (index * self.factor + self.term) % self.period }
    }

    /// Quotient and remainder of a 32-bit number by the block.
    #[inline]
    fn divide(&self, n: u64) -> (u64, u64) {
        // Exact for 32-bit numbers and a reciprocal of 64 bits (Granlund & Montgomery 1994).
        let quotient = ((u128::from(n) * u128::from(self.reciprocal)) >> 64) as u64;
        (quotient, n - quotient * self.table.len() as u64)
    }

    /// Mirrored and permuted digits of `rest`, `blocks` blocks of them.
    #[inline]
    fn mirror(&self, mut rest: u64, blocks: u32) -> u64 {
        let mut mirrored = 0;
        for _ in 0..blocks {
            let (quotient, remainder) = self.divide(rest);
            mirrored = mirrored * self.table.len() as u64 + u64::from(self.table[remainder as usize]);
            rest = quotient;
        }
        mirrored
    }

    /// `numerator` over the period, to nearest.
    #[inline]
    fn round(&self, numerator: u64) -> f32 {
        // Two roundings, of the inverse and of the product: 2 ulp at most. Rounding once more to f32 is right unless a tie lies
        // within them; the fraction decides then.
        let product = numerator as f64 * self.inverse_period;
        if (product.to_bits() & 0x1FFF_FFFF).abs_diff(0x1000_0000) > 2 {
            (product as f32).min(1.0 - f32::EPSILON / 2.0)
        } else {
            Fraction::new(u128::from(numerator), u128::from(self.period)).to_f32()
        }
    }

    /// Coordinate of point `index`, exactly.
    #[must_use]
    #[inline]
    pub fn fraction(&self, index: u64) -> Fraction {
        Fraction::new(u128::from(self.mirror(self.place(index), self.blocks)), u128::from(self.period))
    }

    /// Coordinate of point `index`, in `[0, 1)`, rounded to nearest.
    #[must_use]
    #[inline]
    pub fn sample(&self, index: u64) -> f32 {
        self.round(self.mirror(self.place(index), self.blocks))
    }

    /// [`Self::sample`] rounded to double precision.
    #[must_use]
    #[inline]
    pub fn sample_f64(&self, index: u64) -> f64 {
        self.fraction(index).to_f64()
    }

    /// Coordinates of the points `start`, `start + leap`, …
    pub fn iter(&self, start: u64, leap: u64) -> Iter<'_> {
        let step =
            (u128::from(leap % self.period) * u128::from(self.factor) % u128::from(self.period)) as u64;
        let ((high, low), (step_high, step_low)) = (self.divide(self.place(start)), self.divide(step));
        let mirrored = self.mirror(high, self.blocks - 1);
        Iter { halton: self, low, high, mirrored, step_low, step_high }
    }
}

/// Iterator over a [`Halton`] coordinate; endless.
#[derive(Debug, Clone)]
pub struct Iter<'a> {
    halton: &'a Halton,
    /// The place, as remainder and quotient by the block, and the quotient mirrored.
    low: u64,
    high: u64,
    mirrored: u64,
    step_low: u64,
    step_high: u64,
}

impl Iterator for Iter<'_> {
    type Item = f32;

    #[inline]
    fn next(&mut self) -> Option<f32> {
        let halton = self.halton;
        let numerator = u64::from(halton.table[self.low as usize]) * halton.highs + self.mirrored;
        self.low += self.step_low;
        let carry = self.low >= halton.table.len() as u64;
        if carry {
            self.low -= halton.table.len() as u64;
        }
        if carry || self.step_high > 0 {
            self.high += self.step_high + u64::from(carry);
            if self.high >= halton.highs {
                self.high -= halton.highs;
            }
            self.mirrored = halton.mirror(self.high, halton.blocks - 1);
        }
        Some(halton.round(numerator))
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (usize::MAX, None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radical::radical_inverse;
    use alloc::vec::Vec;
    use proptest::prelude::*;

    #[test]
    fn double_precision_is_the_fraction_rounded_once() {
        for dimension in [0, 1, 5, 30] {
            let sequence = Halton::dimension(dimension, Scrambling::None);
            for index in [0, 1, 2, 12_345, 987_654_321] {
                let (x, f) = (sequence.sample_f64(index), sequence.fraction(index));
                // numerator = x · denominator to half an ulp of x, in integers: both sides times 2⁵³ fit 192 bits, here 2⁷⁴ do.
                if f.denominator() <= 1 << 53 {
                    assert_eq!(x, f.numerator() as f64 / f.denominator() as f64);
                }
                let exact = (x * 9_007_199_254_740_992.0) as u128;
                let scaled = f.numerator() << 53;
                let off = scaled.abs_diff(exact * f.denominator());
                assert!(off <= f.denominator(), "{dimension} {index}");
                assert!((x as f32 - sequence.sample(index)).abs() <= f32::EPSILON * 0.5);
            }
        }
    }

    #[test]
    fn faure_permutations_as_published() {
        // Faure 1992, and Owen's table: bases 2 to 8.
        let expected: [&[u32]; 7] = [
            &[0, 1],
            &[0, 1, 2],
            &[0, 2, 1, 3],
            &[0, 3, 2, 1, 4],
            &[0, 2, 4, 1, 3, 5],
            &[0, 2, 5, 3, 1, 4, 6],
            &[0, 4, 2, 6, 1, 5, 3, 7],
        ];
        for (base, expected) in (2..).zip(expected) {
            let found: Vec<_> = (0..base).map(|d| faure_permutation(base, d)).collect();
            assert_eq!(found, expected, "base {base}");
        }
    }

    #[test]
    fn every_base_has_a_period_of_24_to_32_bits() {
        for d in 0..DIMENSIONS {
            let h = Halton::dimension(d, Scrambling::None);
            assert!((1 << 24..=1 << 32).contains(&h.period), "base {}", h.base);
            assert_eq!(h.period, u64::from(h.base).pow(h.period.ilog(u64::from(h.base))));
        }
    }

    /// The prefix property: in every base, every aligned block of bᵐ indices puts one point into each interval of length
    /// b⁻ᵐ, wherever the block lies.
    #[test]
    fn aligned_blocks_fill_elementary_intervals() {
        for d in 0..DIMENSIONS {
            for scrambling in [Scrambling::None, Scrambling::Faure, Scrambling::Owen(d as u32)] {
                let h = Halton::dimension(d, scrambling);
                let mut size = u64::from(h.base);
                while size <= 4096 {
                    let start = 7_u64.wrapping_mul(u64::MAX / 11) / size * size;
                    let start = if start > u64::MAX - size { 0 } else { start };
                    let mut seen = vec![false; size as usize];
                    for i in start..start + size {
                        let interval = h.fraction(i).numerator() as u64 / (h.period / size);
                        assert!(!core::mem::replace(&mut seen[interval as usize], true), "base {}", h.base);
                    }
                    size *= u64::from(h.base);
                }
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 4096, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn plain_halton_is_the_radical_inverse(dimension in 0..DIMENSIONS, index: u64) {
            let h = Halton::dimension(dimension, Scrambling::None);
            let index = index % h.period;
            let (x, y) = (h.fraction(index), radical_inverse(h.base(), index));
            prop_assert_eq!(x.numerator() * y.denominator(), y.numerator() * x.denominator());
        }

        #[test]
        fn a_seed_is_exchanged(dimension in 0..3 * DIMENSIONS, index: u64, first: u32, seed: u32) {
            let h = Halton::dimension(dimension, Scrambling::Owen(first)).with_seed(seed);
            let expected = Halton::dimension(dimension, Scrambling::Owen(seed)).fraction(index);
            prop_assert_eq!(h.map(|h| h.fraction(index)), Some(expected));
            prop_assert!(Halton::dimension(dimension, Scrambling::Faure).with_seed(seed).is_none());
        }

        #[test]
        fn points_repeat_after_the_period(dimension in 0..DIMENSIONS, index: u32, times in 0_u64..1 << 20, seed: u32) {
            let h = Halton::dimension(dimension, Scrambling::Owen(seed));
            let index = u64::from(index) % h.period;
            prop_assert_eq!(h.fraction(index), h.fraction(index + times * h.period));
        }

        #[test]
        fn samples_are_the_nearest_floats(dimension in 0..DIMENSIONS, numerator: u64) {
            let h = Halton::dimension(dimension, Scrambling::None);
            // Any numerator, and those nearest to ties, 2²⁵ths of odd number.
            let odd = u128::from(numerator) % (1 << 24) * 2 + 1;
            let tie = ((odd * u128::from(h.period)) >> 25) as u64;
            for n in [numerator % h.period, tie, (tie + 1).min(h.period - 1)] {
                prop_assert_eq!(h.round(n), Fraction::new(u128::from(n), u128::from(h.period)).to_f32());
            }
        }

        #[test]
        fn iterator_is_random_access(dimension in 0..DIMENSIONS, start: u64, leap in 0_u64..1 << 40, seed: u32) {
            let start = start >> 2;
            for scrambling in [Scrambling::None, Scrambling::Faure, Scrambling::Owen(seed)] {
                let h = Halton::dimension(dimension, scrambling);
                for (i, x) in (0..20).zip(h.iter(start, leap)) {
                    prop_assert_eq!(x, h.sample(start + i * leap));
                }
            }
        }
    }
}
