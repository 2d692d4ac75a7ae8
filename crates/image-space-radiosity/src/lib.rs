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
pub use levels::{Levels, TILE};
pub use params::{Bound, Lights, Method, Options, Params, Thresholds};
