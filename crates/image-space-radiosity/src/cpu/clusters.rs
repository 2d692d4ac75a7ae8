//! `clusters`: the patches that hold no discontinuity, as large as they get, one list for all fragments (§3.4).

use rayon::prelude::*;
use rsm::{PyramidLayout, Vpl};

use super::patches::Patches;
use crate::{layout::Patch, levels::place, settings::Thresholds};

/// Whether a patch holds no discontinuity. Not `<=`, so that a threshold of 0 finds one everywhere.
#[inline]
pub(super) fn is_flat(p: &Patch, thresholds: Thresholds) -> bool {
    p.relief < thresholds.depth * p.radius && p.versine < thresholds.versine
}

/// One slot per node of each map's pyramid: its light where the node is a cluster, else [`Vpl::default`], whose flux is 0.
///
/// A cluster is flat or of the level `finest`, and the node above it is not flat or above the level `coarsest`. So each
/// texel belongs to exactly one.
#[must_use]
pub fn clusters(
    maps: &[Patches<'_>],
    layout: &PyramidLayout,
    [coarsest, finest]: [usize; 2],
    thresholds: Thresholds,
) -> Vec<Vpl> {
    let flat = |p: &Patch| is_flat(p, thresholds);
    let count = layout.len();
    (0..maps.len() * count)
        .into_par_iter()
        .with_min_len(1024)
        .map(|i| {
            let (map, node) = (&maps[i / count], i % count);
            let (level, x, y) = place(layout, node as u32);
            if level < finest || level > coarsest {
                return Vpl::default();
            }
            let own = &map.at(node);
            if own.weight() <= 0.0 {
                return Vpl::default();
            }
            // From the coarsest down: the first flat one is the cluster of all beneath.
            let mut above = coarsest;
            while above > level {
                let l = layout.levels[above];
                let shift = above - level;
                if flat(map.coarse((l.offset + (y >> shift) * l.size[0] + (x >> shift)) as usize)) {
                    return Vpl::default();
                }
                above -= 1;
            }
            if level == finest || flat(own) { own.vpl() } else { Vpl::default() }
        })
        .collect()
}
