// sobol: the two-dimensional Sobol' sequence with hash-based Owen scrambling. Needs sampling/rng.wgsl.
// Twin: crates/sampling/src/sobol.rs, equal bit for bit; it says why the scrambling is what it is.
// Burley 2020, "Practical Hash-based Owen Scrambling".

/// Point `index` of the sequence of `seed`, in [0, 1)².
fn sobol_2d(index: u32, seed: u32) -> vec2<f32> {
    let bits = sobol_bits_2d(index, seed);
    return vec2(unit_f32(bits.x), unit_f32(bits.y));
}

/// The first coordinate of sobol_2d.
fn sobol_1d(index: u32, seed: u32) -> f32 {
    let h = pcg_hash(seed);
    return unit_f32(reverseBits(sobol_scramble(sobol_shuffle(index, h), sobol_seeds_x(h))));
}

/// sobol_2d as 32-bit fixed point fractions.
fn sobol_bits_2d(index: u32, seed: u32) -> vec2<u32> {
    let h = pcg_hash(seed);
    let i = sobol_shuffle(index, h);
    let x = sobol_scramble(i, sobol_seeds_x(h));
    let y = sobol_scramble(
        sobol_pascal(i),
        vec2(sobol_rotate(h, 21u) * 0x165667B1u, sobol_rotate(h, 27u) * 0xD3A2646Du),
    );
    return reverseBits(vec2(x, y));
}

fn sobol_seeds_x(h: u32) -> vec2<u32> {
    return vec2(sobol_rotate(h, 11u) * 0xC2B2AE35u, sobol_rotate(h, 16u) * 0x27D4EB2Fu);
}

fn sobol_rotate(x: u32, bits: u32) -> u32 {
    return (x << bits) | (x >> (32u - bits));
}

/// The bit-reversed second Sobol' coordinate.
fn sobol_pascal(index: u32) -> u32 {
    var x = index;
    x ^= (x & 0xAAAAAAAAu) >> 1u;
    x ^= (x & 0xCCCCCCCCu) >> 2u;
    x ^= (x & 0xF0F0F0F0u) >> 4u;
    x ^= (x & 0xFF00FF00u) >> 8u;
    return x ^ (x >> 16u);
}

/// Nested uniform scrambling of a bit-reversed fraction.
fn sobol_scramble(fraction: u32, seeds: vec2<u32>) -> u32 {
    var x = fraction;
    x ^= x * 0x53a22864u;
    x = x * (seeds.x | 1u) + seeds.y;
    return x ^ (x * 0x05526c56u);
}

/// The index, permuted so that aligned blocks of 2^m go to aligned blocks.
fn sobol_shuffle(index: u32, h: u32) -> u32 {
    let x = reverseBits(index) * ((h * 0x9E3779B5u) | 1u) + sobol_rotate(h, 5u) * 0x85EBCA6Bu;
    return reverseBits(x ^ (x * 0x53a22864u));
}
