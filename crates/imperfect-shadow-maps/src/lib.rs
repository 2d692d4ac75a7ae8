#![doc = include_str!("../README.md")]

#[cfg(feature = "cpu")]
pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod layout;

mod place;
mod settings;

pub use glam;
pub use layout::{EMPTY, Ism, Point, ScenePoint};
pub use place::place;
pub use settings::{Options, Placement};
