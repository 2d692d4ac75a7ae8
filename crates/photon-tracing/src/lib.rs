#![doc = include_str!("../README.md")]

#[cfg(feature = "cpu")]
pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod layout;

mod emitters;
mod sources;

pub use emitters::{Emitters, solid_mean};
pub use glam;
pub use layout::{Emitter, Photon, PhotonSettings, PunctualLight};
pub use sources::{Params, Sources};
