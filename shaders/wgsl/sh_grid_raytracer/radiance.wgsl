// sum_runs, sum_cells: the flux through the faces of each boundary cell and the area that sent it. sum_level: the coarser levels.
// Twin: crates/sh-grid-raytracer/src/cpu/radiance.rs.

/// A level that is made.
struct LevelRange {
    first: u32,
    count: u32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> settings: FrameSettings;
@group(0) @binding(1) var<storage, read> total: array<u32>;
@group(0) @binding(2) var<storage, read> stored: array<StoredPhoton>;
@group(0) @binding(3) var<storage, read> payloads: array<u32>;
@group(0) @binding(4) var<storage, read> begins: array<u32>;
@group(0) @binding(5) var<storage, read> cell_runs: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read_write> run_sums: array<Faces>;
/// Area of the surfaces in each boundary cell, by face.
@group(0) @binding(7) var<storage, read> areas: array<f32>;
@group(0) @binding(8) var<storage, read_write> faces: array<Faces>;
@group(0) @binding(9) var<storage, read> children: array<u32>;
@group(0) @binding(10) var<uniform> level: LevelRange;

@compute @workgroup_size(64)
fn sum_runs(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let k = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if k >= total[0] {
        return;
    }
    var sums = Faces();
    for (var i = begins[k]; i < begins[k + 1u]; i++) {
        let photon = stored[payloads[i]];
        let shares = face_shares(photon.axis);
        for (var axis = 0u; axis < 3u; axis++) {
            sums.faces[2u * axis] += vec4(photon.flux * shares.below[axis], 0.0);
            sums.faces[2u * axis + 1u] += vec4(photon.flux * shares.above[axis], 0.0);
        }
    }
    run_sums[k] = sums;
}

@compute @workgroup_size(64)
fn sum_cells(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i >= settings.boundary {
        return;
    }
    var sums = Faces();
    for (var f = 0u; f < 6u; f++) {
        sums.faces[f].w = select(areas[6u * i + f], settings.cell * settings.cell, settings.printed == 1u);
    }
    for (var k = cell_runs[i].x; k < cell_runs[i].y; k++) {
        for (var f = 0u; f < 6u; f++) {
            sums.faces[f] += run_sums[k].faces[f];
        }
    }
    faces[i] = sums;
}

@compute @workgroup_size(64)
fn sum_level(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let k = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if k >= level.count {
        return;
    }
    let i = level.first + k;
    var sums = Faces();
    for (var c = 0u; c < 8u; c++) {
        let child = children[8u * (i - settings.boundary) + c];
        if child != NO_CELL {
            for (var f = 0u; f < 6u; f++) {
                sums.faces[f] += faces[child].faces[f];
            }
        }
    }
    faces[i] = sums;
}
