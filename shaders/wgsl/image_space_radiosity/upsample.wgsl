// upsample: pull fills subdivided blocks from their children, push fills blocks inside a fragment from the level above.
// Twin: crates/image-space-radiosity/src/cpu/upsample.rs. Source: Nichols, Shopf & Wyman 2009, §3.2; Nichols & Wyman 2009.

@group(0) @binding(0) var<uniform> pair: LevelPair;
@group(0) @binding(1) var<storage, read> states: array<u32>;
@group(0) @binding(2) var<storage, read> slots: array<u32>;
@group(0) @binding(3) var<storage, read> gathered: array<vec4<f32>>;
/// Of the pixels.
@group(0) @binding(4) var<storage, read_write> irradiance: array<vec4<f32>>;
/// Of the blocks of level 1 and coarser.
@group(0) @binding(5) var<storage, read_write> coarse_irradiance: array<vec4<f32>>;

/// The pixels, level 0: they have no finer level and no subdivided blocks.
@compute @workgroup_size(64)
fn pull_pixels(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < pair.first {
        var e = vec4(0.0);
        if states[i] == VALID {
            e = vec4(gathered[slots[i]].xyz, 0.0);
        }
        irradiance[i] = e;
    }
}

/// The pair's coarser level from its finer one.
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
        coarse_irradiance[node - pair.first] = vec4(e, 0.0);
    }
}

/// The pixels from level 1; one thread per block.
@compute @workgroup_size(64)
fn push_pixels(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < pair.coarse_width * pair.coarse_height && lies_in_fragment(i) {
        let at = 2u * vec2(i % pair.coarse_width, i / pair.coarse_width);
        let pixel = at.y * pair.fine_width + at.x;
        let inside = at + 1u < vec2(pair.fine_width, pair.fine_height);
        let e = children(i);
        irradiance[pixel] = vec4(e[0], 0.0);
        if inside.x {
            irradiance[pixel + 1u] = vec4(e[1], 0.0);
        }
        if inside.y {
            irradiance[pixel + pair.fine_width] = vec4(e[2], 0.0);
        }
        if all(inside) {
            irradiance[pixel + pair.fine_width + 1u] = vec4(e[3], 0.0);
        }
    }
}

/// The pair's finer level, not the pixels, from its coarser one; likewise.
@compute @workgroup_size(64)
fn push(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < pair.coarse_width * pair.coarse_height && lies_in_fragment(i) {
        let at = 2u * vec2(i % pair.coarse_width, i / pair.coarse_width);
        let block = pair.fine_offset - pair.first + at.y * pair.fine_width + at.x;
        let inside = at + 1u < vec2(pair.fine_width, pair.fine_height);
        let e = children(i);
        coarse_irradiance[block] = vec4(e[0], 0.0);
        if inside.x {
            coarse_irradiance[block + 1u] = vec4(e[1], 0.0);
        }
        if inside.y {
            coarse_irradiance[block + pair.fine_width] = vec4(e[2], 0.0);
        }
        if all(inside) {
            coarse_irradiance[block + pair.fine_width + 1u] = vec4(e[3], 0.0);
        }
    }
}

/// Whether a block of the coarser level is a fragment or lies inside one.
fn lies_in_fragment(i: u32) -> bool {
    let state = states[pair.coarse_offset + i];
    return state == VALID || state == COVERED;
}

/// The values at the four children of a block: each from the four nearest blocks, its parent first.
fn children(i: u32) -> mat4x3<f32> {
    let own = pair.coarse_offset - pair.first + i;
    let x = i % pair.coarse_width;
    let y = i / pair.coarse_width;
    let p = blocks[own].position;
    let n = blocks[own].normal;
    // Below 0 wraps, and is outside as the size is.
    let l = neighbour(p, n, x - 1u, y);
    let r = neighbour(p, n, x + 1u, y);
    let u = neighbour(p, n, x, y - 1u);
    let d = neighbour(p, n, x, y + 1u);
    let lu = neighbour(p, n, x - 1u, y - 1u);
    let ru = neighbour(p, n, x + 1u, y - 1u);
    let ld = neighbour(p, n, x - 1u, y + 1u);
    let rd = neighbour(p, n, x + 1u, y + 1u);
    let e = coarse_irradiance[own].xyz;
    return mat4x3(
        mix_children(e, l, u, lu), mix_children(e, r, u, ru), mix_children(e, l, d, ld), mix_children(e, r, d, rd),
    );
}

/// The value at a neighbour of the block at p and how far it counts; 0 outside the image and where nothing is seen.
fn neighbour(p: vec3<f32>, n: vec3<f32>, x: u32, y: u32) -> vec4<f32> {
    if x >= pair.coarse_width || y >= pair.coarse_height {
        return vec4(0.0);
    }
    let i = pair.coarse_offset + y * pair.coarse_width + x;
    if states[i] == EMPTY {
        return vec4(0.0);
    }
    return vec4(coarse_irradiance[i - pair.first].xyz, agreement(p, n, i - pair.first));
}

/// The bilinear weights of a child: 9 for its parent, 3 for the two beside it, 1 for the one across.
fn mix_children(e: vec3<f32>, a: vec4<f32>, b: vec4<f32>, c: vec4<f32>) -> vec3<f32> {
    let sum = e * 9.0 + a.xyz * (3.0 * a.w) + b.xyz * (3.0 * b.w) + c.xyz * c.w;
    return sum * (1.0 / (9.0 + 3.0 * a.w + 3.0 * b.w + c.w));
}

/// Mean of the children's irradiance, weighted by their surface pixels.
fn mean(x: u32, y: u32) -> vec3<f32> {
    var sum = vec3(0.0);
    var pixels = 0u;
    for (var cy = 2u * y; cy < min(2u * y + 2u, pair.fine_height); cy++) {
        for (var cx = 2u * x; cx < min(2u * x + 2u, pair.fine_width); cx++) {
            let child = pair.fine_offset + cy * pair.fine_width + cx;
            let seen = block(child, pair.first).pixels;
            var e = vec3(0.0);
            if child < pair.first {
                e = irradiance[child].xyz;
            } else {
                e = coarse_irradiance[child - pair.first].xyz;
            }
            sum += e * f32(seen);
            pixels += seen;
        }
    }
    // A subdivided block has surface pixels.
    return sum * (1.0 / f32(pixels));
}

/// How far the surface with position p and normal n and a stored block are one smooth surface, [0, 1]: their normals agree and
/// each lies in the other's plane.
fn agreement(p: vec3<f32>, n: vec3<f32>, b: u32) -> f32 {
    let normal = blocks[b].normal;
    let v = blocks[b].position - p;
    let d2 = dot(v, v);
    let ha = dot(n, v);
    let hb = dot(normal, v);
    // Squared sine of the elevation above the two planes; 0 for coincident points.
    let elevation = max(ha * ha, hb * hb) / max(d2, 1e-37);
    let normals = max(dot(n, normal), 0.0) * max(1.0 - blocks[b].versine, 0.0);
    let n2 = normals * normals;
    return n2 * n2 * max(1.0 - 4.0 * elevation, 0.0);
}
