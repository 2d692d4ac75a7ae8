//! The passes on wgpu. The caller owns device, queue and encoder; nothing here submits or blocks.
//!
//! No optional feature is used. [`Maps::plan`], [`VplSlots::plan`] and [`VplList::plan`] say what will be allocated and which limits
//! that needs; WebGPU's defaults suffice up to 1024² texels per map.

mod list;
mod maps;
mod slots;
mod traversal;
mod tree;

pub use list::{CHUNK, VplList};
pub use maps::{MapBuffers, MapResources, MapSizes, Maps};
pub use slots::{SlotBuffers, VplSlots};
pub use traversal::Traversal;
pub use tree::{LightTree, TreeBuffers, TreeParams, TreeSizes};
