// compact: the valid blocks as one list in Z order, without atomics: count per run of nodes, add up, write; then what is where.
// Twin: crates/image-space-radiosity/src/cpu/compact.rs.

/// Number of fragments, and arguments of the indirect calls that treat them.
struct Totals {
    fragments: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
    /// Workgroups of the traversal and of all that treats four fragments per thread.
    traverse: array<u32, 3>,
    pad3: u32,
    /// Vertices and instances of the splat.
    splat: array<u32, 4>,
    /// Workgroups of each chunk of the gather.
    gather: array<u32>,
}

@group(0) @binding(0) var<uniform> lengths: Lengths;
@group(0) @binding(1) var<storage, read> order: array<u32>;
@group(0) @binding(2) var<storage, read> states: array<u32>;
@group(0) @binding(3) var<storage, read_write> runs: array<u32>;
@group(0) @binding(4) var<storage, read_write> fragment_positions: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read_write> fragment_normals: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read_write> slots: array<u32>;
@group(0) @binding(7) var<storage, read_write> fragment_nodes: array<u32>;
@group(0) @binding(8) var<storage, read_write> totals: Totals;
/// `totals` where its arguments are in use: the number of fragments first.
@group(0) @binding(9) var<storage, read> fragment_count: array<u32>;
/// Number of lights.
@group(0) @binding(13) var<storage, read> count: array<u32>;

/// Entries that one thread counts.
const RUN: u32 = 64u;
/// Lights per dispatch of the gather.
const CHUNK: u32 = 1024u;
const THREADS: u32 = 256u;
var<workgroup> sums: array<u32, 256>;

@compute @workgroup_size(64)
fn compact_count(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let run = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if run < lengths.runs {
        var valid = 0u;
        for (var i = run * RUN; i < min((run + 1u) * RUN, lengths.entries); i++) {
            valid += u32(is_valid(order[i]));
        }
        runs[run] = valid;
    }
}

/// Replaces each run's count by the number of fragments before it; one workgroup.
@compute @workgroup_size(256)
fn compact_scan(@builtin(local_invocation_index) thread: u32) {
    let share = (lengths.runs + THREADS - 1u) / THREADS;
    let begin = min(thread * share, lengths.runs);
    let end = min(begin + share, lengths.runs);
    var own = 0u;
    for (var i = begin; i < end; i++) {
        own += runs[i];
    }
    sums[thread] = own;
    workgroupBarrier();
    // Hillis & Steele: after k steps each entry sums the 2^k threads that end with its own.
    for (var step = 1u; step < THREADS; step *= 2u) {
        var before = 0u;
        if thread >= step {
            before = sums[thread - step];
        }
        workgroupBarrier();
        sums[thread] += before;
        workgroupBarrier();
    }
    var next = sums[thread] - own;
    for (var i = begin; i < end; i++) {
        let valid = runs[i];
        runs[i] = next;
        next += valid;
    }
    if thread == THREADS - 1u {
        totals.fragments = sums[thread];
    }
}

@compute @workgroup_size(64)
fn compact_write(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let run = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if run < lengths.runs {
        var next = runs[run];
        for (var i = run * RUN; i < min((run + 1u) * RUN, lengths.entries); i++) {
            let node = order[i];
            if is_valid(node) {
                fragment_nodes[next] = node;
                slots[node] = next;
                next += 1u;
            }
        }
    }
}

/// Where the fragments lie; four per thread.
@compute @workgroup_size(64)
fn compact_points(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let begin = 4u * grid_index(workgroup_id, num_workgroups, local_index, 64u);
    for (var i = begin; i < min(begin + 4u, fragment_count[0]); i++) {
        let own = block(fragment_nodes[i], lengths.pixels);
        fragment_positions[i] = vec4(own.position, 0.0);
        fragment_normals[i] = vec4(own.normal, 0.0);
    }
}

/// Sets the arguments of the indirect calls; one thread per chunk of lights.
@compute @workgroup_size(64)
fn compact_arguments(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let chunk = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    // Four fragments per thread.
    let workgroups = (totals.fragments + 255u) / 256u;
    let y = max((workgroups + 65534u) / 65535u, 1u);
    let x = (workgroups + y - 1u) / y;
    if chunk == 0u {
        totals.traverse = array(x, y, 1u);
        totals.splat = array(totals.fragments, count[0], 0u, 0u);
    }
    if chunk < lengths.chunks {
        // The first chunk also clears.
        let used = chunk == 0u || count[0] > chunk * CHUNK;
        totals.gather[3u * chunk] = select(0u, x, used);
        totals.gather[3u * chunk + 1u] = y;
        totals.gather[3u * chunk + 2u] = 1u;
    }
}

fn is_valid(node: u32) -> bool {
    return node < lengths.nodes && states[node] == VALID;
}
