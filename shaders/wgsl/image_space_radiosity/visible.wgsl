// What `traverse` asks where shadow maps tell what stands between lights and fragments.
// Twin: light_visible in crates/image-space-radiosity/src/cpu/shadows.rs.

@group(0) @binding(8) var<storage, read> shadow_vpls: array<Vpl>;
@group(0) @binding(9) var<storage, read> ism_atlas: array<f32>;
@group(0) @binding(10) var<uniform> ism: Ism;

const HORIZON: f32 = 0.015625;

/// Whether light that belongs to the shadow map `representative` reaches a receiver; it does where the map has no answer.
fn light_visible(representative: u32, receiver: u32, position: vec3<f32>, normal: vec3<f32>) -> bool {
    let own = shadow_vpls[representative].position;
    let own_normal = shadow_vpls[representative].normal;
    let v = position - own;
    let least = HORIZON * sqrt(dot(v, v));
    if !(dot(own_normal, v) > least && -dot(normal, v) > least) {
        return true;
    }
    return ism_visible_surface(representative, own, own_normal, position, normal);
}
