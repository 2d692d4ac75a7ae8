use thiserror::Error;

/// Why image-space radiosity could not be computed.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// An option or parameter is outside its range.
    #[error("{option} is {value}, it must be {requirement}")]
    BadOption {
        /// Name of the option.
        option: &'static str,
        /// The value, printed.
        value: String,
        /// Its range.
        requirement: &'static str,
    },
    /// The reflective shadow maps could not be made.
    #[error(transparent)]
    Rsm(#[from] rsm::Error),
    /// The device cannot hold the buffers, or was lost.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(#[from] indirect_gpu::GpuError),
}
