// compact: where the elements that are kept go, in their order, behind those that a list holds already.
// Twin: compact in crates/core/src/sort.rs.

/// Room in the list.
struct Compact {
    capacity: u32,
}

/// Not 0 where an element is kept.
@group(0) @binding(2) var<storage, read> flags: array<u32>;
@group(0) @binding(3) var<storage, read_write> destinations: array<u32>;
/// Elements in the list; how many found no room.
@group(0) @binding(4) var<storage, read_write> count: array<u32, 2>;
@group(0) @binding(5) var<uniform> compact: Compact;

/// The destination of what is not kept.
const COMPACT_NONE: u32 = 0xffffffffu;

fn scan_read(i: u32) -> u32 {
    return u32(flags[i] != 0u);
}

fn scan_write(i: u32, before: u32, value: u32) {
    destinations[i] = select(COMPACT_NONE, before, value != 0u);
}

fn scan_first() -> u32 {
    return min(count[0], compact.capacity);
}

fn scan_last(sum: u32) {
    let held = min(sum, compact.capacity);
    count[0] = held;
    count[1] += min(sum - held, 0xffffffffu - count[1]);
}
