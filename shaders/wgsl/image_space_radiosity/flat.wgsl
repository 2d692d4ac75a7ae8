// Whether a patch holds no discontinuity. Twin: is_flat in crates/image-space-radiosity/src/cpu/clusters.rs.

fn is_flat(own: Patch, depth: f32, versine: f32) -> bool {
    return own.relief < depth * own.radius && own.versine < versine;
}
