//! The passes in plain Rust: what the GPU is held against, and the fallback where there is none.

mod atlas;
mod cast;
mod frame;
mod pull;
mod push;
mod resolve;
mod splat;

pub use atlas::Atlas;
pub use cast::cast;
pub use frame::Frame;
pub use pull::pull;
pub use push::push;
pub use resolve::resolve;
pub use splat::splat;

use rsm::Vpl;

use crate::layout::Point;
use crate::settings::Options;

/// The maps of all VPLs: `splat`, `pull` and `push`.
#[must_use]
pub fn build(vpls: &[Vpl], points: &[Point], options: &Options) -> Atlas {
    let mut atlas = splat(vpls, points, options);
    pull(&mut atlas);
    push(&mut atlas);
    atlas
}
