#![doc = include_str!("../README.md")]

#[cfg(feature = "cpu")]
pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod layout;

mod fitted;
mod levels;
mod output;
mod passes;
mod settings;

pub use fitted::Fitted;
pub use glam;
pub use layout::{Block, Patch};
pub use levels::{Links, Pyramids, RECEIVER_CELLS, SOURCE_CELLS, level_of_cells, place, z_order};
pub use output::{Fragments, ImageSpaceRadiosity, Irradiance, Output, Setup};
pub use rsm::{Bound, Branch, Error, Form, Select, TILE};
pub use settings::{Lights, Method, Options, Params, Thresholds, Visibility};
