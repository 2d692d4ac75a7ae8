//! The passes in plain Rust: what the GPU is held against, and the fallback where there is none.

mod bounce;
mod estimate;
mod field;
mod reconstruct;
mod sample;
mod visibility;

pub use bounce::{PLACES, bounce};
pub use estimate::{Estimate, estimate};
pub use field::{Field, Plane, surroundings_at};
pub use reconstruct::{READS, irradiance, reconstruct};
pub use sample::sample;
pub use visibility::{STEPS, share_of_blocked, visibility, words};
