// What `field` binds where its rays go through the scene's acceleration structure.

@group(0) @binding(7) var<storage, read> accel_nodes: array<AccelNode>;
@group(0) @binding(8) var<storage, read> accel_triangles: array<AccelTriangle>;
@group(0) @binding(9) var<storage, read> triangle_normals: array<u32>;
