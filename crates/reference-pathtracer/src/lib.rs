#![doc = include_str!("../README.md")]
#![warn(missing_debug_implementations)]

mod emitters;
mod error;
mod estimate;
mod key;
mod lights;
mod path;
mod pool;
mod render;
mod sampler;
mod settings;
mod store;
mod surfaces;

pub use error::Error;
pub use estimate::{Estimate, Mean};
pub use render::{render, render_with};
pub use settings::{Bounces, Components, EmitterSampling, PixelFilter, Samples, Settings, VirtualLights};
pub use store::render_cached;
