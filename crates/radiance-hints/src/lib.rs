#![doc = include_str!("../README.md")]

#[cfg(feature = "cpu")]
pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod layout;

mod error;
mod params;
mod volume;

pub use error::Error;
pub use layout::{Sample, Surroundings, Volume, Window};
pub use params::{
    Draw, Enclosure, INTERLEAVE, Options, Order, Params, Reconstruction, Sampling, Scale, Transport,
    Visibility,
};
pub use volume::{Lattice, MAX_HINTS, MAX_VOLUMES};
