#![doc = include_str!("../README.md")]

#[cfg(feature = "cpu")]
pub mod cpu;

mod reduced;

pub use reduced::Reduced;
