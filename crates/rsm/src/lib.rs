#![doc = include_str!("../README.md")]

#[cfg(feature = "cpu")]
pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod layout;
pub mod views;

mod error;
mod passes;
mod rsm;
mod selection;
mod tree;

pub use error::Error;
pub use glam;
pub use indirect_core::MapView;
#[doc(hidden)]
pub use indirect_technique;
pub use layout::{Branch, Node, Texel, Vpl};
pub use passes::MAP_PASSES;
pub use rsm::{Level, MAX_RESOLUTION, Map, Pyramid, PyramidLayout, Rsm};
pub use selection::{Bound, Form, Select, Selection};
pub use tree::TreeLayout;

/// Neighbouring receivers that share one cut through a tree of lights.
pub const TILE: usize = 8;
