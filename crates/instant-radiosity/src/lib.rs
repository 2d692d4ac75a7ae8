#![doc = include_str!("../README.md")]

#[cfg(feature = "cpu")]
pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod layout;

#[cfg(feature = "cpu")]
mod fit;
mod output;
mod passes;
#[cfg(feature = "cpu")]
mod sequence;
mod settings;
mod setup;

pub use glam;
pub use output::{InstantRadiosity, Output};
#[cfg(feature = "cpu")]
pub use sequence::CYCLE;
pub use settings::{Bounce, Gather, Options, Params, Sequence, Switch, Visibility};
pub use setup::{Fitted, Setup};
