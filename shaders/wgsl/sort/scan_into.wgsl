// scan_into: the sums of the values before each, in a second buffer.
// Twin: exclusive_scan in crates/core/src/sort.rs.

@group(0) @binding(2) var<storage, read> values: array<u32>;
/// The sum of all.
@group(0) @binding(3) var<storage, read_write> total: array<u32>;
@group(0) @binding(4) var<storage, read_write> scanned: array<u32>;

fn scan_read(i: u32) -> u32 {
    return values[i];
}

fn scan_write(i: u32, before: u32, value: u32) {
    scanned[i] = before;
}

fn scan_first() -> u32 {
    return 0u;
}

fn scan_last(sum: u32) {
    total[0] = sum;
}
