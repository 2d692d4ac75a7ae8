#![doc = include_str!("../README.md")]

#[cfg(feature = "cpu")]
pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod layout;

mod output;
mod passes;
mod settings;
mod setup;
mod volume;

pub use glam;
pub use layout::{Near, Sample, Surroundings, Volume, Window};
pub use output::{Output, RadianceHints};
pub use rsm::Error;
pub use settings::{
    Options, Order, Params, Reconstruction, Sampling, Scale, Surround, Transport, Visibility,
};
pub use setup::{Draw, Enclosure, INTERLEAVE, Setup};
pub use volume::{Lattice, MAX_HINTS, MAX_VOLUMES};
