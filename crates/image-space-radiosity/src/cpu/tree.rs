//! `tree`: the patches linked for a traversal, each with the distance from which it is exact enough (§3.5).
//!
//! The bound of a patch's error is solved for the distance once per frame, so that the traversal decides by one comparison
//! (equation 8 has the same aim).

use rayon::prelude::*;
use rsm::cpu::{ALWAYS, reach};
use rsm::{Bound, Branch, Vpl};

use super::patches::Patches;
use crate::levels::{Links, level_of};

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
            let (next, child) = ((map * count) as u32 + links.next[k], (map * count) as u32 + links.child[k]);
            let branch = |light: Vpl| Branch {
                position: light.position,
                area: light.area,
                normal: light.normal,
                flux: light.flux,
                next,
                child,
                ..Branch::default()
            };
            match maps[map].get(links.order[k] as usize) {
                Ok(patch) => {
                    let level = level_of(&links.layout, links.order[k]);
                    let own = Branch { radius: patch.radius, versine: patch.versine, ..branch(patch.vpl()) };
                    let reach = if level <= finest || own.weight() <= 0.0 {
                        0.0
                    } else if level > coarsest {
                        ALWAYS
                    } else {
                        reach(&own, bound, threshold)
                    };
                    Branch { reach, ..own }
                }
                Err(texel) => branch(texel),
            }
        })
        .collect()
}
