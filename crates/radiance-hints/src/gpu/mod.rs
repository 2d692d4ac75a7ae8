//! The passes on wgpu. The caller owns device, queue and encoder; nothing here submits or blocks.
//!
//! No optional feature is used. [`Resources::required_limits`] says which limits a setup needs.

pub(crate) mod buffers;
mod frame;

pub use buffers::{Buffers, OwnBuffers, Sizes};
pub use frame::Resources;
pub use indirect_technique::gpu::{GpuTechnique, Inputs};
