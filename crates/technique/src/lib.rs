#![doc = include_str!("../README.md")]

#[cfg(feature = "cpu")]
pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;
mod technique;

pub use glam;
pub use technique::{Frame, Row, Technique};
