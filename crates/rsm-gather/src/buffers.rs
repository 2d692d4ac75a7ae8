//! GPU buffers of the technique.

use indirect_gpu::{Vec3Pad, buffers};
use rsm::Selection;
use rsm::gpu::{Maps, VplList, VplSlots};

/// What the lengths of buffers follow from.
#[derive(Debug, Clone, Copy)]
pub struct Sizes {
    pub(crate) pixels: u64,
    pub(crate) resolution: u32,
    pub(crate) maps: usize,
    pub(crate) selection: Selection,
}

buffers! {
    /// Buffers of the camera's pixels.
    pub struct ImageBuffers for Sizes {
        /// Irradiance, W/m², and 0.
        irradiance: [Vec3Pad] = |s| s.pixels;
        /// Indirect radiance that leaves each, W/(sr·m²), and 0.
        image: [Vec3Pad] = |s| s.pixels;
    }
}

/// All buffers.
#[derive(Debug, Clone)]
pub struct Buffers {
    /// The maps.
    pub rsm: Maps,
    /// The VPLs that were drawn.
    pub slots: VplSlots,
    /// Those with flux.
    pub list: VplList,
    /// Irradiance and image.
    pub own: ImageBuffers,
}
