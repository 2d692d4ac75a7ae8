//! `shadows`: which point a shadow map stands for a patch at, which map a light asks, and the question.
//!
//! Maps of all patches would be too many. Those of one coarse level of each reflective shadow map have one, made at one of their
//! texels that is drawn in proportion to flux: in the mean over the draws, what it sees is what the patch's light sees. A light
//! asks the map of the patch above it; one that is coarser asks that of a patch beneath it, drawn likewise.

use glam::Vec3;
use imperfect_shadow_maps::cpu::Atlas;
use indirect_sampling::rng::{hash_combine, unit_f32};
use rayon::prelude::*;
use rsm::{PyramidLayout, Vpl};

use super::patches::Patches;
use crate::levels::place;

/// Least cosine, on both sides, of what a map is asked for: beyond the horizon of its point it knows nothing. A patch that
/// lies around an edge has light there from its other side, which then arrives.
pub const HORIZON: f32 = 1.0 / 64.0;

/// The patches that have a shadow map: those of one level, map after map.
#[derive(Debug, Clone, Copy)]
pub struct Tiles<'a> {
    /// The pyramid over a map's texels.
    pub layout: &'a PyramidLayout,
    /// The level.
    pub level: usize,
    /// Draws the texels and patches.
    pub seed: u32,
}

impl Tiles<'_> {
    /// The shadow map that the light of a node of a map asks; meaningless where it has no flux.
    #[must_use]
    pub fn of(&self, maps: &[Patches<'_>], map: usize, node: u32) -> u32 {
        let (level, x, y) = place(self.layout, node);
        let [x, y] = match self.level.checked_sub(level) {
            Some(up) => [x >> up, y >> up],
            None => self.descend(maps, map, node, self.level),
        };
        let l = self.layout.levels[self.level];
        map as u32 * l.len() as u32 + y * l.size[0] + x
    }

    /// Column and row of a node of level `to` beneath another one, drawn in proportion to flux.
    fn descend(&self, maps: &[Patches<'_>], map: usize, node: u32, to: usize) -> [u32; 2] {
        let number = hash_combine(hash_combine(self.seed, map as u32), node);
        let (from, mut x, mut y) = place(self.layout, node);
        for level in (to..from).rev() {
            let l = self.layout.levels[level];
            let child = |c: u32| {
                let (cx, cy) = (2 * x + c % 2, 2 * y + c / 2);
                let inside = cx < l.size[0] && cy < l.size[1];
                if inside { maps[map].weight((l.offset + cy * l.size[0] + cx) as usize) } else { 0.0 }
            };
            let w = [child(0), child(1), child(2), child(3)];
            let upto = [w[0], w[0] + w[1], w[0] + w[1] + w[2], w[0] + w[1] + w[2] + w[3]];
            let t = unit_f32(hash_combine(number, level as u32)) * upto[3];
            // Less than the sum, unless all are 0.
            let c = upto.iter().position(|u| t < *u).unwrap_or(0) as u32;
            (x, y) = (2 * x + c % 2, 2 * y + c / 2);
        }
        [x, y]
    }
}

/// The virtual point lights from which the maps look: of each patch a texel, with the flux and the area of the patch;
/// [`Vpl::default`] where it has none.
#[must_use]
pub fn shadow_lights(maps: &[Patches<'_>], tiles: &Tiles<'_>) -> Vec<Vpl> {
    let l = tiles.layout.levels[tiles.level];
    let lights = (0..maps.len() * l.len()).into_par_iter().map(|i| {
        let (map, node) = (i / l.len(), l.offset + (i % l.len()) as u32);
        let patch = maps[map].at(node as usize);
        if patch.weight() <= 0.0 {
            return Vpl::default();
        }
        let [x, y] = tiles.descend(maps, map, node, 0);
        let texel = maps[map].at((y * tiles.layout.levels[0].size[0] + x) as usize);
        Vpl::new(texel.position, texel.normal, patch.flux, patch.area)
    });
    lights.collect()
}

/// Whether light that belongs to map `tile` of `shadows` reaches a receiver with this position, metres, and unit normal. Where
/// one of the two lies beyond the other's [`HORIZON`] there is no answer, and it does.
#[must_use]
#[inline]
pub fn light_visible(shadows: &Atlas, tile: u32, receiver: Vec3, normal: Vec3) -> bool {
    let Some(frame) = shadows.frames.get(tile as usize) else { return true };
    let v = receiver - frame.position;
    let least = HORIZON * v.dot(v).sqrt();
    let asks = frame.normal.dot(v) > least && -normal.dot(v) > least;
    !asks || shadows.visible_surface(tile as usize, receiver, normal)
}
