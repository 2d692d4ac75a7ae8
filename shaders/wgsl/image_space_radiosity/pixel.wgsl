// Blocks of level 0, which are the camera's pixels and not stored.
// Twin: pixel in crates/image-space-radiosity/src/cpu/blocks.rs.

@group(0) @binding(10) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(11) var<storage, read> normals: array<vec4<f32>>;

const BLOCK_EMPTY: Block = Block(vec3(0.0), 0x1.fffffep+127, vec3(0.0), 0.0, 0.0, 0u, 0u, 0.0);

/// The block of one pixel of the camera.
fn pixel(i: u32) -> Block {
    let normal = normals[i].xyz;
    if all(normal == vec3(0.0)) {
        return BLOCK_EMPTY;
    }
    let depth = positions[i].w;
    return Block(positions[i].xyz, depth, normal, depth, 0.0, 1u, 0u, 0.0);
}
