//! `traverse`: each tile of neighbouring fragments gathers its own cut through the tree of lights (§3.5.1).
//!
//! The walk keeps no stack: from a branch it goes to [`Branch::child`] or to [`Branch::next`]. The fragments of a tile share the
//! cut that the nearest of them needs, which is at least as fine as each alone: so one walk serves a whole block of the
//! gather's kernel.

use glam::Vec3;
use rayon::prelude::*;
use rsm::{Form, Vpl, cpu::Receivers};

use crate::{layout::Branch, levels::TILE};

/// Irradiance per fragment, W/m², and the number of lights in the cut of each tile.
#[must_use]
pub fn traverse(tree: &[Branch], positions: &[Vec3], normals: &[Vec3], form: Form) -> (Vec<Vec3>, Vec<u32>) {
    let tiles: Vec<(Vec<Vec3>, u32)> = positions
        .par_chunks(TILE)
        .zip(normals.par_chunks(TILE))
        .map_init(Vec::new, |lights, (positions, normals)| {
            cut(tree, &Tile::new(positions), lights);
            let receivers: Receivers = positions.iter().copied().zip(normals.iter().copied()).collect();
            (rsm::cpu::gather(lights, &receivers, form), lights.len() as u32)
        })
        .collect();
    let cuts = tiles.iter().map(|(_, cut)| *cut).collect();
    (tiles.into_iter().flat_map(|(e, _)| e).collect(), cuts)
}

/// Positions of up to [`TILE`] fragments, the last one repeated where there are fewer.
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

    /// Squared distance of the nearest fragment.
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

/// The lights that the fragments of a tile need, in the order of the walk.
pub fn cut(tree: &[Branch], tile: &Tile, lights: &mut Vec<Vpl>) {
    lights.clear();
    let mut i = 0;
    while let Some(branch) = tree.get(i) {
        if branch.reach > 0.0 && tile.distance2(branch.position) < branch.reach * branch.reach {
            i = branch.child as usize;
            continue;
        }
        if branch.flux.x + branch.flux.y + branch.flux.z > 0.0 {
            lights.push(branch.vpl());
        }
        i = branch.next as usize;
    }
}
