// One-dimensional grids beyond the 65 535 workgroups of one dimension: rows of workgroups, one below the other.
// Twin: indirect_gpu::workgroups_1d.

/// Index of an invocation from its builtins; may lie beyond the end of the data.
fn grid_index(workgroup_id: vec3<u32>, num_workgroups: vec3<u32>, local_index: u32, workgroup_size: u32) -> u32 {
    return (workgroup_id.y * num_workgroups.x + workgroup_id.x) * workgroup_size + local_index;
}
