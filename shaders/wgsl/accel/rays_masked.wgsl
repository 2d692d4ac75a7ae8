// What accel/rays.wgsl binds beside the scene, which has group 0.

@group(1) @binding(0) var<storage, read> accel_nodes: array<AccelNode>;
@group(1) @binding(1) var<storage, read> accel_triangles: array<AccelTriangle>;
@group(1) @binding(2) var<storage, read> accel_rays: array<AccelRay>;
@group(1) @binding(3) var<uniform> accel_ray_count: AccelRayCount;
@group(1) @binding(4) var<storage, read_write> accel_hits: array<AccelHit>;
/// 1: something is hit; 0: nothing; 2: not known.
@group(1) @binding(5) var<storage, read_write> accel_occluded: array<u32>;
