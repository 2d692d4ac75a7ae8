use thiserror::Error;

/// Why a frame could not be made.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// An option is outside its range.
    #[error(transparent)]
    BadOption(#[from] indirect_core::settings::BadOption),
    /// The device cannot hold the buffers, or was lost.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(#[from] indirect_gpu::GpuError),
    /// Buffers were made for fewer cells than a scene that moved has now.
    #[cfg(feature = "gpu")]
    #[error("resources hold {available} {what}, the scene now has {needed}: make new resources")]
    Capacity {
        /// What there are too many of.
        what: &'static str,
        /// How many the resources hold.
        available: usize,
        /// How many there are.
        needed: usize,
    },
}
