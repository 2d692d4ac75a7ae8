// Which cells there are. Needs `cell_index: array<u32>`: for every cell of the cubes of all levels its place, or NO_CELL.
// Twin: Voxels::boundary_at in crates/sh-grid-raytracer/src/voxels.rs.

/// Place of the boundary cell that holds a point in units of cells; NO_CELL where there is none.
fn boundary_at(local: vec3<f32>) -> u32 {
    if !(all(local >= vec3(0.0)) && all(local < vec3<f32>(settings.size))) {
        return NO_CELL;
    }
    let place = cell_index[grid_number(vec3<u32>(local), settings.size)];
    return select(NO_CELL, place, place < settings.boundary);
}
