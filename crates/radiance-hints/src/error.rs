use thiserror::Error;

/// Why radiance hints could not be made.
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
    /// The maps could not be made.
    #[error(transparent)]
    Rsm(#[from] rsm::Error),
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
    /// Buffers were made for a lattice of another shape.
    #[error("resources hold {available} hints, the lattice has {needed}: make new resources")]
    HintCount {
        /// Hints that the resources hold.
        available: usize,
        /// Hints of the lattice.
        needed: usize,
    },
}
