// upsample: pull fills subdivided blocks from their children, push fills blocks inside a fragment from the level above.
// Twin: crates/image-space-radiosity/src/cpu/upsample.rs. Source: Nichols, Shopf & Wyman 2009, §3.2; Nichols & Wyman 2009.

@group(0) @binding(0) var<uniform> pair: LevelPair;
@group(0) @binding(1) var<storage, read> blocks: array<Block>;
@group(0) @binding(2) var<storage, read> states: array<u32>;
@group(0) @binding(3) var<storage, read> slots: array<u32>;
@group(0) @binding(4) var<storage, read> gathered: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read_write> irradiance: array<vec4<f32>>;

/// The pair's coarser level from its finer one. The pixels, level 0, have none and no subdivided blocks.
@compute @workgroup_size(64)
fn pull(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < pair.coarse_width * pair.coarse_height {
        let node = pair.coarse_offset + i;
        var e = vec3(0.0);
        if states[node] == VALID {
            e = gathered[slots[node]].xyz;
        } else if states[node] == SPLIT {
            e = mean(i % pair.coarse_width, i / pair.coarse_width);
        }
        irradiance[node] = vec4(e, 0.0);
    }
}

/// The pair's finer level from its coarser one.
@compute @workgroup_size(64)
fn push(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < pair.fine_width * pair.fine_height {
        let node = pair.fine_offset + i;
        if states[node] == COVERED {
            irradiance[node] = vec4(interpolate(node, i % pair.fine_width, i / pair.fine_width), 0.0);
        }
    }
}

/// Mean of the children's irradiance, weighted by their surface pixels.
fn mean(x: u32, y: u32) -> vec3<f32> {
    var sum = vec3(0.0);
    var pixels = 0u;
    for (var cy = 2u * y; cy < min(2u * y + 2u, pair.fine_height); cy++) {
        for (var cx = 2u * x; cx < min(2u * x + 2u, pair.fine_width); cx++) {
            let child = pair.fine_offset + cy * pair.fine_width + cx;
            sum += irradiance[child].xyz * f32(blocks[child].pixels);
            pixels += blocks[child].pixels;
        }
    }
    // A subdivided block has surface pixels.
    return sum * (1.0 / f32(pixels));
}

/// The value at a block from the four nearest of the next coarser level, its parent first.
fn interpolate(node: u32, x: u32, y: u32) -> vec3<f32> {
    let px = x / 2u;
    let py = y / 2u;
    // The neighbour on the side on which the block lies in its parent; below 0 wraps, and is outside as the size is.
    let qx = select(px + 1u, px - 1u, x % 2u == 0u);
    let qy = select(py + 1u, py - 1u, y % 2u == 0u);
    var sum = irradiance[pair.coarse_offset + py * pair.coarse_width + px].xyz * 9.0;
    var weights = 9.0;
    var nx = array(qx, px, qx);
    var ny = array(py, qy, qy);
    var bilinear = array(3.0, 3.0, 1.0);
    for (var k = 0u; k < 3u; k++) {
        if nx[k] < pair.coarse_width && ny[k] < pair.coarse_height {
            let other = pair.coarse_offset + ny[k] * pair.coarse_width + nx[k];
            if states[other] != EMPTY {
                let w = bilinear[k] * agreement(node, other);
                sum += irradiance[other].xyz * w;
                weights += w;
            }
        }
    }
    return sum * (1.0 / weights);
}

/// How far two blocks are one smooth surface, [0, 1]: their normals agree and each lies in the other's plane.
fn agreement(a: u32, b: u32) -> f32 {
    let v = blocks[b].position - blocks[a].position;
    let d2 = dot(v, v);
    let ha = dot(blocks[a].normal, v);
    let hb = dot(blocks[b].normal, v);
    // Squared sine of the elevation above the two planes; 0 for coincident points.
    let elevation = max(ha * ha, hb * hb) / max(d2, 1e-37);
    let normals = max(dot(blocks[a].normal, blocks[b].normal), 0.0) * max(1.0 - blocks[b].versine, 0.0);
    let n2 = normals * normals;
    return n2 * n2 * max(1.0 - 4.0 * elevation, 0.0);
}
