// reduced: an image and a smaller one with a texel for each block of step × step pixels.
// Twin: crates/filter/src/reduced.rs.

struct Reduced {
    /// Width and height of the image.
    size: vec2<u32>,
    /// And of the smaller one.
    small: vec2<u32>,
    /// Pixels per texel along each side.
    step: u32,
    pad0: u32,
}

/// The number of the pixel at which a texel samples the image.
fn reduced_pixel(reduced: Reduced, texel: vec2<u32>) -> u32 {
    let at = min(texel * reduced.step + reduced.step / 2u, reduced.size - 1u);
    return at.y * reduced.size.x + at.x;
}
