#![doc = include_str!("../README.md")]
//!
//! # Definitions
//!
//! With `x` the image, `r` the reference and means over the pixels where the reference sees a surface, in f64, for the
//! luminance and for each channel ([`Measures`]):
//!
//! ```text
//! bias      = mean(x) / mean(r) − 1                              signed: positive is too bright
//! rel_rmse  = √mean((x − r)²) / mean(r)
//! rel_mse   = mean((x − r)² / (r² + 0.01·mean(r)²))              weighs dark pixels as much as bright ones
//! p50, p95, p99  of |x − r| / mean(r)
//! flip      = mean FLIP at the exposure of the reference         what an eye at 67 pixels per degree would notice
//! ```
//!
//! The noise floor is the reference's own standard error by the same measures: an image that equals the truth still
//! scores that much. [`Measures::below_floor`] says which differences the reference cannot resolve.

mod compare;
mod error;
pub mod flip;
mod mask;
pub mod palette;

pub use compare::{BelowFloor, Comparison, Measures, Reference, compare, difference, exposure};
pub use error::MetricsError;
pub use glam;
