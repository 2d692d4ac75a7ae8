use core::ops::Range;

use indirect_core::{BadClipMatrix, SceneError};
use thiserror::Error;

/// What can go wrong between the CPU and the GPU.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum GpuError {
    /// No adapter fits the choice.
    #[error(
        "no GPU adapter {wanted}; found: {found}. A software one needs no GPU: `apt-get install mesa-vulkan-drivers`"
    )]
    NoAdapter {
        /// What was asked for.
        wanted: String,
        /// Names of the adapters there are.
        found: String,
    },
    /// The adapter refuses to open a device.
    #[error("adapter {adapter} gives no device: {reason}")]
    NoDevice {
        /// Name of the adapter.
        adapter: String,
        /// What it said.
        reason: String,
    },
    /// Something is larger than the device allows.
    #[error("{what} needs {needed}, but the device's {limit} is {available}")]
    Limit {
        /// The thing that is too large.
        what: &'static str,
        /// Name of the WebGPU limit.
        limit: &'static str,
        /// Size needed, in the unit of the limit.
        needed: u64,
        /// The limit.
        available: u64,
    },
    /// A size that must not be zero is.
    #[error("{what} must be at least 1×1, got {width}×{height}")]
    EmptySize {
        /// The thing that is empty.
        what: &'static str,
        /// Width asked for.
        width: u32,
        /// Height asked for.
        height: u32,
    },
    /// A kernel binds a name that was not given.
    #[error("{kernel} binds `{name}`, which was not given")]
    Unbound {
        /// The kernel.
        kernel: String,
        /// The name.
        name: &'static str,
    },
    /// A texture or buffer that the caller gave is of another size than needed.
    #[error("{what} must have {}×{} texels, but has {}×{}", needed[0], needed[1], found[0], found[1])]
    Size {
        /// What was given.
        what: &'static str,
        /// Texels needed.
        needed: [u32; 2],
        /// Texels found.
        found: [u32; 2],
    },
    /// A texture that the caller gave cannot be used.
    #[error("{what} must be a texture of {needed}, but is one of {found}")]
    Texture {
        /// What was given.
        what: &'static str,
        /// Format and usages needed.
        needed: &'static str,
        /// Format and usages found.
        found: String,
    },
    /// A buffer that the caller gave lacks a usage.
    #[error("{what} must have the usages {needed:?}, but has {found:?}")]
    Usage {
        /// What was given.
        what: &'static str,
        /// Usages needed.
        needed: wgpu::BufferUsages,
        /// Usages found.
        found: wgpu::BufferUsages,
    },
    /// A matrix is not that of a camera.
    #[error(transparent)]
    ClipMatrix(#[from] BadClipMatrix),
    /// The scene has no such vertices.
    #[error("vertices {}..{} of a scene that has {count}", range.start, range.end)]
    Vertices {
        /// Vertices asked for.
        range: Range<u32>,
        /// Vertices of the scene.
        count: u32,
    },
    /// There is no such moving object.
    #[error("object {object} of {count}")]
    NoObject {
        /// Index asked for.
        object: usize,
        /// Number of objects.
        count: usize,
    },
    /// The scene is not valid.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The device was lost, or a buffer could not be mapped, while results were read.
    #[error("cannot read `{label}` back: {reason}")]
    ReadBack {
        /// What was being read.
        label: String,
        /// What went wrong.
        reason: String,
    },
}
