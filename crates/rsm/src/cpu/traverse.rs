//! `traverse`: each tile of neighbouring receivers gathers its own cut through a tree of lights (Nichols, Shopf &
//! Wyman 2009, §3.5.1).
//!
//! The traversal keeps no stack: from a branch it goes to [`Branch::child`] or to [`Branch::next`]. The receivers of
//! a tile share the cut that the nearest of them needs, which is at least as fine as each alone: so one traversal
//! serves a whole block of the gather's kernel. Neighbours must therefore lie near each other in the lists: along a Z
//! curve, say.

use core::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::receivers::{Block, Lanes};
use super::simd;
use super::walk::{Tile, add_lanes, walk};
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
    tiles(positions, normals, Vec::new, |lights, tile, block, _| {
        kernel.gather_cut(tree, (tile, block), area_scale, lights)
    })
}

/// [`traverse`] with a test of visibility: the light of a branch arrives at a receiver where `visible(representative,
/// receiver)` says so.
///
/// The first argument is [`Branch::representative`]: of a [`LightTree`](super::LightTree) the index of a virtual
/// point light, so that one shadow test, against a map of that light or along a ray to it, stands for all lights
/// beneath. The second is the receiver's index. Asked for each light of a cut and each receiver that it would reach
/// otherwise.
#[must_use]
pub fn traverse_visible(
    tree: &[Branch],
    positions: &[Vec3],
    normals: &[Vec3],
    form: Form,
    visible: impl Fn(u32, usize) -> bool + Sync,
) -> (Vec<Vec3>, Vec<u32>) {
    let (kernel, area_scale) = (simd::kernel(), form.area_scale());
    tiles(
        positions,
        normals,
        || (),
        |(), tile, block, receivers| {
            let (mut sum, mut lights) = ([Lanes::default(); 3], 0);
            visit_cut(tree, tile, |branch| {
                let mut light = kernel.gather_block(&[branch.vpl()], block, area_scale);
                for (lane, receiver) in receivers.clone().enumerate() {
                    let arrives = light[0][lane] + light[1][lane] + light[2][lane] > 0.0;
                    if arrives && !visible(branch.representative, receiver) {
                        light.iter_mut().for_each(|channel| channel[lane] = 0.0);
                    }
                }
                add_lanes(&mut sum, &light);
                lights += 1;
            });
            (sum, lights)
        },
    )
}

/// What `of_tile` makes of each tile, its block for the kernel and the indices of its receivers; with something to
/// work with that `start` has made.
fn tiles<S>(
    positions: &[Vec3],
    normals: &[Vec3],
    start: impl Fn() -> S + Sync + Send,
    of_tile: impl Fn(&mut S, &Tile, &Block, Range<usize>) -> ([Lanes; 3], u32) + Sync,
) -> (Vec<Vec3>, Vec<u32>) {
    let n = positions.len().min(normals.len());
    let (mut irradiance, mut cuts) = (vec![Vec3::ZERO; n], vec![0; n.div_ceil(TILE)]);
    let pieces = irradiance.par_chunks_mut(PIECE * TILE).zip(cuts.par_chunks_mut(PIECE)).enumerate();
    pieces.for_each_init(start, |state, (piece, (irradiance, cuts))| {
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
            (sum, *cut) = of_tile(state, &Tile::new(positions), &block, receivers);
            for (lane, e) in out.iter_mut().enumerate() {
                *e = Vec3::new(sum[0][lane], sum[1][lane], sum[2][lane]);
            }
        }
    });
    (irradiance, cuts)
}

/// The lights that the receivers of a tile need, in the order of the traversal.
pub fn cut(tree: &[Branch], tile: &Tile, lights: &mut Vec<Vpl>) {
    lights.clear();
    visit_cut(tree, tile, |branch| lights.push(branch.vpl()));
}

/// [`cut`], branch by branch: each with its light ([`Branch::vpl`]) and its [`Branch::representative`].
pub fn visit_cut(tree: &[Branch], tile: &Tile, visit: impl FnMut(&Branch)) {
    walk(tree, tile, visit);
}
