// radix: sorts pairs by one digit of their keys and keeps the order of equal digits: count the digits of each block, scan,
// move. Once per digit, from the lowest on.
// Twin: radix_sort_pairs in crates/core/src/sort.rs. Zagha & Blelloch 1991, "Radix Sort for Vector Multiprocessors".

/// A digit of the keys: `(key >> shift) & mask`.
struct SortDigit {
    shift: u32,
    mask: u32,
    capacity: u32,
    blocks: u32,
}

@group(0) @binding(0) var<uniform> digit: SortDigit;
/// Number of pairs.
@group(0) @binding(1) var<storage, read> count: array<u32>;
@group(0) @binding(2) var<storage, read> keys: array<u32>;
@group(0) @binding(3) var<storage, read> payloads: array<u32>;
/// Keys of each digit in each block, those of one digit side by side; once scanned, where the first of them goes.
@group(0) @binding(4) var<storage, read_write> digit_counts: array<u32>;
@group(0) @binding(5) var<storage, read_write> sorted_keys: array<u32>;
@group(0) @binding(6) var<storage, read_write> sorted_payloads: array<u32>;

/// Two words of holders: with 256 threads, looking through eight words for each pair took llvmpipe twice as long.
const SORT_THREADS: u32 = 64u;
/// Pairs of a workgroup.
const SORT_BLOCK: u32 = 2048u;

/// Keys of each digit in the block.
var<workgroup> histogram: array<atomic<u32>, 256>;
/// Where the next pair of each digit goes.
var<workgroup> next: array<u32, 256>;
/// Which of the 64 threads hold each digit, a bit each.
var<workgroup> holders: array<atomic<u32>, 512>;

fn digit_of(key: u32) -> u32 {
    return (key >> digit.shift) & digit.mask;
}

/// The end of a block's pairs.
fn end_of(first: u32) -> u32 {
    return min(first + SORT_BLOCK, min(count[0], digit.capacity));
}

/// Counts the digits of each block; one workgroup each.
@compute @workgroup_size(64)
fn sort_count(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let block = grid_index(workgroup_id, num_workgroups, 0u, 1u);
    if block >= digit.blocks {
        return;
    }
    let first = block * SORT_BLOCK;
    let end = end_of(first);
    for (var i = first + thread; i < end; i += SORT_THREADS) {
        atomicAdd(&histogram[digit_of(keys[i])], 1u);
    }
    workgroupBarrier();
    for (var d = thread; d <= digit.mask; d += SORT_THREADS) {
        digit_counts[d * digit.blocks + block] = atomicLoad(&histogram[d]);
    }
}

/// Moves the pairs of each block to where the counts say; one workgroup each.
@compute @workgroup_size(64)
fn sort_scatter(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let block = grid_index(workgroup_id, num_workgroups, 0u, 1u);
    if block >= digit.blocks {
        return;
    }
    // The first barrier below is between this and the first use.
    for (var d = thread; d <= digit.mask; d += SORT_THREADS) {
        next[d] = digit_counts[d * digit.blocks + block];
    }
    let first = block * SORT_BLOCK;
    let end = end_of(first);
    let word = thread / 32u;
    let bit = thread % 32u;
    for (var tile = first; tile < end; tile += SORT_THREADS) {
        let i = tile + thread;
        var key = 0u;
        var d = 0u;
        if i < end {
            key = keys[i];
            d = digit_of(key);
            atomicOr(&holders[2u * d + word], 1u << bit);
        }
        workgroupBarrier();
        var at = 0u;
        var is_last = false;
        if i < end {
            // Pairs of one digit keep their order: each goes behind those of the threads before.
            let low = atomicLoad(&holders[2u * d]);
            let high = atomicLoad(&holders[2u * d + 1u]);
            let own = select(low, high, word == 1u);
            let before = countOneBits(own & ((1u << bit) - 1u)) + select(0u, countOneBits(low), word == 1u);
            is_last = (own >> bit) == 1u && (word == 1u || high == 0u);
            at = next[d] + before;
            sorted_keys[at] = key;
            sorted_payloads[at] = payloads[i];
        }
        workgroupBarrier();
        if i < end {
            if is_last {
                next[d] = at + 1u;
            }
            atomicStore(&holders[2u * d + word], 0u);
        }
        workgroupBarrier();
    }
}

/// Copies all pairs.
@compute @workgroup_size(64)
fn sort_copy(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, thread, SORT_THREADS);
    if i < min(count[0], digit.capacity) {
        sorted_keys[i] = keys[i];
        sorted_payloads[i] = payloads[i];
    }
}
