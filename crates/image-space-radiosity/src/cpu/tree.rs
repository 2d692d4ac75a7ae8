//! `tree`: the patches linked for a traversal, each with the distance from which it is exact enough (§3.5).
//!
//! The bound of a patch's error is solved for the distance once per frame, so that the traversal decides by one comparison
//! (equation 8 has the same aim).

use core::f32::consts::PI;

use rayon::prelude::*;

use super::patches::Patches;
use crate::{
    layout::{Branch, Patch},
    levels::{Links, level_of},
    settings::Bound,
};

/// The reach of a patch that is never exact enough, metres. Its square is finite.
pub const ALWAYS: f32 = 1e18;

/// The branches of all maps, one map after the other, in the order of `links`, whose finest level has no children.
///
/// `threshold` is τ times the reference irradiance, W/m²; patches above the level `coarsest` are always subdivided.
#[must_use]
pub fn tree(
    maps: &[Patches<'_>],
    links: &Links,
    [coarsest, finest]: [usize; 2],
    bound: Bound,
    threshold: f32,
) -> Vec<Branch> {
    let count = links.order.len();
    (0..maps.len() * count)
        .into_par_iter()
        .with_min_len(1024)
        .map(|i| {
            let (map, k) = (i / count, i % count);
            let (light, reach) = match maps[map].get(links.order[k] as usize) {
                Ok(patch) => {
                    let level = level_of(&links.layout, links.order[k]);
                    let reach = if level <= finest || patch.weight() <= 0.0 {
                        0.0
                    } else if level > coarsest {
                        ALWAYS
                    } else {
                        reach(patch, bound, threshold)
                    };
                    (patch.vpl(), reach)
                }
                Err(texel) => (texel, 0.0),
            };
            Branch {
                position: light.position,
                area: light.area,
                normal: light.normal,
                reach,
                flux: light.flux,
                next: (map * count) as u32 + links.next[k],
                child: (map * count) as u32 + links.child[k],
                ..Branch::default()
            }
        })
        .collect()
}

/// The distance below which the bound of a patch exceeds `threshold`.
fn reach(patch: &Patch, bound: Bound, threshold: f32) -> f32 {
    if threshold <= 0.0 {
        return ALWAYS;
    }
    let flux = patch.weight() / 3.0;
    let reach = match bound {
        // Φ/(πd²)·(r²/d² + s) = T, a quadratic in 1/d².
        Bound::Error => {
            let s = patch.versine;
            let r2 = patch.radius * patch.radius;
            let far = flux / (PI * threshold);
            (0.5 * (far * s + (far * (far * (s * s) + 4.0 * r2)).sqrt())).sqrt()
        }
        // Φ/(πd² + A) = T, for the nearest point of the patch.
        Bound::ContributionAsPrinted => patch.radius + ((flux / threshold - patch.area) / PI).max(0.0).sqrt(),
    };
    reach.min(ALWAYS)
}
