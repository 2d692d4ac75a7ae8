//! The filters in plain Rust.

mod bilateral;
mod shade;
mod smooth;

pub use bilateral::bilateral;
pub use shade::{shade, shade_texels};
pub use smooth::{DEPTH_TOLERANCE, smooth};
