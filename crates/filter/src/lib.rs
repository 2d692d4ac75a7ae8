#![doc = include_str!("../README.md")]

#[cfg(feature = "cpu")]
pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;

mod history;
mod reduced;

pub use glam;
pub use history::History;
pub use reduced::Reduced;
