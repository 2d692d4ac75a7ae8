// cast_closest, cast_any: what a buffer of rays hits, one ray per thread. Needs core/grid.wgsl, accel/traverse.wgsl and
// accel/rays_opaque.wgsl or accel/rays_masked.wgsl, which declare what is bound. Host: indirect_accel::gpu::Rays.
// Twin: crates/accel/src/traverse.rs.

struct AccelRay {
    origin: vec3<f32>,
    /// Hits count with 0 ≤ t < t_max.
    t_max: f32,
    direction: vec3<f32>,
}

struct AccelRayCount {
    count: u32,
}

@compute @workgroup_size(64)
fn cast_closest(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i >= accel_ray_count.count {
        return;
    }
    let ray = accel_rays[i];
    accel_hits[i] = accel_closest_hit(ray.origin, ray.direction, ray.t_max);
}

@compute @workgroup_size(64)
fn cast_any(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i >= accel_ray_count.count {
        return;
    }
    let ray = accel_rays[i];
    accel_occluded[i] = accel_occlusion(ray.origin, ray.direction, ray.t_max);
}
