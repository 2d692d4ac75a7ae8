// Directions about a normal, and origins of rays that leave a surface.
// Twin: indirect_core::math::{orthonormal_basis, offset_ray_origin_scaled}.

/// The vector whose coordinates about the unit vector n are l (Duff et al. 2017, JCGT 6(1)).
fn to_world(l: vec3<f32>, n: vec3<f32>) -> vec3<f32> {
    let s = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    let t = vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x);
    let u = vec3(b, s + n.y * n.y * a, -n.y);
    return t * l.x + u * l.y + n * l.z;
}

/// Twin of indirect_core::math::offset_ray_origin_scaled.
fn offset_ray_origin(p: vec3<f32>, n: vec3<f32>, unit: f32) -> vec3<f32> {
    return p + n * (unit * (1.0 / 131072.0) + dot(abs(n), abs(p)) * (1.0 / 1048576.0));
}
