#![doc = include_str!("../README.md")]

#[cfg(feature = "cpu")]
pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;

#[cfg(feature = "gpu")]
mod buffers;
mod passes;
mod settings;

pub use glam;
pub use passes::{Output, RsmGather};
pub use rsm::{Error, Form, Select};
pub use settings::{Options, Params, Setup};
