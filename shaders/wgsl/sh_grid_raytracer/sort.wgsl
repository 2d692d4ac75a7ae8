// no_photons: an empty list. sort_keys: the cells of stored photons, to be sorted by. run_marks, run_begins: where runs of the sorted list begin, [C] to [E] of the
// paper's figure 3. Twin: crates/sh-grid-raytracer/src/cpu/radiance.rs.

@group(0) @binding(0) var<uniform> settings: FrameSettings;
/// Stored photons, and those that found no room.
@group(0) @binding(1) var<storage, read_write> count: array<u32>;
@group(0) @binding(2) var<storage, read> stored: array<StoredPhoton>;
@group(0) @binding(3) var<storage, read_write> keys: array<u32>;
@group(0) @binding(4) var<storage, read_write> payloads: array<u32>;
/// 1 where a run begins; after a scan, the runs before each photon.
@group(0) @binding(5) var<storage, read_write> marks: array<u32>;
/// Where each run begins, and where the last one ends.
@group(0) @binding(6) var<storage, read_write> begins: array<u32>;
/// The first run of each boundary cell and the one after its last.
@group(0) @binding(7) var<storage, read_write> cell_runs: array<vec2<u32>>;

/// Photons of a sorted list that one thread sums at most.
const RUN: u32 = 128u;

@compute @workgroup_size(1)
fn no_photons() {
    count[0] = 0u;
    count[1] = 0u;
}

@compute @workgroup_size(64)
fn sort_keys(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < min(count[0], settings.capacity) {
        keys[i] = stored[i].cell;
        payloads[i] = i;
    }
}

fn first_of_cell(i: u32) -> bool {
    if i == 0u {
        return true;
    }
    return stored[payloads[i]].cell != stored[payloads[i - 1u]].cell;
}

@compute @workgroup_size(64)
fn run_marks(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < settings.boundary {
        cell_runs[i] = vec2(0u);
    }
    if i < settings.capacity {
        let n = min(count[0], settings.capacity);
        var mark = false;
        if i < n {
            mark = i % RUN == 0u || first_of_cell(i);
        }
        marks[i] = u32(mark);
    }
}

@compute @workgroup_size(64)
fn run_begins(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    let n = min(count[0], settings.capacity);
    if i >= n {
        return;
    }
    let first = first_of_cell(i);
    let begin = i % RUN == 0u || first;
    // Runs before this photon and, with its own, those up to it.
    let before = marks[i];
    let upto = before + u32(begin);
    if begin {
        begins[before] = i;
    }
    let cell = stored[payloads[i]].cell;
    if first {
        cell_runs[cell].x = before;
    }
    if i + 1u == n {
        begins[upto] = n;
        cell_runs[cell].y = upto;
    } else if first_of_cell(i + 1u) {
        cell_runs[cell].y = upto;
    }
}
