use indirect_core::SceneError;
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
