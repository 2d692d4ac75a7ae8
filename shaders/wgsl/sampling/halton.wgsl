// halton: radical inverses, plain or with Faure's permutations, in exact integers.
// Twin: crates/sampling/src/halton.rs (Scrambling::None and Scrambling::Faure) and radical.rs.
// Faure 1992, "Good Permutations for Extreme Discrepancy".

/// Numerator and denominator of the radical inverse of `index` in `base`. `index·base` must be below 2³².
fn radical_inverse(base: u32, index: u32, faure: bool) -> vec2<u32> {
    var fraction = vec2(0u, 1u);
    var rest = index;
    while rest > 0u {
        var digit = rest % base;
        if faure {
            digit = faure_permutation(base, digit);
        }
        fraction = vec2(fraction.x * base + digit, fraction.y * base);
        rest /= base;
    }
    return fraction;
}

/// The radical inverse as a number in [0, 1).
fn halton(base: u32, index: u32, faure: bool) -> f32 {
    let fraction = radical_inverse(base, index, faure);
    return min(f32(fraction.x) / f32(fraction.y), 0x1.fffffep-1);
}

/// Faure's permutation of the digits of `base`, 2 ≤ base < 2³¹.
fn faure_permutation(base: u32, digit: u32) -> u32 {
    var b = base;
    var d = digit;
    var kinds = array<u32, 64>();
    var middles = array<u32, 64>();
    var depth = 0u;
    while b > 2u {
        let half = b / 2u;
        if b % 2u == 1u {
            if d == half {
                break;
            }
            d -= u32(d > half);
            middles[depth] = half;
            b -= 1u;
        } else {
            kinds[depth] = u32(d >= half);
            d %= half;
            b = half;
        }
        depth += 1u;
    }
    while depth > 0u {
        depth -= 1u;
        let middle = middles[depth];
        d = select(2u * d + kinds[depth], d + u32(d >= middle), middle > 0u);
    }
    return d;
}
