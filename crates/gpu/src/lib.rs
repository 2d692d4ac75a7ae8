#![doc = include_str!("../README.md")]

mod bindings;
mod buffer;
mod compact;
mod context;
mod error;
mod export;
mod import;
mod kernel;
pub mod layout;
mod objects;
mod pass;
mod pipelines;
mod plan;
mod raster;
mod scan;
mod scene;
mod sort;
mod timer;
mod uniforms;

pub use bindings::{Named, bind_group, bind_group_layout, named};
pub use buffer::{empty_storage_buffer, read_buffer, read_range, storage_buffer, uniform_buffer};
pub use compact::{Compact, CompactBuffers};
pub use context::{ADAPTER_VARIABLE, AdapterChoice, Context};
pub use error::GpuError;
pub use export::ImageExport;
pub use glam;
pub use import::{
    DepthEncoding, GBufferFormat, GBufferImport, GBufferTextures, ImportUniform, ImportedTexel,
    NormalEncoding,
};
pub use indirect_core::PassTime;
pub use indirect_shaders as shaders;
pub use kernel::{Kernel, shader_module, workgroups_1d, workgroups_2d};
pub use layout::{Vec3Pad, ViewUniform};
pub use objects::{MovingObjects, PoseUniform};
pub use pass::{Pass, Use};
pub use pipelines::Pipelines;
pub use plan::Plan;
pub use raster::{GBufferTarget, Raster};
pub use scan::{Scan, ScanBuffers};
pub use scene::{SceneBuffers, scene_layout};
pub use sort::{RadixSort, SortBuffers, SortSizes};
pub use timer::PassTimer;
pub use uniforms::Uniforms;
pub use wgpu;
