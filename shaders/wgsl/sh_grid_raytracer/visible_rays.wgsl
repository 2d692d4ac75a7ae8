// Whether nothing is between a surface and the centre of a cell, by a ray. Twin: Field::is_visible in
// crates/sh-grid-raytracer/src/cpu/interpolate.rs.

@group(0) @binding(7) var<storage, read> accel_nodes: array<AccelNode>;
@group(0) @binding(8) var<storage, read> accel_triangles: array<AccelTriangle>;

fn is_visible(p: vec3<f32>, n: vec3<f32>, v: vec3<f32>) -> bool {
    return !accel_any_hit(offset_ray_origin(p, n, settings.unit), v * settings.cell, 1.0);
}
