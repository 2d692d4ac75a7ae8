//! Hierarchical warping: points of the unit square redistributed in proportion to an importance image (Clarberg et al. 2005,
//! "Wavelet Importance Sampling", §3, without its wavelets; the way an importance-driven set of virtual lights is drawn).
//!
//! The importance is summed into a pyramid. A point walks down from its root: each 2×2 group splits the point first by
//! row, then by column, in proportion to the sums, and stretches the part that it fell into back to `[0, 1)`. What
//! remains at the finest level is the place within the texel. Neighbours stay neighbours, so that a low-discrepancy set
//! stays well distributed, which an alias table or a draw over all texels in a row gives up.
//!
//! # Layout
//!
//! All levels follow each other in one buffer, level 0 (the image, row by row) first. Level `l + 1` has `⌈n/2⌉` texels
//! along an axis where level `l` has `n`, and the last level is a single texel. A texel holds the sum of its four
//! children; children beyond the border count as 0. The GPU reads the same buffer: `sampling/warp.wgsl`.
//!
//! # Hard cases
//!
//! * Negative, infinite and NaN importance counts as 0, and texels of zero importance are never chosen.
//! * A group whose children are all 0 below a parent that is not (levels from a filter that does not sum exactly), or a map of
//!   nothing but zeros with [`Empty::Uniform`], is divided by area.
//! * Densities are products of the ratios that were used to choose. So they are exact for what is sampled even if the
//!   levels do not add up.
//! * A point lies inside its texel, below its upper border, also where adding the texel's index would round up to it.
//!
//! ```
//! use glam::Vec2;
//! use indirect_sampling::warp::{Empty, Pyramid};
//!
//! # fn main() -> Result<(), indirect_sampling::warp::WarpError> {
//! // 3×2 texels, of which two are lit.
//! let pyramid = Pyramid::build([3, 2], &[0.0, 1.0, 0.0, 0.0, 0.0, 3.0])?;
//! let warp = pyramid.warp(Empty::Error)?;
//! let sample = warp.sample(Vec2::new(0.5, 0.5));
//! assert_eq!((sample.texel, sample.pdf), ([2, 1], 0.75));
//! assert!((2.0..3.0).contains(&sample.point.x) && (1.0..2.0).contains(&sample.point.y));
//! # Ok(())
//! # }
//! ```

mod equirect;
mod pyramid;

pub use equirect::{DirectionSample, Equirect};
pub use pyramid::*;
