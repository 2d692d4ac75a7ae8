// For accel/traverse.wgsl in modules with the scene: rays pass through the holes of alpha masks.
// Needs core/{texture,scene,surface}.wgsl. Twin: indirect_core::Scene::is_solid.

fn accel_is_solid(triangle: u32, u: f32, v: f32) -> bool {
    return surface_is_solid(scene_triangles[triangle], vec3<f32>(1.0 - u - v, u, v));
}
