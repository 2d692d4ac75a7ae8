// Imperfect shadow maps of virtual lights.
// Twin: Maps in crates/instant-radiosity/src/cpu/shadow.rs.

@group(0) @binding(10) var<uniform> ism: Ism;
@group(0) @binding(11) var<storage, read> ism_atlas: array<f32>;

fn shadow_visible(slot: u32, position: vec3<f32>, normal: vec3<f32>, p: vec3<f32>, n: vec3<f32>) -> bool {
    return ism_visible_surface(slot, position, normal, p, n);
}
