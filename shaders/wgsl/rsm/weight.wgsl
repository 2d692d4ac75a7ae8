// The weight of a light among lights. Twin: weight of Branch in crates/rsm/src/layout.rs.

/// Sum of the channels.
fn weight(flux: vec3<f32>) -> f32 {
    return flux.x + flux.y + flux.z;
}
