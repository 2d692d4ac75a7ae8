use thiserror::Error;

/// Why reflective shadow maps could not be made.
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
    /// Buffers were made for another number of maps than the lights now need.
    #[error("resources hold {available} maps, the scene's lights need {needed}: make new resources")]
    MapCount {
        /// Maps that the resources hold.
        available: usize,
        /// Maps that the lights need.
        needed: usize,
    },
    /// A view names a light that does not exist.
    #[error("a view names light {index}, but there are only {count}")]
    NoSuchLight {
        /// The index it holds.
        index: usize,
        /// How many lights there are.
        count: usize,
    },
}
