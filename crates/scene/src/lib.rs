#![doc = include_str!("../README.md")]

pub mod exr;
pub mod fixtures;
pub mod ktx2;
pub mod png;

mod error;
mod load;

pub use error::{ImageFileError, SceneLoadError};
pub use fixtures::resolve;
pub use glam;
pub use load::{LoadOptions, LoadStats, Loaded, load, load_bytes};
