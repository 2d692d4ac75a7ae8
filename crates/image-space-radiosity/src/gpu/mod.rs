//! Frames on wgpu. The caller owns device, queue and encoder; nothing here submits or blocks.
//!
//! [`Resources::required_limits`] says what a device must allow; WebGPU's defaults suffice for the default options at 3840×2160 and
//! for twelve maps of 512². [`Method::Splat`](crate::Method::Splat) and [`Method::BoundedSplat`](crate::Method::BoundedSplat) blend
//! into 32-bit floats where the device has `FLOAT32_BLENDABLE`, else into 16-bit floats, which lose digits; nothing else asks for
//! an optional feature.
//!
//! The fragments are a compacted list with indirect dispatch rather than a stencil test: the same blocks are found by the same
//! test, and the gather, which is compute, has no rasteriser that a stencil could spare work.

mod buffers;
mod passes;
mod splat;

pub use buffers::{Buffers, FrameBuffers, Part, PartBuffers, PartSizes, Sizes};
pub use indirect_technique::gpu::{GpuTechnique, Inputs};

#[cfg(feature = "cpu")]
pub(crate) use passes::same_answers;
pub(crate) use passes::{
    clusters, compact, gather, mips, patches, pull, push, refine, shade, shadows, sources, traverse, tree,
    vpls,
};
pub(crate) use splat::splat;

/// Buffers and passes of the technique.
pub type Resources = indirect_technique::gpu::Resources<crate::output::ImageSpaceRadiosity>;
