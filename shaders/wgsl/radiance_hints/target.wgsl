// target: the image of the camera and the buffer of one of step × step pixels.
// Twin: low_size and pixel_of in crates/radiance-hints/src/cpu/reconstruct.rs.

struct Target {
    /// Width and height of the image.
    size: vec2<u32>,
    /// And of the buffer.
    small: vec2<u32>,
    /// Pixels per texel of the buffer, along each side.
    step: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

/// The pixel that a texel of the buffer stands for.
fn pixel_of(texel: vec2<u32>) -> vec2<u32> {
    return min(texel * image.step + image.step / 2u, image.size - 1u);
}
