//! `refine`: where light is gathered, in one pass over all levels (§3.2.1).
//!
//! A block is *valid* where it needs no subdivision and every block above it does. Each node decides that alone: it walks down
//! from the coarsest block that contains it and stops at the first that needs no subdivision. So every surface pixel is
//! covered by exactly one valid block.

use indirect_core::math::versine_of_sum;
use rayon::prelude::*;
use rsm::PyramidLayout;

use crate::{
    layout::{Block, state},
    levels::place,
    params::Params,
};

/// Per node of the levels `0..=coarsest`, whether it needs subdivision.
#[must_use]
pub fn refine(blocks: &[Block], layout: &PyramidLayout, coarsest: usize, params: &Params) -> Vec<u32> {
    let depth = params.blocks.depth;
    let versine = params.blocks.versine();
    nodes(layout, coarsest)
        .map(|i| {
            let (level, x, y) = place(layout, i);
            let level_nodes = &blocks[layout.levels[level].offset as usize..];
            let size = layout.levels[level].size;
            u32::from(level > 0 && needs_subdivision(level_nodes, size, [x, y], depth, versine, params.margin))
        })
        .collect()
}

/// Per node of the levels `0..=coarsest`, its [`state`].
#[must_use]
pub fn stencil(blocks: &[Block], needs: &[u32], layout: &PyramidLayout, coarsest: usize) -> Vec<u32> {
    nodes(layout, coarsest)
        .map(|i| {
            if blocks[i as usize].pixels == 0 {
                return state::EMPTY;
            }
            let (level, x, y) = place(layout, i);
            let mut above = coarsest;
            while above > level {
                let l = layout.levels[above];
                let shift = above - level;
                if needs[(l.offset + (y >> shift) * l.size[0] + (x >> shift)) as usize] == 0 {
                    return state::COVERED;
                }
                above -= 1;
            }
            if needs[i as usize] == 0 { state::VALID } else { state::SPLIT }
        })
        .collect()
}

/// Number of nodes of the levels `0..=coarsest`.
pub(crate) fn node_count(layout: &PyramidLayout, coarsest: usize) -> u32 {
    let last = layout.levels[coarsest];
    last.offset + last.len() as u32
}

fn nodes(layout: &PyramidLayout, coarsest: usize) -> impl IndexedParallelIterator<Item = u32> {
    (0..node_count(layout, coarsest)).into_par_iter().with_min_len(1024)
}

/// Whether a block, or with `margin` it and its eight neighbours together, hold a discontinuity.
fn needs_subdivision(
    blocks: &[Block],
    size: [u32; 2],
    [x, y]: [u32; 2],
    depth: f32,
    versine: f32,
    margin: bool,
) -> bool {
    let own = &blocks[(y * size[0] + x) as usize];
    if own.pixels == 0 {
        return false;
    }
    let reach = u32::from(margin);
    let (mut depth_min, mut depth_max) = (own.depth_min, own.depth_max);
    let mut widest = own.versine;
    for ny in y.saturating_sub(reach)..(y + reach + 1).min(size[1]) {
        for nx in x.saturating_sub(reach)..(x + reach + 1).min(size[0]) {
            let other = &blocks[(ny * size[0] + nx) as usize];
            if other.pixels > 0 {
                depth_min = depth_min.min(other.depth_min);
                depth_max = depth_max.max(other.depth_max);
                let offset = other.normal - own.normal;
                widest = widest.max(versine_of_sum(0.5 * offset.dot(offset), other.versine));
            }
        }
    }
    // Not `<`, so that a threshold of 0 subdivides everything.
    let flat = depth_max - depth_min < depth * depth_max && widest < versine;
    own.mixed != 0 || !flat
}
