// keys, sort: the lights of a list in the order of a tree: those that face alike together, along a space-filling
// curve.
// Twin: keys and sort in crates/rsm/src/cpu/tree.rs. Sort: Batcher 1968, "Sorting Networks and Their Applications"
// (bitonic).

/// A stage of the sort: runs of `size` are merged, by pairs `distance` apart.
struct SortStep {
    size: u32,
    distance: u32,
    pad0: u32,
    pad1: u32,
}

/// Least and greatest position that each workgroup found.
@group(0) @binding(3) var<storage, read_write> bounds: array<vec4<f32>>;
/// Key and place in the list.
@group(0) @binding(4) var<storage, read_write> pairs: array<vec2<u32>>;
@group(0) @binding(5) var<uniform> step: SortStep;

const UNLIT: u32 = 0xffffffffu;
const CELLS: f32 = 1024.0;
const FAR: f32 = 0x1.fffffep+127;
const THREADS: u32 = 256u;
/// Pairs that a workgroup sorts by itself.
const BLOCK: u32 = 1024u;

var<workgroup> lows: array<vec3<f32>, 256>;
var<workgroup> highs: array<vec3<f32>, 256>;
var<workgroup> block: array<vec2<u32>, 1024>;

/// Joins the bounds of all threads into those of thread 0.
fn join_bounds(thread: u32) {
    workgroupBarrier();
    for (var half = THREADS / 2u; half > 0u; half /= 2u) {
        if thread < half {
            lows[thread] = min(lows[thread], lows[thread + half]);
            highs[thread] = max(highs[thread], highs[thread + half]);
        }
        workgroupBarrier();
    }
}

@compute @workgroup_size(256)
fn tree_bounds(@builtin(workgroup_id) workgroup_id: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    var low = vec3(FAR);
    var high = vec3(-FAR);
    for (var i = workgroup_id.x * THREADS + thread; i < tree.lights; i += tree.partials * THREADS) {
        if is_lit(i) {
            low = min(low, vpls[i].position);
            high = max(high, vpls[i].position);
        }
    }
    lows[thread] = low;
    highs[thread] = high;
    join_bounds(thread);
    if thread == 0u {
        bounds[2u * workgroup_id.x] = vec4(lows[0], 0.0);
        bounds[2u * workgroup_id.x + 1u] = vec4(highs[0], 0.0);
    }
}

@compute @workgroup_size(256)
fn tree_keys(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    lows[thread] = vec3(FAR);
    highs[thread] = vec3(-FAR);
    if thread < tree.partials {
        lows[thread] = bounds[2u * thread].xyz;
        highs[thread] = bounds[2u * thread + 1u].xyz;
    }
    join_bounds(thread);
    let i = grid_index(workgroup_id, num_workgroups, thread, THREADS);
    if i < tree.padded {
        var key = UNLIT;
        if is_lit(i) {
            let extent = highs[0] - lows[0];
            key = key_of(vpls[i], lows[0], cells_per_metre(max(max(extent.x, extent.y), extent.z)));
        }
        pairs[i] = vec2(key, i);
    }
}

/// Its last bits are left out, so that a division that errs in them gives the same.
fn cells_per_metre(extent: f32) -> f32 {
    if extent > 1e-30 && extent < 1e30 {
        return bitcast<f32>(bitcast<u32>(CELLS / extent) & 0xfffff000u);
    }
    return 0.0;
}

fn key_of(own: Vpl, low: vec3<f32>, scale: f32) -> u32 {
    let cell = vec3<u32>(min((own.position - low) * scale, vec3(CELLS - 1.0)));
    return (facing(own.normal) << 29u) | (curve(cell) >> 1u);
}

/// The axis, 0 to 5, that a normal is nearest to.
fn facing(normal: vec3<f32>) -> u32 {
    let a = abs(normal);
    var axis = 1u + u32(a.y < a.z);
    if a.x >= a.y && a.x >= a.z {
        axis = 0u;
    }
    return 2u * axis + u32(normal[axis] < 0.0);
}

/// Bits of the three coordinates by turns (Morton order), 10 of each.
fn curve(cell: vec3<u32>) -> u32 {
    var c = cell;
    c = (c | (c << vec3(16u))) & vec3(0x030000ffu);
    c = (c | (c << vec3(8u))) & vec3(0x0300f00fu);
    c = (c | (c << vec3(4u))) & vec3(0x030c30c3u);
    c = (c | (c << vec3(2u))) & vec3(0x09249249u);
    return (c.x << 2u) | (c.y << 1u) | c.z;
}

/// Puts two pairs in order where `a` is the first of them; equal keys in the order of the list.
fn in_order(a: vec2<u32>, b: vec2<u32>) -> bool {
    return a.x < b.x || (a.x == b.x && a.y < b.y);
}

/// The first of the pair of places that comparator `i` looks at.
fn place_of(i: u32, distance: u32) -> u32 {
    return 2u * distance * (i / distance) + i % distance;
}

/// Merges runs of `size` in the workgroup's block, from pairs `distance` apart on.
fn merge_block(first: u32, thread: u32, size: u32, distance: u32) {
    for (var d = distance; d > 0u; d /= 2u) {
        workgroupBarrier();
        for (var i = thread; i < BLOCK / 2u; i += THREADS) {
            let at = place_of(i, d);
            let a = block[at];
            let b = block[at + d];
            let ascending = ((first + at) & size) == 0u;
            if in_order(a, b) != ascending {
                block[at] = b;
                block[at + d] = a;
            }
        }
    }
    workgroupBarrier();
}

fn load_block(first: u32, thread: u32) {
    for (var i = thread; i < BLOCK; i += THREADS) {
        block[i] = pairs[first + i];
    }
}

fn store_block(first: u32, thread: u32) {
    for (var i = thread; i < BLOCK; i += THREADS) {
        pairs[first + i] = block[i];
    }
}

/// Sorts each block, up and down by turns; one workgroup each.
@compute @workgroup_size(256)
fn sort_blocks(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let first = BLOCK * (workgroup_id.y * num_workgroups.x + workgroup_id.x);
    load_block(first, thread);
    for (var size = 2u; size <= BLOCK; size *= 2u) {
        merge_block(first, thread, size, size / 2u);
    }
    store_block(first, thread);
}

/// One step over all; a thread for each pair.
@compute @workgroup_size(256)
fn sort_pairs(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, thread, THREADS);
    if i < tree.padded / 2u {
        let at = place_of(i, step.distance);
        let a = pairs[at];
        let b = pairs[at + step.distance];
        let ascending = (at & step.size) == 0u;
        if in_order(a, b) != ascending {
            pairs[at] = b;
            pairs[at + step.distance] = a;
        }
    }
}

/// The steps that are left of a stage, within blocks; one workgroup each.
@compute @workgroup_size(256)
fn sort_merge(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let first = BLOCK * (workgroup_id.y * num_workgroups.x + workgroup_id.x);
    load_block(first, thread);
    merge_block(first, thread, step.size, BLOCK / 2u);
    store_block(first, thread);
}
