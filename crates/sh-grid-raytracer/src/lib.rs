#![doc = include_str!("../README.md")]

#[cfg(feature = "cpu")]
pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod layout;

mod directions;
mod error;
#[cfg(feature = "cpu")]
mod fit;
mod grid;
mod output;
#[cfg(feature = "cpu")]
mod overlap;
mod passes;
mod pyramid;
mod settings;
mod setup;
#[cfg(feature = "cpu")]
mod voxeliser;
mod voxels;

pub use directions::{TURNS, spiral, turns};
pub use error::Error;
pub use glam;
pub use grid::{FINE, Grid, NONE};
pub use output::{Output, ShGridRaytracer};
pub use passes::FIELD_PASSES;
pub use pyramid::{Level, Pyramid};
pub use settings::{Gather, Options, Params, Reconstruct, Switch, Traverse, Weights};
pub use setup::{Fitted, Setup};
#[cfg(feature = "cpu")]
pub use voxeliser::{Openness, Voxeliser};
pub use voxels::{Voxels, face_shares};
