//! The passes in plain Rust: what the GPU is held against, and the fallback where there is none.

mod draw;
mod emit;
mod map;
mod spot;
mod trace;

pub use draw::{emitter_point, pick};
pub use emit::emit;
pub use map::{Flow, Tally, photon_map};
pub use trace::{LEAST_KEPT, MOST_KEPT, trace};
