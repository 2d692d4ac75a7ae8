//! `tree`: the patches linked for a traversal, each with the distance from which it is exact enough (§3.5).
//!
//! The bound of a patch's error is solved for the distance once per frame, so that the traversal decides by one comparison
//! (equation 8 has the same aim).

use rayon::prelude::*;
use rsm::cpu::{ALWAYS, reach};
use rsm::{Bound, Branch, Vpl};

use super::clusters::is_flat;
use super::patches::Patches;
use super::shadows::Tiles;
use crate::levels::{Links, level_of};
use crate::settings::Thresholds;

/// Which patches a traversal takes for one light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Split {
    /// Those that a receiver is far enough from for this bound: another cut for each tile, [`Lights::Hierarchical`].
    ///
    /// [`Lights::Hierarchical`]: crate::Lights::Hierarchical
    Far {
        /// What decides.
        bound: Bound,
        /// τ times the reference irradiance, W/m².
        threshold: f32,
    },
    /// Those without a discontinuity: the same cut for all, which is that of [`clusters`](super::clusters()).
    Flat(Thresholds),
}

/// The branches of all maps, one map after the other, in the order of `links`, whose finest level has no children.
///
/// Patches above the level `coarsest` are always subdivided. With `tiles` each branch names the shadow map that it asks.
#[must_use]
pub fn tree(
    maps: &[Patches<'_>],
    links: &Links,
    [coarsest, finest]: [usize; 2],
    split: Split,
    tiles: Option<&Tiles<'_>>,
) -> Vec<Branch> {
    let count = links.order.len();
    (0..maps.len() * count)
        .into_par_iter()
        .with_min_len(1024)
        .map(|i| {
            let (map, k) = (i / count, i % count);
            let (next, child) = ((map * count) as u32 + links.next[k], (map * count) as u32 + links.child[k]);
            let representative = tiles.map_or(0, |tiles| tiles.of(maps, map, links.order[k]));
            let branch = |light: Vpl| Branch {
                position: light.position,
                area: light.area,
                normal: light.normal,
                flux: light.flux,
                next,
                child,
                representative,
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
                        match split {
                            Split::Far { bound, threshold } => reach(&own, bound, threshold),
                            Split::Flat(thresholds) if is_flat(patch, thresholds) => 0.0,
                            Split::Flat(_) => ALWAYS,
                        }
                    };
                    Branch { reach, ..own }
                }
                Err(texel) => branch(texel),
            }
        })
        .collect()
}

/// The lights of a list as branches that have no children, each with a shadow map of its own.
#[must_use]
pub fn tree_of_list(lights: &[Vpl]) -> Vec<Branch> {
    let branch = |(i, light): (u32, &Vpl)| Branch {
        position: light.position,
        area: light.area,
        normal: light.normal,
        flux: light.flux,
        next: i + 1,
        representative: i,
        ..Branch::default()
    };
    (0..).zip(lights).map(branch).collect()
}
