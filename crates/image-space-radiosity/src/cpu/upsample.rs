//! `upsample`: irradiance at every pixel from irradiance at fragments of all sizes (§3.2, figure 2 e, f).
//!
//! `pull` fills blocks that were subdivided with the mean of their children, `push` fills blocks inside a fragment from the
//! level above: the bilinear weights 9, 3, 3, 1 of the four nearest blocks, each times how well its plane agrees. Level by
//! level this is a smooth spline that never crosses an edge.

use glam::Vec3;
use rayon::prelude::*;
use rsm::PyramidLayout;

use super::compact::Fragments;
use super::refine::node_count;
use crate::layout::{Block, state};

/// The irradiance of all nodes of the levels `0..=coarsest`, W/m²: pulled, then pushed. The nodes of level 0 are the pixels.
#[must_use]
pub fn upsample(
    blocks: &[Block],
    states: &[u32],
    fragments: &Fragments,
    gathered: &[Vec3],
    layout: &PyramidLayout,
    coarsest: usize,
) -> Vec<Vec3> {
    let mut irradiance = pull(blocks, states, fragments, gathered, layout, coarsest);
    push(blocks, states, layout, coarsest, &mut irradiance);
    irradiance
}

/// Irradiance of valid and of subdivided blocks, from fine to coarse; 0 for covered and empty ones.
#[must_use]
pub fn pull(
    blocks: &[Block],
    states: &[u32],
    fragments: &Fragments,
    gathered: &[Vec3],
    layout: &PyramidLayout,
    coarsest: usize,
) -> Vec<Vec3> {
    let mut irradiance: Vec<Vec3> = Vec::with_capacity(node_count(layout, coarsest) as usize);
    for level in 0..=coarsest {
        let l = layout.levels[level];
        let done = &irradiance;
        let values: Vec<Vec3> = (0..l.len() as u32)
            .into_par_iter()
            .with_min_len(1024)
            .map(|i| {
                let node = (l.offset + i) as usize;
                match states[node] {
                    state::VALID => gathered[fragments.slots[node] as usize],
                    state::SPLIT => {
                        let fine = layout.levels[level - 1];
                        mean(done, blocks, fine.offset, fine.size, [i % l.size[0], i / l.size[0]])
                    }
                    _ => Vec3::ZERO,
                }
            })
            .collect();
        irradiance.extend(values);
    }
    irradiance
}

/// Mean of the children's irradiance, weighted by their surface pixels.
fn mean(irradiance: &[Vec3], blocks: &[Block], offset: u32, size: [u32; 2], [x, y]: [u32; 2]) -> Vec3 {
    let mut sum = Vec3::ZERO;
    let mut pixels = 0;
    for cy in 2 * y..(2 * y + 2).min(size[1]) {
        for cx in 2 * x..(2 * x + 2).min(size[0]) {
            let child = (offset + cy * size[0] + cx) as usize;
            sum += irradiance[child] * blocks[child].pixels as f32;
            pixels += blocks[child].pixels;
        }
    }
    // A subdivided block has surface pixels.
    sum * (1.0 / pixels as f32)
}

/// Irradiance of covered blocks, from coarse to fine.
pub fn push(
    blocks: &[Block],
    states: &[u32],
    layout: &PyramidLayout,
    coarsest: usize,
    irradiance: &mut [Vec3],
) {
    for level in (0..coarsest).rev() {
        let (fine, coarse) = (layout.levels[level], layout.levels[level + 1]);
        let (below, above) = irradiance.split_at_mut(coarse.offset as usize);
        let own = &mut below[fine.offset as usize..];
        own.par_iter_mut().with_min_len(1024).enumerate().for_each(|(i, e)| {
            let node = fine.offset as usize + i;
            if states[node] == state::COVERED {
                let i = i as u32;
                let place = [i % fine.size[0], i / fine.size[0]];
                *e = interpolate(&blocks[node], place, blocks, states, above, coarse.offset, coarse.size);
            }
        });
    }
}

/// The value at a block from the four nearest of the next coarser level, its parent first.
fn interpolate(
    block: &Block,
    [x, y]: [u32; 2],
    blocks: &[Block],
    states: &[u32],
    above: &[Vec3],
    offset: u32,
    size: [u32; 2],
) -> Vec3 {
    let [px, py] = [x / 2, y / 2];
    // The neighbour on the side on which the block lies in its parent; u32::MAX and the size are outside.
    let qx = if x % 2 == 0 { px.wrapping_sub(1) } else { px + 1 };
    let qy = if y % 2 == 0 { py.wrapping_sub(1) } else { py + 1 };
    let parent = py * size[0] + px;
    // The parent is one surface, and the block lies on it: it counts in full.
    let mut sum = above[parent as usize] * 9.0;
    let mut weights = 9.0;
    for (nx, ny, weight) in [(qx, py, 3.0), (px, qy, 3.0), (qx, qy, 1.0)] {
        if nx < size[0] && ny < size[1] {
            let i = ny * size[0] + nx;
            let node = (offset + i) as usize;
            if states[node] != state::EMPTY {
                let w = weight * agreement(block, &blocks[node]);
                sum += above[i as usize] * w;
                weights += w;
            }
        }
    }
    sum * (1.0 / weights)
}

/// How far two blocks are one smooth surface, `[0, 1]`: their normals agree and each lies in the other's plane.
fn agreement(a: &Block, b: &Block) -> f32 {
    let v = b.position - a.position;
    let d2 = v.dot(v);
    let (ha, hb) = (a.normal.dot(v), b.normal.dot(v));
    // Squared sine of the elevation above the two planes; 0 for coincident points.
    let elevation = (ha * ha).max(hb * hb) / d2.max(1e-37);
    let normals = a.normal.dot(b.normal).max(0.0) * (1.0 - b.versine).max(0.0);
    let n2 = normals * normals;
    n2 * n2 * (1.0 - 4.0 * elevation).max(0.0)
}
