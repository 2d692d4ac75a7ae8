#![doc = include_str!("../README.md")]

#[cfg(feature = "cpu")]
pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod layout;
pub mod views;

mod error;
mod params;
mod rsm;

pub use error::Error;
pub use layout::{Node, Texel, Vpl};
pub use params::{Form, Options, Params, Selection};
pub use rsm::{Level, Map, Pyramid, PyramidLayout, Rsm};
