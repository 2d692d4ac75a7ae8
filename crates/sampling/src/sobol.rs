//! The two-dimensional Sobol' sequence with hash-based Owen scrambling, padded to any dimension by seeds.
//!
//! Each seed gives one 2-D sequence, shuffled and scrambled on its own (the scheme of Burley 2020, "Practical Hash-based
//! Owen Scrambling", JCGT 9(4), with a cheaper scrambling of the same variance): every aligned block of `2^m` indices is a (0, m, 2)-net, so that all its elementary boxes
//! hold the same number of points, and different seeds are independent. A renderer takes one seed per pixel and pair of
//! dimensions, and the sample number as index.
//!
//! The whole range of `u32` indices may be used; results have 24 bits. The first dimension is the bit reversal of the
//! index, the second its product with Pascal's triangle modulo 2, which takes five shifted exclusive ors: no tables.
//!
//! WGSL twin: `sampling/sobol.wgsl`.
//!
//! ```
//! use indirect_sampling::sobol;
//!
//! // The first 16 points put one into each cell of the 4×4 grid, and of the 16×1, 8×2, 2×8 and 1×16 grids.
//! let mut cells = [0; 16];
//! for i in 0..16 {
//!     let p = sobol::sample_2d(i, 1234) * 4.0;
//!     cells[p.y as usize * 4 + p.x as usize] += 1;
//! }
//! assert_eq!(cells, [1; 16]);
//! ```

use glam::{DVec2, Vec2};

use crate::rng::{pcg_hash, unit_f32};

/// Point `index` of the scrambled 2-D Sobol' sequence of `seed`, in `[0, 1)²`.
///
/// The seed is hashed here, so that counters will do: `pixel_seed + dimension` is fine where `pixel_seed` is a hash.
#[must_use]
#[inline]
pub fn sample_2d(index: u32, seed: u32) -> Vec2 {
    let [x, y] = bits_2d(index, seed);
    Vec2::new(unit_f32(x), unit_f32(y))
}

/// Point `index` of the scrambled 1-D sequence of `seed` (van der Corput, base 2), in `[0, 1)`: every aligned block of
/// `2^m` indices has one point in each of `2^m` equal intervals.
///
/// This is the first coordinate of [`sample_2d`]: give it a seed of its own.
#[must_use]
#[inline]
pub fn sample_1d(index: u32, seed: u32) -> f32 {
    let seeds = Seeds::new(seed);
    unit_f32(scramble(shuffle(index, &seeds), seeds.x).reverse_bits())
}

/// [`sample_2d`] with all 32 bits, which double precision holds exactly.
#[must_use]
#[inline]
pub fn sample_2d_f64(index: u32, seed: u32) -> DVec2 {
    let [x, y] = bits_2d(index, seed);
    DVec2::new(f64::from(x), f64::from(y)) / 4_294_967_296.0
}

/// [`sample_2d`] as 32-bit fixed point fractions.
#[must_use]
#[inline]
pub fn bits_2d(index: u32, seed: u32) -> [u32; 2] {
    let seeds = Seeds::new(seed);
    let i = shuffle(index, &seeds);
    // The first coordinate reads the index from its last bit on, and so does the scrambling: no reversal in between.
    let (x, y) = (scramble(i, seeds.x), scramble(pascal(i), seeds.y));
    // One reversal for both.
    let both = ((u64::from(x) << 32) | u64::from(y)).reverse_bits();
    [both as u32, (both >> 32) as u32]
}

/// The bit-reversed second Sobol' coordinate of `index`: bit `j` is the parity of the index bits `k` with `C(k, j)` odd.
#[inline]
const fn pascal(index: u32) -> u32 {
    let mut x = index;
    x ^= (x & 0xAAAA_AAAA) >> 1;
    x ^= (x & 0xCCCC_CCCC) >> 2;
    x ^= (x & 0xF0F0_F0F0) >> 4;
    x ^= (x & 0xFF00_FF00) >> 8;
    x ^ (x >> 16)
}

/// Nested uniform scrambling of a bit-reversed fraction: an operation in which bits only ever change bits above them.
///
/// `s·x + t` modulo 2³² with a random odd `s` and a random `t` already gives every pair of points the joint distribution
/// of Owen's scrambling, hence its variance: if two points first differ in bit `k`, their difference `2ᵏ·odd` times `s`
/// is uniform over all such differences, and `t` makes the first of them uniform. The fixed products before and
/// after (Laine & Karras 2011, even factors of Vegdahl 2021) keep that, and break up the lattice that `s` and `t` would leave.
#[inline]
const fn scramble(x: u32, [s, t]: [u32; 2]) -> u32 {
    let x = x ^ x.wrapping_mul(0x53a2_2864);
    let x = x.wrapping_mul(s | 1).wrapping_add(t);
    x ^ x.wrapping_mul(0x0552_6c56)
}

/// The index, permuted so that aligned blocks of `2^m` go to aligned blocks: an Owen scrambling of its bits from the top.
#[inline]
const fn shuffle(index: u32, seeds: &Seeds) -> u32 {
    let [s, t] = seeds.index;
    let x = index.reverse_bits().wrapping_mul(s | 1).wrapping_add(t);
    (x ^ x.wrapping_mul(0x53a2_2864)).reverse_bits()
}

/// Factors and terms of [`scramble`] for the index and the two coordinates. Their low bits, which decide most, are
/// disjoint parts of one hash.
struct Seeds {
    index: [u32; 2],
    x: [u32; 2],
    y: [u32; 2],
}

impl Seeds {
    #[inline]
    const fn new(seed: u32) -> Self {
        let h = pcg_hash(seed);
        Self {
            index: [h.wrapping_mul(0x9E37_79B5), h.rotate_left(5).wrapping_mul(0x85EB_CA6B)],
            x: [h.rotate_left(11).wrapping_mul(0xC2B2_AE35), h.rotate_left(16).wrapping_mul(0x27D4_EB2F)],
            y: [h.rotate_left(21).wrapping_mul(0x1656_67B1), h.rotate_left(27).wrapping_mul(0xD3A2_646D)],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn double_precision_holds_all_bits() {
        for i in 0..10_000 {
            let ([x, y], p) = (bits_2d(i, 77), sample_2d_f64(i, 77));
            assert_eq!([p.x, p.y].map(|c| (c * 4_294_967_296.0) as u64), [x.into(), y.into()]);
            let near = (p.as_vec2() - sample_2d(i, 77)).abs().max_element();
            // Single precision drops the last eight bits.
            assert!(near <= f32::EPSILON / 2.0, "{i}");
        }
    }

    #[test]
    fn pascal_is_pascals_triangle_modulo_two() {
        for k in 0..32_u32 {
            let expected = (0..32_u32).filter(|j| j & k == *j).fold(0, |m, j| m | 1 << j); // C(k, j) odd, by Lucas
            assert_eq!(pascal(1 << k), expected);
        }
    }

    /// Every aligned block of 2^m points has one point in each of the boxes 2^-a × 2^-(m−a).
    #[test]
    fn aligned_blocks_are_nets() {
        for seed in 0..64_u32 {
            for m in 0..=10_u32 {
                let start = pcg_hash(seed ^ m) >> m << m;
                for a in 0..=m {
                    let mut seen = vec![false; 1 << m];
                    for i in 0..1 << m {
                        let [x, y] = bits_2d(start + i, seed);
                        let cell = (u64::from(x) >> (32 - a) << (m - a)) | (u64::from(y) >> (32 - (m - a)));
                        assert!(
                            !core::mem::replace(&mut seen[cell as usize], true),
                            "seed {seed} m {m} a {a}"
                        );
                    }
                }
            }
        }
    }
}
