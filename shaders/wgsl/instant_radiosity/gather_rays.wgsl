// What the gather with rays binds beside.
// Twin: crates/instant-radiosity/src/cpu/shadow.rs.

@group(0) @binding(7) var<storage, read> accel_nodes: array<AccelNode>;
@group(0) @binding(8) var<storage, read> accel_triangles: array<AccelTriangle>;
