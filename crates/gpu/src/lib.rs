#![doc = include_str!("../README.md")]

mod buffer;
mod context;
mod error;
mod kernel;
pub mod layout;
mod raster;
mod scene;
mod timer;

pub use buffer::{empty_storage_buffer, read_buffer, storage_buffer, uniform_buffer};
pub use context::{ADAPTER_VARIABLE, AdapterChoice, Context};
pub use error::GpuError;
pub use indirect_shaders as shaders;
pub use kernel::{Kernel, shader_module, workgroups_1d, workgroups_2d};
pub use layout::{Vec3Pad, ViewUniform};
pub use raster::{GBufferTarget, Raster};
pub use scene::SceneBuffers;
pub use timer::{PassTime, PassTimer};
pub use wgpu;
