//! Prefix sums, stable sorting by key and compaction: the twins of `shaders/wgsl/sort/*.wgsl`.
//!
//! ```
//! use indirect_core::sort::{compact, exclusive_scan, radix_sort_pairs};
//!
//! let mut lengths = [3, 0, 2];
//! assert_eq!(exclusive_scan(&mut lengths), 5);
//! assert_eq!(lengths, [0, 3, 3]);
//!
//! // Three bits count: 9 is 1.
//! let (mut keys, mut payloads) = ([2, 9, 0, 1], [10, 11, 12, 13]);
//! radix_sort_pairs(&mut keys, &mut payloads, 3);
//! assert_eq!((keys, payloads), ([0, 9, 1, 2], [12, 11, 13, 10]));
//!
//! // Two are in the list already, and a fourth finds no room.
//! let mut count = [2, 0];
//! assert_eq!(compact(&[0, 1, 1], &mut count, 3), [u32::MAX, 2, 3]);
//! assert_eq!(count, [3, 1]);
//! ```

/// Replaces each value by the sum of those before it, modulo 2³²; returns the sum of all.
pub fn exclusive_scan(values: &mut [u32]) -> u32 {
    let mut sum = 0_u32;
    for value in values {
        let own = core::mem::replace(value, sum);
        sum = sum.wrapping_add(own);
    }
    sum
}

/// The `bits` lowest bits; all from 32 on.
#[must_use]
pub const fn low_bits(bits: u32) -> u32 {
    if bits < u32::BITS { (1 << bits) - 1 } else { u32::MAX }
}

/// Sorts pairs by the `bits` lowest bits of their keys, equal ones in the order in which they come. Where one slice is longer its
/// rest is left as it is.
pub fn radix_sort_pairs(keys: &mut [u32], payloads: &mut [u32], bits: u32) {
    let mut pairs: Vec<_> = keys.iter().copied().zip(payloads.iter().copied()).collect();
    pairs.sort_by_key(|(key, _)| key & low_bits(bits));
    for ((key, payload), pair) in keys.iter_mut().zip(payloads).zip(pairs) {
        (*key, *payload) = pair;
    }
}

/// Where each flagged element goes behind the `count[0]` (at most `capacity` count) that a list holds already, in order; `u32::MAX`
/// for those whose flag is 0, and `capacity` or more for those that find no room. `count[0]` becomes the number in the list, and
/// `count[1]` grows by how many found no room, up to `u32::MAX`. Capacity and number of flags together are below 2³².
pub fn compact(flags: &[u32], count: &mut [u32; 2], capacity: u32) -> Vec<u32> {
    let mut next = count[0].min(capacity);
    let mut destination = |flag: &u32| {
        let own = next;
        next += u32::from(*flag != 0);
        if *flag == 0 { u32::MAX } else { own }
    };
    let destinations = flags.iter().map(&mut destination).collect();
    count[0] = next.min(capacity);
    count[1] = count[1].saturating_add(next - count[0]);
    destinations
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_bits_and_pairs_meant_are_sorted() {
        let pairs = ([0b101, 0b010, 0b100, 0b001], [0, 1, 2]);
        let sorted = |bits| {
            let (mut keys, mut payloads) = pairs;
            radix_sort_pairs(&mut keys, &mut payloads, bits);
            (keys, payloads)
        };
        assert_eq!(sorted(0), pairs);
        // 1, 0, 0 in their lowest bit; the fourth key has no payload.
        assert_eq!(sorted(1), ([0b010, 0b100, 0b101, 0b001], [1, 2, 0]));
        assert_eq!(sorted(2), ([0b100, 0b101, 0b010, 0b001], [2, 0, 1]));
        assert_eq!(sorted(3), ([0b010, 0b100, 0b101, 0b001], [1, 2, 0]));
        assert_eq!([sorted(32), sorted(99)], [sorted(3); 2]);
        assert_eq!([low_bits(0), low_bits(31), low_bits(32)], [0, u32::MAX >> 1, u32::MAX]);
    }

    #[test]
    fn sums_wrap() {
        let mut values = [u32::MAX, 3, 0, 5];
        assert_eq!(exclusive_scan(&mut values), 7);
        assert_eq!(values, [0, u32::MAX, 2, 2]);
        assert_eq!(exclusive_scan(&mut []), 0);
    }
}
