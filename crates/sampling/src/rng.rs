//! Counter-based random numbers: pure functions of an index, the same integers on CPU and GPU.
//!
//! [`pcg_hash`] and [`hash_combine`] make seeds (from pixel, frame, dimension) and cheap random numbers; [`philox4x32`] is
//! for when quality must be beyond doubt: it passes BigCrush.
//!
//! WGSL twin: `sampling/rng.wgsl`.
//!
//! ```
//! use indirect_sampling::rng::{hash_combine, philox4x32, unit_f32};
//!
//! let pixel_seed = hash_combine(hash_combine(17, 42), 7); // x, y, frame
//! let [a, b, ..] = philox4x32([0, 0, 0, 0], [pixel_seed, 0]).map(unit_f32);
//! assert!((0.0..1.0).contains(&a) && (0.0..1.0).contains(&b));
//! ```

/// A bijective hash of one word: one step and the output permutation of PCG-RXS-M-XS-32 (Jarzynski & Olano 2020, "Hash
/// Functions for GPU Rendering", JCGT 9(3)).
#[must_use]
#[inline]
pub const fn pcg_hash(x: u32) -> u32 {
    let state = x.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// A hash of two words, not symmetric, bijective in each while the other is fixed: no two values of `b` share a result.
#[must_use]
#[inline]
pub const fn hash_combine(a: u32, b: u32) -> u32 {
    pcg_hash(a ^ pcg_hash(b))
}

/// The top 24 bits of `x` as a number in `[0, 1)`, exactly.
#[must_use]
#[inline]
pub const fn unit_f32(x: u32) -> f32 {
    (x >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// The top 53 bits of `x` as a number in `[0, 1)`, exactly.
#[must_use]
#[inline]
pub const fn unit_f64(x: u64) -> f64 {
    (x >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
}

/// Philox-4×32-10: word block `counter` of the stream `key` (Salmon et al. 2011, "Parallel Random Numbers: As Easy as
/// 1, 2, 3", SC'11).
#[must_use]
#[inline]
pub const fn philox4x32(counter: [u32; 4], key: [u32; 2]) -> [u32; 4] {
    let [mut c0, mut c1, mut c2, mut c3] = counter;
    let [mut k0, mut k1] = key;
    let mut round = 0;
    while round < 10 {
        let (p0, p1) = (0xD251_1F53_u64 * c0 as u64, 0xCD9E_8D57_u64 * c2 as u64);
        (c0, c1, c2, c3) = ((p1 >> 32) as u32 ^ c1 ^ k0, p1 as u32, (p0 >> 32) as u32 ^ c3 ^ k1, p0 as u32);
        k0 = k0.wrapping_add(0x9E37_79B9);
        k1 = k1.wrapping_add(0xBB67_AE85);
        round += 1;
    }
    [c0, c1, c2, c3]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The known answers that the authors publish with the generator (Random123, `kat_vectors`).
    #[test]
    fn philox_known_answers() {
        assert_eq!(philox4x32([0; 4], [0; 2]), [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]);
        assert_eq!(
            philox4x32([u32::MAX; 4], [u32::MAX; 2]),
            [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]
        );
        assert_eq!(
            philox4x32([0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344], [0xa409_3822, 0x299f_31d0]),
            [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1]
        );
    }

    /// Largest deviation from one half of the frequency at which flipping an input bit flips an output bit.
    fn avalanche(hash: impl Fn(u32) -> u32) -> f64 {
        let mut worst = 0.0_f64;
        for bit in 0..32 {
            let mut flips = [0_u32; 32];
            for i in 0..4096_u32 {
                let x = i.wrapping_mul(0x9E37_79B9);
                let d = hash(x) ^ hash(x ^ (1 << bit));
                for (k, f) in flips.iter_mut().enumerate() {
                    *f += (d >> k) & 1;
                }
            }
            for f in &flips {
                worst = worst.max((f64::from(*f) / 4096.0 - 0.5).abs());
            }
        }
        worst
    }
    /// 4096 inputs: one standard deviation of a frequency is 1/128; six leave 2e-9 for each of the 1024 pairs of bits,
    /// which philox must meet. One round of pcg is not a perfect mixer; its bound guards against a broken constant.
    #[test]
    fn every_input_bit_reaches_every_output_bit() {
        let six_sigma = 6.0 / 128.0;
        assert!(avalanche(|x| philox4x32([x, 0, 0, 0], [0; 2])[0]) < six_sigma);
        assert!(avalanche(|x| hash_combine(7, x)) < six_sigma);
        assert!(avalanche(|x| hash_combine(x, 7)) < 0.1);
        assert!(avalanche(pcg_hash) < 0.1);
    }

    #[test]
    fn unit_floats_stay_below_one() {
        assert_eq!(unit_f32(0), 0.0);
        assert_eq!(unit_f32(u32::MAX), 1.0 - f32::EPSILON / 2.0);
        assert_eq!(unit_f64(u64::MAX), 1.0 - f64::EPSILON / 2.0);
    }
}
