//! `upsample`: irradiance at every pixel from irradiance at fragments of all sizes (§3.2, figure 2 e, f).
//!
//! `pull` fills blocks that were subdivided with the mean of their children, `push` fills blocks inside a fragment from the
//! level above: the bilinear weights 9, 3, 3, 1 of the four nearest blocks, each times how well its plane agrees. Level by
//! level this is a smooth spline that never crosses an edge.

use glam::Vec3;
use rayon::prelude::*;
use rsm::PyramidLayout;

use super::blocks::Blocks;
use crate::{
    layout::{Block, state},
    output::{Fragments, Irradiance},
};

/// Irradiance of the nodes of the levels `0..=coarsest`: that of valid and of subdivided blocks, from fine to coarse; 0 for
/// covered and empty ones.
#[must_use]
pub fn pull(
    blocks: &Blocks<'_>,
    states: &[u32],
    fragments: &Fragments,
    gathered: &[Vec3],
    layout: &PyramidLayout,
    coarsest: usize,
) -> Irradiance {
    let mut irradiance = Irradiance::default();
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
        if level == 0 {
            irradiance.pixels = values;
        } else {
            irradiance.coarse.extend(values);
        }
    }
    irradiance
}

/// Mean of the children's irradiance, weighted by their surface pixels.
fn mean(irradiance: &Irradiance, blocks: &Blocks<'_>, offset: u32, size: [u32; 2], [x, y]: [u32; 2]) -> Vec3 {
    let mut sum = Vec3::ZERO;
    let mut pixels = 0;
    for cy in 2 * y..(2 * y + 2).min(size[1]) {
        for cx in 2 * x..(2 * x + 2).min(size[0]) {
            let child = (offset + cy * size[0] + cx) as usize;
            let seen = blocks.at(child).pixels;
            sum += irradiance.at(child) * seen as f32;
            pixels += seen;
        }
    }
    // A subdivided block has surface pixels.
    sum * (1.0 / pixels as f32)
}

/// Irradiance of covered blocks, from coarse to fine.
pub fn push(
    blocks: &Blocks<'_>,
    states: &[u32],
    layout: &PyramidLayout,
    coarsest: usize,
    irradiance: &mut Irradiance,
) {
    let first = irradiance.pixels.len();
    for level in (0..coarsest).rev() {
        let (fine, coarse) = (layout.levels[level], layout.levels[level + 1]);
        let (stored, above) = irradiance.coarse.split_at_mut(coarse.offset as usize - first);
        let below =
            if level == 0 { &mut irradiance.pixels[..] } else { &mut stored[fine.offset as usize - first..] };
        let states = &states[coarse.offset as usize..];
        let parents = Parents { blocks: blocks.level(coarse), states, above, size: coarse.size };
        let width = fine.size[0];
        // Two rows of children for each row of parents.
        let rows = below.par_chunks_mut(2 * width as usize);
        rows.zip(0..coarse.size[1]).for_each(|(children, y)| {
            for x in 0..coarse.size[0] {
                if let Some(values) = parents.children([x, y]) {
                    for ((dx, dy), value) in [(0, 0), (1, 0), (0, 1), (1, 1)].into_iter().zip(values) {
                        let i = (dy * width + 2 * x + dx) as usize;
                        if 2 * x + dx < width && i < children.len() {
                            children[i] = value;
                        }
                    }
                }
            }
        });
    }
}

/// A level that is spread to the next finer one.
struct Parents<'a> {
    blocks: &'a [Block],
    states: &'a [u32],
    above: &'a [Vec3],
    size: [u32; 2],
}

impl Parents<'_> {
    /// The values at the four children of a block that lies in a fragment: each from the four nearest blocks, its parent first.
    fn children(&self, [x, y]: [u32; 2]) -> Option<[Vec3; 4]> {
        let own = (y * self.size[0] + x) as usize;
        if !matches!(self.states[own], state::VALID | state::COVERED) {
            return None;
        }
        // Below 0 wraps, and is outside as the size is.
        let (left, right, up, down) = (x.wrapping_sub(1), x + 1, y.wrapping_sub(1), y + 1);
        let at = |nx, ny| self.neighbour(own, nx, ny);
        let (l, r, u, d) = (at(left, y), at(right, y), at(x, up), at(x, down));
        let (lu, ru, ld, rd) = (at(left, up), at(right, up), at(left, down), at(right, down));
        let e = self.above[own];
        Some([mix(e, l, u, lu), mix(e, r, u, ru), mix(e, l, d, ld), mix(e, r, d, rd)])
    }

    /// The value at a neighbour and how far it counts; 0 outside the image and where nothing is seen.
    fn neighbour(&self, own: usize, x: u32, y: u32) -> (Vec3, f32) {
        if x >= self.size[0] || y >= self.size[1] {
            return (Vec3::ZERO, 0.0);
        }
        let i = (y * self.size[0] + x) as usize;
        if self.states[i] == state::EMPTY {
            return (Vec3::ZERO, 0.0);
        }
        (self.above[i], agreement(&self.blocks[own], &self.blocks[i]))
    }
}

/// The bilinear weights of a child: 9 for its parent, 3 for the two beside it, 1 for the one across.
fn mix(e: Vec3, a: (Vec3, f32), b: (Vec3, f32), c: (Vec3, f32)) -> Vec3 {
    let sum = e * 9.0 + a.0 * (3.0 * a.1) + b.0 * (3.0 * b.1) + c.0 * c.1;
    sum * (1.0 / (9.0 + 3.0 * a.1 + 3.0 * b.1 + c.1))
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
