// warp: points of the unit square, redistributed in proportion to an importance pyramid.
// Twin: crates/sampling/src/warp.rs, which describes the layout of the levels and the hard cases.
// Clarberg et al. 2005, "Wavelet Importance Sampling", §3.
//
// The including module defines `fn warp_weight(i: u32) -> f32`: the importance of element i of the buffer of all levels.

/// A point of the map in texels, its density per texel area, and the texel that holds it.
struct WarpSample {
    point: vec2<f32>,
    pdf: f32,
    texel: vec2<u32>,
}

const WARP_BELOW_ONE: f32 = 0x1.fffffep-1;
/// Bits of the largest float over 8.
const WARP_LIMIT: u32 = 0x7dffffffu;

/// The point of a map of `size` texels that u in [0, 1)² goes to.
fn warp_sample(u: vec2<f32>, size: vec2<u32>) -> WarpSample {
    // From the image to the single texel at the top.
    var level = 0u;
    var extent = size;
    while any(extent > vec2(1u)) {
        extent = (extent + 1u) / 2u;
        level += 1u;
    }
    return warp_sample_within(level, vec2(0u), u, size);
}

/// The point of the texels beneath texel `node` of a level that u goes to; its density is that given the node.
fn warp_sample_within(from_level: u32, node: vec2<u32>, u: vec2<f32>, size: vec2<u32>) -> WarpSample {
    var rest = clamp(u, vec2(0.0), vec2(WARP_BELOW_ONE));
    var texel = node;
    var pdf = 1.0;
    var level = from_level;
    var offset = warp_level_begin(size, level);
    var extent = size;
    while level > 0u {
        level -= 1u;
        extent = warp_level_size(size, level);
        offset -= extent.x * extent.y;
        let group = warp_group(size, level, offset, extent, texel);
        let row_sums = vec2(group.x + group.y, group.z + group.w);
        let down = warp_split(rest.y, row_sums.x, row_sums.y);
        let row = select(group.xy, group.zw, down.second);
        let across = warp_split(rest.x, row.x, row.y);
        pdf *= select(row.x, row.y, across.second) / (row_sums.x + row_sums.y);
        texel = 2u * texel + vec2(u32(across.second), u32(down.second));
        rest = vec2(across.rest, down.rest);
    }
    // Inside the texel, also where adding its index rounds up.
    let border = bitcast<vec2<f32>>(bitcast<vec2<u32>>(vec2<f32>(texel + 1u)) - 1u);
    return WarpSample(min(vec2<f32>(texel) + rest, border), pdf, texel);
}

fn warp_level_size(size: vec2<u32>, level: u32) -> vec2<u32> {
    return (size + ((1u << level) - 1u)) >> vec2(level);
}

/// Where a level begins in the buffer.
fn warp_level_begin(size: vec2<u32>, level: u32) -> u32 {
    var begin = 0u;
    for (var l = 0u; l < level; l++) {
        let extent = warp_level_size(size, l);
        begin += extent.x * extent.y;
    }
    return begin;
}

/// The children of `parent`, left and right of the upper row, then of the lower row, or the areas that they cover where
/// all of them are 0.
fn warp_group(size: vec2<u32>, level: u32, offset: u32, extent: vec2<u32>, parent: vec2<u32>) -> vec4<f32> {
    let child = 2u * parent;
    let at = offset + child.y * extent.x + child.x;
    let right = child.x + 1u < extent.x;
    let below = child.y + 1u < extent.y;
    var group = vec4(warp_clean(at), 0.0, 0.0, 0.0);
    if right {
        group.y = warp_clean(at + 1u);
    }
    if below {
        group.z = warp_clean(at + extent.x);
    }
    if right && below {
        group.w = warp_clean(at + extent.x + 1u);
    }
    if (group.x + group.y) + (group.z + group.w) > 0.0 {
        return group;
    }
    let begin = min(child << vec2(level), size);
    let middle = min((child + 1u) << vec2(level), size);
    let end = min((child + 2u) << vec2(level), size);
    let first = vec2<f32>(middle - begin);
    let second = vec2<f32>(end - middle);
    return vec4(first.x * first.y, second.x * first.y, first.x * second.y, second.x * second.y);
}

/// What is negative, infinite or not a number does not count as importance.
fn warp_clean(i: u32) -> f32 {
    let w = warp_weight(i);
    // Compared as integers: shader compilers may assume that no NaN exists. 0 wraps, negative numbers have the top bit.
    return select(0.0, w, bitcast<u32>(w) - 1u < WARP_LIMIT - 1u);
}

struct WarpSplit {
    rest: f32,
    second: bool,
}

/// Chooses the first or second part of [0, 1), in the proportion a : b, and stretches it to [0, 1).
/// A part of size 0 is never chosen: u ≤ 1 − 2⁻²⁴ keeps the rounded u·(a + b) below a + b where that is a normal
/// number; b > 0 decides where it is not, as the product of subnormals may round up to the sum.
fn warp_split(u: f32, a: f32, b: f32) -> WarpSplit {
    let t = u * (a + b);
    let second = t >= a && b > 0.0;
    let rest = select(t, t - a, second) / select(a, b, second);
    return WarpSplit(clamp(rest, 0.0, WARP_BELOW_ONE), second);
}
