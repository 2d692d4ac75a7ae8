use bytemuck::{Pod, Zeroable};

indirect_core::wgsl_struct! {
    /// An image and a smaller one that samples it: one texel for each block of `step × step` pixels.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
    pub struct Reduced = "Reduced" {
        /// Width and height of the image, pixels.
        pub size: [u32; 2],
        /// Width and height of the smaller one, texels.
        pub small: [u32; 2],
        /// Pixels per texel along each side, `≥ 1`.
        pub step: u32,
        /// Fills the row.
        pub pad0: u32,
    }
}

impl Reduced {
    /// The image of `size` pixels at one of `step × step` pixels, rounded up; a step of 0 counts as 1.
    #[must_use]
    pub fn new(size: [u32; 2], step: u32) -> Self {
        let step = step.max(1);
        Self { size, small: size.map(|n| n.div_ceil(step)), step, pad0: 0 }
    }

    /// Number of texels.
    #[must_use]
    pub fn texels(&self) -> u32 {
        self.small[0] * self.small[1]
    }

    /// The number of the pixel, row by row, at which the texel `(x, y)` samples the image: the middle of its block, or the
    /// image's last pixel where the block is cut there.
    #[must_use]
    pub fn pixel_of(&self, [x, y]: [u32; 2]) -> u32 {
        let along = |axis: usize, texel: u32| (texel * self.step + self.step / 2).min(self.size[axis] - 1);
        along(1, y) * self.size[0] + along(0, x)
    }
}
