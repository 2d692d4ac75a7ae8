//! The walk of one tile through a tree of lights: the inner loop of `traverse`.

use glam::Vec3;

use super::kernel::{CHUNK, gather_block};
use super::receivers::{Block, LANES, Lanes};
use crate::{
    TILE,
    layout::{Branch, Vpl},
};

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
    #[inline(always)]
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

/// The branches of the cut of a tile, in the order of the walk. Inlined into each instruction set's copy, see
/// `simd.rs`.
#[inline(always)]
pub(super) fn walk(tree: &[Branch], tile: &Tile, mut visit: impl FnMut(&Branch)) {
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

/// The irradiance of a tile, summed as `gather` does, and the number of lights in its cut.
#[inline(always)]
pub(super) fn gather_cut(
    tree: &[Branch],
    (tile, block): (&Tile, &Block),
    area_scale: f32,
    lights: &mut Vec<Vpl>,
) -> ([Lanes; 3], u32) {
    lights.clear();
    walk(tree, tile, |branch| lights.push(branch.vpl()));
    let mut sum = [Lanes::default(); 3];
    for chunk in lights.chunks(CHUNK) {
        add_lanes(&mut sum, &gather_block(chunk, block, area_scale));
    }
    (sum, lights.len() as u32)
}

/// Adds lane by lane.
#[inline(always)]
pub(super) fn add_lanes(sum: &mut [Lanes; 3], more: &[Lanes; 3]) {
    for (sum, more) in sum.iter_mut().zip(more) {
        for lane in 0..LANES {
            sum[lane] += more[lane];
        }
    }
}
