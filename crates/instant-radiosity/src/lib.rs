#![doc = include_str!("../README.md")]

#[cfg(feature = "cpu")]
pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod layout;

mod output;
mod passes;
mod sequence;
mod settings;
mod setup;

pub use output::{InstantRadiosity, Output};
pub use sequence::CYCLE;
pub use settings::{Bounce, Gather, Options, Params, Sequence, Switch, Visibility};
pub use setup::{Fitted, Setup};
