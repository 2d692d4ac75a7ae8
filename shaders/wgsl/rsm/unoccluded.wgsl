// What `traverse` asks where nothing stands between lights and receivers.

/// Whether the virtual light of index `representative` is seen from a receiver; always.
fn light_visible(representative: u32, receiver: u32, position: vec3<f32>, normal: vec3<f32>) -> bool {
    return true;
}
