// rng: counter-based random numbers.
// Twin: crates/sampling/src/rng.rs, equal bit for bit.
// Jarzynski & Olano 2020, "Hash Functions for GPU Rendering"; Salmon et al. 2011, "Parallel Random Numbers".

fn pcg_hash(x: u32) -> u32 {
    let state = x * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

fn hash_combine(a: u32, b: u32) -> u32 {
    return pcg_hash(a ^ pcg_hash(b));
}

/// The top 24 bits of x as a number in [0, 1), exactly.
fn unit_f32(x: u32) -> f32 {
    return f32(x >> 8u) * 0x1p-24;
}

/// Upper and lower word of a product.
fn multiply_wide(a: u32, b: u32) -> vec2<u32> {
    let al = a & 0xffffu;
    let ah = a >> 16u;
    let bl = b & 0xffffu;
    let bh = b >> 16u;
    let low = al * bl;
    let middle = ah * bl + (low >> 16u);
    let carry = al * bh + (middle & 0xffffu);
    return vec2(ah * bh + (middle >> 16u) + (carry >> 16u), a * b);
}

/// Philox-4×32-10.
fn philox4x32(counter: vec4<u32>, key: vec2<u32>) -> vec4<u32> {
    var c = counter;
    var k = key;
    for (var round = 0u; round < 10u; round++) {
        let p0 = multiply_wide(0xD2511F53u, c.x);
        let p1 = multiply_wide(0xCD9E8D57u, c.z);
        c = vec4(p1.x ^ c.y ^ k.x, p1.y, p0.x ^ c.w ^ k.y, p0.y);
        k += vec2(0x9E3779B9u, 0xBB67AE85u);
    }
    return c;
}
