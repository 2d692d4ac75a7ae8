//! `traverse`: each tile of neighbouring receivers gathers its own cut through a tree of lights (Nichols, Shopf & Wyman 2009, §3.5.1).
//!
//! The traversal keeps no stack: from a branch it goes to [`Branch::child`] or to [`Branch::next`]. The receivers of a tile share the
//! cut that the nearest of them needs, which is at least as fine as each alone: so one traversal serves a whole block of the
//! gather's kernel. Neighbours must therefore lie near each other in the lists: along a Z curve, say.

use glam::Vec3;
use rayon::prelude::*;

use super::kernel::CHUNK;
use super::receivers::{Block, LANES, Lanes};
use super::simd;
use crate::{
    TILE,
    layout::{Branch, Vpl},
    selection::Form,
};

/// Tiles per parallel piece, which share a list of lights.
const PIECE: usize = 4;

/// Irradiance per receiver, W/m², and the number of lights in the cut of each tile.
///
/// `positions` and unit `normals` are as long as each other; what one has more is left out.
#[must_use]
pub fn traverse(tree: &[Branch], positions: &[Vec3], normals: &[Vec3], form: Form) -> (Vec<Vec3>, Vec<u32>) {
    let (kernel, area_scale) = (simd::kernel(), form.area_scale());
    tiles(positions, normals, |tile, block, _, lights| {
        cut(tree, tile, lights);
        let mut sum = [Lanes::default(); 3];
        for chunk in lights.chunks(CHUNK) {
            add(&mut sum, &kernel.gather_block(chunk, block, area_scale));
        }
        (sum, lights.len() as u32)
    })
}

/// [`traverse`] with a test of visibility: the light of a branch arrives at a receiver where `visible(representative, receiver)` says so.
///
/// The first argument is [`Branch::representative`]: of a [`LightTree`](super::LightTree) the index of a virtual point light, so that
/// one shadow test, against a map of that light or along a ray to it, stands for all lights beneath. The second is the receiver's
/// index. Asked for each light of a cut and each receiver that it would reach otherwise.
#[must_use]
pub fn traverse_visible(
    tree: &[Branch],
    positions: &[Vec3],
    normals: &[Vec3],
    form: Form,
    visible: impl Fn(u32, usize) -> bool + Sync,
) -> (Vec<Vec3>, Vec<u32>) {
    let (kernel, area_scale) = (simd::kernel(), form.area_scale());
    tiles(positions, normals, |tile, block, receivers, _| {
        let (mut sum, mut lights) = ([Lanes::default(); 3], 0);
        visit_cut(tree, tile, |branch| {
            let mut light = kernel.gather_block(&[branch.vpl()], block, area_scale);
            for (lane, receiver) in receivers.clone().enumerate() {
                let arrives = light[0][lane] + light[1][lane] + light[2][lane] > 0.0;
                if arrives && !visible(branch.representative, receiver) {
                    light.iter_mut().for_each(|channel| channel[lane] = 0.0);
                }
            }
            add(&mut sum, &light);
            lights += 1;
        });
        (sum, lights)
    })
}

fn add(sum: &mut [Lanes; 3], more: &[Lanes; 3]) {
    for (sum, more) in sum.iter_mut().zip(more) {
        for lane in 0..LANES {
            sum[lane] += more[lane];
        }
    }
}

/// What `of_tile` makes of each tile, its block for the kernel, the indices of its receivers and a list to work with.
fn tiles(
    positions: &[Vec3],
    normals: &[Vec3],
    of_tile: impl Fn(&Tile, &Block, core::ops::Range<usize>, &mut Vec<Vpl>) -> ([Lanes; 3], u32) + Sync,
) -> (Vec<Vec3>, Vec<u32>) {
    let n = positions.len().min(normals.len());
    let (mut irradiance, mut cuts) = (vec![Vec3::ZERO; n], vec![0; n.div_ceil(TILE)]);
    irradiance.par_chunks_mut(PIECE * TILE).zip(cuts.par_chunks_mut(PIECE)).enumerate().for_each_init(
        Vec::new,
        |lights, (piece, (irradiance, cuts))| {
            for (k, (out, cut)) in irradiance.chunks_mut(TILE).zip(cuts).enumerate() {
                let first = (piece * PIECE + k) * TILE;
                let receivers = first..first + out.len();
                let (positions, normals) = (&positions[receivers.clone()], &normals[receivers.clone()]);
                let mut block = Block::default();
                for (lane, (p, n)) in positions.iter().zip(normals).enumerate() {
                    for axis in 0..3 {
                        block.position[axis][lane] = p[axis];
                        block.normal[axis][lane] = n[axis];
                    }
                }
                let sum;
                (sum, *cut) = of_tile(&Tile::new(positions), &block, receivers, lights);
                for (lane, e) in out.iter_mut().enumerate() {
                    *e = Vec3::new(sum[0][lane], sum[1][lane], sum[2][lane]);
                }
            }
        },
    );
    (irradiance, cuts)
}

/// Positions of up to [`TILE`] receivers, the last one repeated where there are fewer.
#[derive(Debug, Clone, Copy)]
pub struct Tile([[f32; TILE]; 3]);

impl Tile {
    /// The tile of one to [`TILE`] points; of none, the origin.
    #[must_use]
    pub fn new(points: &[Vec3]) -> Self {
        let mut tile = Self([[0.0; TILE]; 3]);
        for lane in 0..TILE {
            if let Some(p) = points.get(lane.min(points.len().saturating_sub(1))) {
                for axis in 0..3 {
                    tile.0[axis][lane] = p[axis];
                }
            }
        }
        tile
    }

    /// Squared distance of the nearest receiver.
    #[inline]
    fn distance2(&self, p: Vec3) -> f32 {
        let mut d2 = [0.0; TILE];
        for (lane, d2) in d2.iter_mut().enumerate() {
            let vx = p.x - self.0[0][lane];
            let vy = p.y - self.0[1][lane];
            let vz = p.z - self.0[2][lane];
            *d2 = vx * vx + vy * vy + vz * vz;
        }
        let least = |a: f32, b: f32| if a < b { a } else { b };
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| least(d2[i], d2[i + 4]));
        least(least(a, b), least(c, d))
    }
}

/// The lights that the receivers of a tile need, in the order of the traversal.
pub fn cut(tree: &[Branch], tile: &Tile, lights: &mut Vec<Vpl>) {
    lights.clear();
    visit_cut(tree, tile, |branch| lights.push(branch.vpl()));
}

/// [`cut`], branch by branch: each with its light ([`Branch::vpl`]) and its [`Branch::representative`].
#[inline]
pub fn visit_cut(tree: &[Branch], tile: &Tile, mut visit: impl FnMut(&Branch)) {
    let mut i = 0;
    while let Some(branch) = tree.get(i) {
        if branch.reach > 0.0 && tile.distance2(branch.position) < branch.reach * branch.reach {
            i = branch.child as usize;
            continue;
        }
        if branch.weight() > 0.0 {
            visit(branch);
        }
        i = branch.next as usize;
    }
}
