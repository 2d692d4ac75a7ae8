//! Data shared by both backends, field by field as the WGSL of `shaders/wgsl/image_space_radiosity` declares it.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use rsm::Vpl;

indirect_core::wgsl_struct! {
    /// A square block of `2^level` × `2^level` pixels of the camera: mean and bounds of the surfaces that it shows. 48 bytes.
    ///
    /// A block that shows no surface is [`Block::EMPTY`].
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    pub struct Block = "Block" {
        /// Mean world position of its surface pixels, metres; of a pixel, its position.
        pub position: Vec3,
        /// Least view depth, metres.
        pub depth_min: f32,
        /// Unit axis of a cone that contains all normals; of a pixel, its normal.
        pub normal: Vec3,
        /// Greatest view depth, metres; below `depth_min` in an empty block.
        pub depth_max: f32,
        /// `1 − cos` of the cone's half angle, `[0, 2]`.
        pub versine: f32,
        /// Number of pixels that show a surface.
        pub pixels: u32,
        /// 1 where it shows both a surface and the background, else 0.
        pub mixed: u32,
        /// Radius of a sphere around `position` that contains the positions of its pixels, metres.
        pub radius: f32,
    }
}

impl Block {
    /// A block that shows no surface.
    pub const EMPTY: Self = Self {
        position: Vec3::ZERO,
        depth_min: f32::MAX,
        normal: Vec3::ZERO,
        depth_max: 0.0,
        versine: 0.0,
        pixels: 0,
        mixed: 0,
        radius: 0.0,
    };
}

/// State of a node, see [`Block`].
pub mod state {
    /// Shows no surface.
    pub const EMPTY: u32 = 0;
    /// Lies inside a valid block: its irradiance is interpolated.
    pub const COVERED: u32 = 1;
    /// A fragment: irradiance is gathered here.
    pub const VALID: u32 = 2;
    /// Subdivided.
    pub const SPLIT: u32 = 3;
}

indirect_core::wgsl_struct! {
    /// A square patch of `2^level` × `2^level` texels of a reflective shadow map as one light: sums, means and bounds over the
    /// texels that reflect. 64 bytes.
    ///
    /// A patch that reflects nothing is all zeros.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub struct Patch = "Patch" {
        /// Mean position, weighted by flux, metres.
        pub position: Vec3,
        /// Sum of the areas, m².
        pub area: f32,
        /// Mean normal, weighted by flux, made unit: the axis of a cone that contains all normals.
        pub normal: Vec3,
        /// Radius of a sphere around `position` that contains the patch, metres.
        pub radius: f32,
        /// Sum of the reflected flux, W.
        pub flux: Vec3,
        /// `1 − cos` of the cone's half angle, `[0, 2]`.
        pub versine: f32,
        /// Bound of the texels' distance from the plane through `position` across `normal`, metres.
        pub relief: f32,
        /// Fills the row.
        pub pad0: f32,
        /// Fills the row.
        pub pad1: f32,
        /// Fills the row.
        pub pad2: f32,
    }
}

impl Patch {
    /// Sum of the flux over the channels, W: positive where anything is reflected.
    #[must_use]
    pub fn weight(&self) -> f32 {
        self.flux.x + self.flux.y + self.flux.z
    }

    /// The patch as a virtual point light.
    #[must_use]
    pub const fn vpl(&self) -> Vpl {
        Vpl::new(self.position, self.normal, self.flux, self.area)
    }
}
