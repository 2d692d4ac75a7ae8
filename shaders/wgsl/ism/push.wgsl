// push: holes of every map filled from its coarser levels, a workgroup to a map.
// Twin: crates/imperfect-shadow-maps/src/cpu/push.rs. Ritschel et al. 2008, after Marroquim, Kraus & Cavalcanti 2007.

@group(0) @binding(0) var<uniform> ism: Ism;
/// Number of VPLs.
@group(0) @binding(1) var<storage, read> count: array<u32>;
@group(0) @binding(2) var<storage, read_write> ism_atlas: array<f32>;
@group(0) @binding(3) var<storage, read_write> ism_coarse: array<f32>;

const CLOSE: f32 = 0.1;

@compute @workgroup_size(64)
fn push(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let map = workgroup_id.y * num_workgroups.x + workgroup_id.x;
    if map >= min(count[0], ism.tiles) {
        return;
    }
    let fine = map * ism.tile * ism.tile;
    var begin = (map + 1u) * ism.coarse;
    for (var up = 0u; up < ism.levels; up++) {
        let level = ism.levels - 1u - up;
        let side = ism.tile >> level;
        let above = side / 2u;
        begin -= above * above;
        let close = CLOSE * f32(1u << level);
        for (var i = thread; i < side * side; i += 64u) {
            if level == 0u {
                ism_atlas[fine + i] = push_texel(ism_atlas[fine + i], begin, above, i % side, i / side, close);
            } else {
                let at = begin - side * side + i;
                ism_coarse[at] = push_texel(ism_coarse[at], begin, above, i % side, i / side, close);
            }
        }
        storageBarrier();
    }
}

/// A texel that is empty, or farther than all four around it one level up, takes their mean.
fn push_texel(u: f32, begin: u32, side: u32, x: u32, y: u32, close: f32) -> f32 {
    let x0 = x / 2u;
    let y0 = y / 2u;
    let x1 = around(x, side);
    let y1 = around(y, side);
    let c = vec4(
        ism_coarse[begin + y0 * side + x0],
        ism_coarse[begin + y0 * side + x1],
        ism_coarse[begin + y1 * side + x0],
        ism_coarse[begin + y1 * side + x1],
    );
    let weights = vec4(0.5625, 0.1875, 0.1875, 0.0625);
    var sum = 0.0;
    var weight = 0.0;
    for (var i = 0u; i < 4u; i++) {
        if c[i] > 0.0 {
            sum += weights[i] * c[i];
            weight += weights[i];
        }
    }
    let least = min(min(c.x, c.y), min(c.z, c.w));
    // At the border of the map nothing surrounds a texel.
    let inside = x1 != x0 && y1 != y0;
    let hole = u == 0.0 || (inside && u * (1.0 + close) < least);
    if hole && weight > 0.0 {
        return sum / weight;
    }
    return u;
}

/// The next coarser texel on a texel's side of the one that contains it; at the border that one again.
fn around(i: u32, side: u32) -> u32 {
    let own = i / 2u;
    if i % 2u == 0u {
        return max(own, 1u) - 1u;
    }
    return min(own + 1u, side - 1u);
}
