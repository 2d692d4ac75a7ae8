// compact: moves the VPLs with flux to the front, in order; one workgroup, so that the order needs no atomics.
// Twin: compact in crates/rsm/src/cpu/vpls.rs.

@group(0) @binding(0) var<storage, read> slots: array<Vpl>;
@group(0) @binding(1) var<storage, read_write> vpls: array<Vpl>;
/// Number of VPLs with flux.
@group(0) @binding(2) var<storage, read_write> count: array<u32>;
/// Number of slots in use.
@group(0) @binding(3) var<uniform> slot_count: vec4<u32>;

const THREADS: u32 = 256u;
var<workgroup> sums: array<u32, 256>;

@compute @workgroup_size(256)
fn compact(@builtin(local_invocation_index) thread: u32) {
    let n = slot_count.x;
    // Each thread owns a run of slots: count, add up the runs before, move.
    let run = (n + THREADS - 1u) / THREADS;
    let begin = min(thread * run, n);
    let end = min(begin + run, n);
    var kept = 0u;
    for (var i = begin; i < end; i++) {
        kept += u32(has_flux(slots[i].flux));
    }
    sums[thread] = kept;
    workgroupBarrier();
    // Hillis & Steele: after k steps each entry sums the 2^k runs that end with its own.
    for (var step = 1u; step < THREADS; step *= 2u) {
        var before = 0u;
        if thread >= step {
            before = sums[thread - step];
        }
        workgroupBarrier();
        sums[thread] += before;
        workgroupBarrier();
    }
    var next = sums[thread] - kept;
    for (var i = begin; i < end; i++) {
        if has_flux(slots[i].flux) {
            vpls[next] = slots[i];
            next += 1u;
        }
    }
    if thread == THREADS - 1u {
        count[0] = sums[thread];
    }
}

fn has_flux(flux: vec3<f32>) -> bool {
    return flux.x + flux.y + flux.z > 0.0;
}
