//! The passes in plain Rust: what the GPU is held against, and the fallback where there is none.

mod bounce;
mod enclosure;
mod estimate;
mod field;
mod look;
mod reconstruct;
mod sample;
mod smooth;
mod upsample;
mod visibility;

pub use bounce::{bounce, bounce_seed};
pub use enclosure::enclosure;
pub use estimate::{Estimate, estimate};
pub use field::{Field, Plane, surroundings_at};
pub use reconstruct::{irradiance, low_size, reconstruct};
pub use sample::sample;
pub use smooth::{Previous, smooth};
pub use upsample::upsample;
pub use visibility::{STEPS, share_of_blocked, visibility, words};
