#![doc = include_str!("../README.md")]
#![warn(missing_debug_implementations)]

// A file uses only what stands below it:
//   store              estimates as files, the cache
//   points             irradiance at points
//   render             batches, until there are enough
//   trial              whether an image uses virtual lights
//   raster             the samples of a pixel
//   path               paths from the camera
//   vpls               paths from the lights
//   tracer             rays between the surfaces and lights of the scene
//   lights, emitters, surfaces, sampler
//   estimate, key      the result, and what names it
//   settings, error
mod emitters;
mod error;
mod estimate;
mod key;
mod lights;
mod path;
mod points;
mod raster;
mod render;
mod sampler;
mod settings;
mod store;
mod surfaces;
mod tracer;
mod trial;
mod vpls;

pub use error::Error;
pub use estimate::{Estimate, Mean};
pub use glam;
pub use points::{irradiance, irradiance_with};
pub use render::{render, render_with};
pub use settings::{Bounces, Components, EmitterSampling, PixelFilter, Samples, Settings, VirtualLights};
pub use store::render_cached;
