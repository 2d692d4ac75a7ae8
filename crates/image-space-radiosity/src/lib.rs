#![doc = include_str!("../README.md")]

#[cfg(feature = "cpu")]
pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod layout;

mod error;
mod levels;
mod params;

pub use error::Error;
pub use layout::{Block, Branch, Patch};
pub use levels::{Links, RECEIVER_CELLS, SOURCE_CELLS, TILE, level_of_cells, place, z_order};
pub use params::{Bound, Lights, Method, Options, Params, Thresholds};
