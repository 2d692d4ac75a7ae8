#![doc = include_str!("../README.md")]

pub mod pattern;

mod cells;
mod frame;
mod settings;
mod shape;
mod sparse;
mod state;

pub use glam;
pub use settings::{Density, Settings, Start};
pub use state::{State, Update};
