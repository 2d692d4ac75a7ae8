// What accel/rays.wgsl binds where the scene is not needed.

@group(0) @binding(0) var<storage, read> accel_nodes: array<AccelNode>;
@group(0) @binding(1) var<storage, read> accel_triangles: array<AccelTriangle>;
@group(0) @binding(2) var<storage, read> accel_rays: array<AccelRay>;
@group(0) @binding(3) var<uniform> accel_ray_count: AccelRayCount;
@group(0) @binding(4) var<storage, read_write> accel_hits: array<AccelHit>;
/// 1: something is hit; 0: nothing; 2: not known.
@group(0) @binding(5) var<storage, read_write> accel_occluded: array<u32>;
