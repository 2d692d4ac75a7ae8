//! The passes in plain Rust: what the GPU is held against, and the fallback where there is none.

pub(crate) mod bounce;
pub(crate) mod depths;
pub(crate) mod directions;
mod enclosure;
pub(crate) mod estimate;
pub(crate) mod field;
mod frame;
pub(crate) mod look;
pub(crate) mod near;
pub(crate) mod occlusion;
pub(crate) mod reconstruct;
pub(crate) mod sample;
pub(crate) mod stops;
pub(crate) mod upsample;

pub use bounce::{bounce, visibility};
pub use directions::{Directions, bounce_seed};
pub use enclosure::enclosure;
pub use estimate::{Estimate, estimate};
pub use field::{Field, Plane, nearest_hint, pack};
pub use frame::{indirect, indirect_from};
pub use indirect_technique::{Frame, cpu::Fit};
pub use look::Samples;
pub use near::near;
pub use occlusion::{occlusion, share_of_blocked};
pub use reconstruct::{irradiance, reconstruct};
pub use sample::sample;
pub use stops::stops;
pub use upsample::upsample;
