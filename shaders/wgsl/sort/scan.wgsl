// scan: the sum of all values before each, modulo 2³²: the sum of each block, what lies before each block, what lies before each
// value. Another file of the module says what is summed and where it goes: scan_read and scan_write of a value, scan_first for
// what lies before all, scan_last for the sum of all.
// Twin: exclusive_scan in crates/core/src/sort.rs. Blelloch 1990, "Prefix Sums and Their Applications".

struct Scan {
    length: u32,
    blocks: u32,
}

@group(0) @binding(0) var<uniform> scan: Scan;
@group(0) @binding(1) var<storage, read_write> block_sums: array<u32>;

const SCAN_THREADS: u32 = 256u;
/// Values in a row that a thread adds up.
const SCAN_RUN: u32 = 8u;
/// Values of a workgroup.
const SCAN_BLOCK: u32 = 2048u;
/// Threads of a row, and rows. Three barriers, where doubling strides (Hillis & Steele) would take sixteen.
const SCAN_ROW: u32 = 16u;

/// What each thread brings, and then what the threads of its row before it bring.
var<workgroup> scan_sums: array<u32, 256>;
/// What lies before each row of threads, and the sum of all.
var<workgroup> scan_rows: array<u32, 17>;

/// The sum of what the threads before this one bring; that of all is left in the last of `scan_rows`.
fn scan_threads(thread: u32, own: u32) -> u32 {
    scan_sums[thread] = own;
    workgroupBarrier();
    if thread < SCAN_ROW {
        var sum = 0u;
        for (var i = SCAN_ROW * thread; i < SCAN_ROW * (thread + 1u); i++) {
            let value = scan_sums[i];
            scan_sums[i] = sum;
            sum += value;
        }
        scan_rows[thread] = sum;
    }
    workgroupBarrier();
    if thread == 0u {
        var sum = 0u;
        for (var i = 0u; i < SCAN_ROW; i++) {
            let value = scan_rows[i];
            scan_rows[i] = sum;
            sum += value;
        }
        scan_rows[SCAN_ROW] = sum;
    }
    workgroupBarrier();
    return scan_sums[thread] + scan_rows[thread / SCAN_ROW];
}

/// The sum of each block; one workgroup each.
@compute @workgroup_size(256)
fn scan_reduce(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let block = grid_index(workgroup_id, num_workgroups, 0u, 1u);
    if block >= scan.blocks {
        return;
    }
    let first = block * SCAN_BLOCK;
    var own = 0u;
    for (var i = first + thread; i < min(first + SCAN_BLOCK, scan.length); i += SCAN_THREADS) {
        own += scan_read(i);
    }
    scan_threads(thread, own);
    if thread == 0u {
        block_sums[block] = scan_rows[SCAN_ROW];
    }
}

/// Replaces the sum of each block by what lies before it; one workgroup.
@compute @workgroup_size(256)
fn scan_blocks(@builtin(local_invocation_index) thread: u32) {
    // What lies before the tile is brought by the first thread.
    var before = 0u;
    if thread == 0u {
        before = scan_first();
    }
    for (var tile = 0u; tile < scan.blocks; tile += SCAN_BLOCK) {
        let begin = tile + SCAN_RUN * thread;
        let end = min(begin + SCAN_RUN, scan.blocks);
        var own = before;
        for (var i = begin; i < end; i++) {
            own += block_sums[i];
        }
        var next = scan_threads(thread, own) + before;
        for (var i = begin; i < end; i++) {
            let value = block_sums[i];
            block_sums[i] = next;
            next += value;
        }
        if thread == 0u {
            before = scan_rows[SCAN_ROW];
        }
        // The next tile overwrites what this one reads.
        workgroupBarrier();
    }
    if thread == 0u {
        scan_last(before);
    }
}

/// Hands each value on with the sum of those before it; one workgroup per block.
@compute @workgroup_size(256)
fn scan_spread(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let block = grid_index(workgroup_id, num_workgroups, 0u, 1u);
    if block >= scan.blocks {
        return;
    }
    let begin = block * SCAN_BLOCK + SCAN_RUN * thread;
    var run: array<u32, 8>;
    var own = 0u;
    for (var i = 0u; i < SCAN_RUN; i++) {
        if begin + i < scan.length {
            run[i] = scan_read(begin + i);
            own += run[i];
        }
    }
    var next = block_sums[block] + scan_threads(thread, own);
    for (var i = 0u; i < SCAN_RUN; i++) {
        if begin + i < scan.length {
            scan_write(begin + i, next, run[i]);
            next += run[i];
        }
    }
}
