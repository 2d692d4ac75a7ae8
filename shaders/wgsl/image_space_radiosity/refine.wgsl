// refine: which blocks need subdivision; stencil: where light is gathered. Each is one dispatch over all levels.
// Twin: crates/image-space-radiosity/src/cpu/refine.rs. Source: Nichols, Shopf & Wyman 2009, §3.2.1.

@group(0) @binding(1) var<uniform> settings: Settings;
@group(0) @binding(2) var<storage, read_write> needs: array<u32>;
@group(0) @binding(3) var<storage, read_write> states: array<u32>;

@compute @workgroup_size(64)
fn refine(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    // Pixels need none: `needs` begins with the blocks of level 1, where there are any.
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if table.coarsest > 0u && i + table.levels[1].x < table.nodes {
        needs[i] = u32(needs_subdivision(i));
    }
}

@compute @workgroup_size(64)
fn stencil(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < table.nodes {
        states[i] = state(i);
    }
}

/// Of a stored block, like all that follow: node i + table.levels[1].x.
fn needs_subdivision(i: u32) -> bool {
    if blocks[i].pixels == 0u {
        return false;
    }
    return has_discontinuity(i) || rises_beside(i) || light_bends(i);
}

/// Whether depths or normals vary too much inside a block. Not `<`, so that a threshold of 0 finds it everywhere.
fn has_discontinuity(i: u32) -> bool {
    let depth_max = blocks[i].depth_max;
    let flat = depth_max - blocks[i].depth_min < settings.depth * depth_max && blocks[i].versine < settings.versine;
    return blocks[i].mixed != 0u || !flat;
}

/// Whether light bends too much across a block. Where there is no light, nothing bends.
fn light_bends(i: u32) -> bool {
    let radius = blocks[i].radius;
    return sources_at(blocks[i].position).y * (radius * radius) > settings.bend * reference[0];
}

/// Whether another surface rises in front of a block's plane just beside it.
fn rises_beside(i: u32) -> bool {
    if settings.margin == 0.0 {
        return false;
    }
    let at = place(i + table.levels[1].x);
    let position = blocks[i].position;
    let normal = blocks[i].normal;
    let near = settings.margin * blocks[i].radius;
    let ring = table.levels[at.x];
    let x_end = min(at.y + 2u, ring.y);
    let y_end = min(at.z + 2u, ring.z);
    for (var cy = max(at.z, 1u) - 1u; cy < y_end; cy++) {
        for (var cx = max(at.y, 1u) - 1u; cx < x_end; cx++) {
            let k = ring.x - table.levels[1].x + cy * ring.y + cx;
            let offset = blocks[k].normal - normal;
            if versine_of_sum(0.5 * dot(offset, offset), blocks[k].versine) < settings.versine || blocks[k].pixels == 0u {
                continue;
            }
            let v = blocks[k].position - position;
            if dot(normal, v) > 0.0 && dot(v, v) < near * near {
                return true;
            }
        }
    }
    return false;
}

/// Of a node: the first block from the coarsest down that needs no subdivision is valid. They are asked from below: where one is
/// covered the next coarser one mostly says so.
fn state(i: u32) -> u32 {
    let first = table.levels[0].y * table.levels[0].z;
    if block(i, first).pixels == 0u {
        return EMPTY;
    }
    let at = place(i);
    for (var above = at.x + 1u; above <= table.coarsest; above++) {
        let l = table.levels[above];
        let shift = above - at.x;
        if needs[l.x - first + (at.z >> shift) * l.y + (at.y >> shift)] == 0u {
            return COVERED;
        }
    }
    if at.x == 0u {
        return VALID;
    }
    return select(SPLIT, VALID, needs[i - first] == 0u);
}
