// Bilinear lookup in 16-bit textures that lie one after the other in `scene_texels` (core/scene.wgsl).
// Twin: indirect_core::Texture::sample. Computed, not sampled: filters of GPUs differ in precision.

struct TextureRef {
    /// Linear part of the transform of texture coordinates, by columns.
    transform: vec4<f32>,
    translation: vec2<f32>,
    size: vec2<u32>,
    /// Wrap mode of u and v.
    wrap: vec2<u32>,
    /// Index of the first texel, or NO_TEXTURE.
    first_texel: u32,
}

const NO_TEXTURE: u32 = 0xffffffffu;
const WRAP_REPEAT: u32 = 0u;
const WRAP_MIRROR: u32 = 1u;
const WRAP_CLAMP: u32 = 2u;

/// Brings a coordinate into [0, 1]; anything not finite becomes 0.
fn texture_wrap(c: f32, mode: u32) -> f32 {
    // By its bits: WGSL may assume that NaN and infinity do not occur.
    if (bitcast<u32>(c) & 0x7f800000u) == 0x7f800000u {
        return 0.0;
    }
    if mode == WRAP_REPEAT {
        return c - floor(c);
    }
    if mode == WRAP_MIRROR {
        let t = c - 2.0 * floor(c * 0.5);
        return select(t, 2.0 - t, t > 1.0);
    }
    return clamp(c, 0.0, 1.0);
}

/// The texel index of `i`, which lies within one texel of [0, n).
fn texture_neighbour(i: f32, n: u32, mode: u32) -> u32 {
    let last = n - 1u;
    if i < 0.0 {
        return select(0u, last, mode == WRAP_REPEAT);
    }
    if u32(i) > last {
        return select(last, 0u, mode == WRAP_REPEAT);
    }
    return u32(i);
}

/// One texel as RGBA in [0, 1].
fn texture_texel(t: TextureRef, x: u32, y: u32) -> vec4<f32> {
    let bits = scene_texels[t.first_texel + y * t.size.x + x];
    return vec4<f32>(unpack2x16unorm(bits.x), unpack2x16unorm(bits.y));
}

/// Bilinear lookup at the mesh's texture coordinate `mesh_uv`.
fn texture_sample(t: TextureRef, mesh_uv: vec2<f32>) -> vec4<f32> {
    let uv = t.transform.xy * mesh_uv.x + t.transform.zw * mesh_uv.y + t.translation;
    let p = vec2<f32>(texture_wrap(uv.x, t.wrap.x), texture_wrap(uv.y, t.wrap.y)) * vec2<f32>(t.size) - 0.5;
    let base = floor(p);
    let f = p - base;
    let x0 = texture_neighbour(base.x, t.size.x, t.wrap.x);
    let x1 = texture_neighbour(base.x + 1.0, t.size.x, t.wrap.x);
    let y0 = texture_neighbour(base.y, t.size.y, t.wrap.y);
    let y1 = texture_neighbour(base.y + 1.0, t.size.y, t.wrap.y);
    let top = mix(texture_texel(t, x0, y0), texture_texel(t, x1, y0), f.x);
    let bottom = mix(texture_texel(t, x0, y1), texture_texel(t, x1, y1), f.x);
    return mix(top, bottom, f.y);
}
