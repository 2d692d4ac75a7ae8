//! `reach`: the distance from which the lights beneath a branch may be taken for one.
//!
//! The bound of their error is solved for the distance when the tree is made, so that the traversal decides by one
//! comparison (Nichols, Shopf & Wyman 2009, §3.5; equation 8 has the same aim).

use core::f32::consts::PI;

use crate::{layout::Branch, selection::Bound};

/// The reach of a branch that is never exact enough, metres. Its square is finite.
pub const ALWAYS: f32 = 1e18;

/// The distance, metres, below which the bound of a branch exceeds `threshold`, W/m²; [`ALWAYS`] where that is not
/// positive.
#[must_use]
pub fn reach(branch: &Branch, bound: Bound, threshold: f32) -> f32 {
    if threshold <= 0.0 {
        return ALWAYS;
    }
    let flux = branch.weight() / 3.0;
    let reach = match bound {
        // Φ/(πd²)·(r²/d² + s) = T, a quadratic in 1/d².
        Bound::Error => {
            let s = branch.versine;
            let r2 = branch.radius * branch.radius;
            let far = flux / (PI * threshold);
            (0.5 * (far * s + (far * (far * (s * s) + 4.0 * r2)).sqrt())).sqrt()
        }
        // Φ/(πd² + A) = T, for the nearest point of the patch.
        Bound::ContributionAsPrinted => {
            branch.radius + ((flux / threshold - branch.area) / PI).max(0.0).sqrt()
        }
    };
    reach.min(ALWAYS)
}
