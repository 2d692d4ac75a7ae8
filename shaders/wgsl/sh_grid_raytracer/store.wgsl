// store_cells, store_append: photons that a surface has just reflected, with the cells that they leave from.
// Twin: crates/sh-grid-raytracer/src/cpu/store.rs.

@group(0) @binding(0) var<uniform> settings: FrameSettings;
@group(0) @binding(1) var<storage, read> photons: array<Photon>;
@group(0) @binding(2) var<storage, read> cell_index: array<u32>;
@group(0) @binding(3) var<storage, read> accel_nodes: array<AccelNode>;
@group(0) @binding(4) var<storage, read> accel_triangles: array<AccelTriangle>;
@group(0) @binding(5) var<storage, read_write> flags: array<u32>;
@group(0) @binding(6) var<storage, read_write> photon_cells: array<u32>;
@group(0) @binding(7) var<storage, read> destinations: array<u32>;
@group(0) @binding(8) var<storage, read_write> stored: array<StoredPhoton>;

@compute @workgroup_size(64)
fn store_cells(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i >= settings.photons {
        return;
    }
    let photon = photons[i];
    var cell = NO_CELL;
    if photon.state == PHOTON_ALIVE {
        cell = boundary_at(grid_local(photon.position));
        if cell != NO_CELL && settings.store_reach > 0.0 {
            let origin = offset_ray_origin(photon.position, photon.normal, settings.unit);
            if accel_any_hit(origin, photon.direction, settings.store_reach) {
                cell = NO_CELL;
            }
        }
    }
    photon_cells[i] = cell;
    flags[i] = u32(cell != NO_CELL);
}

@compute @workgroup_size(64)
fn store_append(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i >= settings.photons || destinations[i] >= settings.capacity {
        return;
    }
    let photon = photons[i];
    let axis = select(photon.normal, photon.direction, settings.printed == 1u);
    stored[destinations[i]] = StoredPhoton(photon.flux, photon_cells[i], axis, i);
}
