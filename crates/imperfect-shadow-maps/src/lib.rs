#![doc = include_str!("../README.md")]

#[cfg(feature = "cpu")]
pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod layout;

mod place;
mod settings;

pub use layout::{Ism, Point, ScenePoint};
pub use place::{Placement, place};
pub use settings::Options;

/// What a texel holds in which nothing was drawn: nothing is in the way there. Maps hold `1 / (distance + height)`, 1/m, where
/// the height is that above the VPL's plane: 0 is infinitely far.
pub const EMPTY: f32 = 0.0;
