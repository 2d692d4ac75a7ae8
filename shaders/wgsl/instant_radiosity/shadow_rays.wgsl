// Rays through the scene between virtual lights and receivers.
// Twin: Rays in crates/instant-radiosity/src/cpu/shadow.rs.

fn shadow_visible(slot: u32, position: vec3<f32>, normal: vec3<f32>, p: vec3<f32>, n: vec3<f32>) -> bool {
    let origin = offset_ray_origin(p, n, settings.unit);
    let goal = offset_ray_origin(position, normal, settings.unit);
    return !accel_any_hit(origin, goal - origin, 1.0);
}
