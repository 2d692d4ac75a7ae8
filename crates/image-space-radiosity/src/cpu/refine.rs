//! `refine`: where light is gathered, in one pass over all levels (§3.2.1).
//!
//! A block is *valid* where it needs no subdivision and every block above it does. Each node decides that alone, by asking
//! all blocks that contain it. So every surface pixel is
//! covered by exactly one valid block.

use indirect_core::math::versine_of_sum;
use rayon::prelude::*;
use rsm::PyramidLayout;

use super::blocks::Blocks;
use super::sources::sources_at;
use crate::{
    layout::{Block, Patch, state},
    levels::place,
    settings::Thresholds,
};

/// When a block needs subdivision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Subdivision {
    /// Where it holds a discontinuity.
    pub thresholds: Thresholds,
    /// See [`Params::margin`](crate::Params::margin).
    pub margin: f32,
    /// Second differences of the irradiance beyond which light bends too much across it, W/m²: [`Params::bend`](crate::Params::bend)
    /// times the reference irradiance.
    pub bend: f32,
}

/// Per node of the levels `1..=coarsest` (pixels need none), whether it needs subdivision.
#[must_use]
pub fn refine(
    blocks: &Blocks<'_>,
    layout: &PyramidLayout,
    coarsest: usize,
    subdivision: &Subdivision,
    sources: &[Patch],
) -> Vec<u32> {
    let Subdivision { thresholds: Thresholds { depth, versine }, margin, bend } = *subdivision;
    (pixels(layout)..node_count(layout, coarsest))
        .into_par_iter()
        .with_min_len(1024)
        .map(|i| {
            let (level, x, y) = place(layout, i);
            let l = layout.levels[level];
            let ring = blocks.level(l);
            let own = &ring[(i - l.offset) as usize];
            if own.pixels == 0 {
                return 0;
            }
            u32::from(
                has_discontinuity(own, depth, versine)
                    || rises_beside(own, ring, l.size, [x, y], versine, margin)
                    || light_bends(own, sources, bend),
            )
        })
        .collect()
}

/// Per node of the levels `0..=coarsest`, its [`state`].
#[must_use]
pub fn stencil(blocks: &Blocks<'_>, needs: &[u32], layout: &PyramidLayout, coarsest: usize) -> Vec<u32> {
    let first = pixels(layout);
    (0..node_count(layout, coarsest))
        .into_par_iter()
        .with_min_len(1024)
        .map(|i| {
            if blocks.is_empty(i as usize) {
                return state::EMPTY;
            }
            let (level, x, y) = place(layout, i);
            // From below: where a block is covered the next coarser one mostly says so.
            for above in level + 1..=coarsest {
                let l = layout.levels[above];
                let shift = above - level;
                if needs[(l.offset - first + (y >> shift) * l.size[0] + (x >> shift)) as usize] == 0 {
                    return state::COVERED;
                }
            }
            if level == 0 || needs[(i - first) as usize] == 0 { state::VALID } else { state::SPLIT }
        })
        .collect()
}

/// Number of nodes of the levels `0..=coarsest`.
fn node_count(layout: &PyramidLayout, coarsest: usize) -> u32 {
    let last = layout.levels[coarsest];
    last.offset + last.len() as u32
}

/// Number of nodes of level 0.
fn pixels(layout: &PyramidLayout) -> u32 {
    layout.levels[0].len() as u32
}

/// Whether depths or normals vary too much inside a block. Not `<`, so that a threshold of 0 finds it everywhere.
fn has_discontinuity(block: &Block, depth: f32, versine: f32) -> bool {
    let flat = block.depth_max - block.depth_min < depth * block.depth_max && block.versine < versine;
    block.mixed != 0 || !flat
}

/// Whether light bends too much across a block. Where there is no light, nothing bends.
fn light_bends(block: &Block, sources: &[Patch], most: f32) -> bool {
    sources_at(sources, block.position).1 * (block.radius * block.radius) > most
}

/// Whether another surface rises in front of a block's plane just beside it. `ring` are the blocks of its level.
fn rises_beside(
    own: &Block,
    ring: &[Block],
    size: [u32; 2],
    [x, y]: [u32; 2],
    versine: f32,
    margin: f32,
) -> bool {
    if margin == 0.0 {
        return false;
    }
    let near = margin * own.radius;
    for cy in y.saturating_sub(1)..(y + 2).min(size[1]) {
        for cx in x.saturating_sub(1)..(x + 2).min(size[0]) {
            let other = &ring[(cy * size[0] + cx) as usize];
            let offset = other.normal - own.normal;
            if versine_of_sum(0.5 * offset.dot(offset), other.versine) < versine || other.pixels == 0 {
                continue;
            }
            let v = other.position - own.position;
            if own.normal.dot(v) > 0.0 && v.dot(v) < near * near {
                return true;
            }
        }
    }
    false
}
