//! `stops`: the quantised hit distance along each direction of later bounces, from the maps' depth.
//!
//! Later bounces follow directions to the border of the box ([`Transport::Directions`](crate::Transport::Directions)); with
//! [`Visibility::RsmDepth`](crate::Visibility::RsmDepth) they end where they cross a surface that a light sees, by the test
//! that the samples of the first bounce undergo. Eight bits per hint and direction, four to a word: the hit distance as a
//! share of the distance to the border, in 255ths, or 255 without a hit. The directions are the same for all bounces, so
//! that this is done once a frame.

use glam::Vec3;
use rayon::prelude::*;
use rsm::Rsm;

use super::{
    depths::{Depths, crossing},
    directions::{Directions, OPEN, half_cell},
};
use crate::{settings::words_of_stops, volume::Lattice};

/// The words of all hints.
#[must_use]
pub fn stops(rsm: &Rsm, lattice: &Lattice, directions: &Directions) -> Vec<u32> {
    let maps = Depths::of_maps(rsm);
    let per_hint = words_of_stops(directions.count);
    (0..lattice.hints() * per_hint)
        .into_par_iter()
        .map(|i| {
            let (hint, begin) = (i / per_hint, i % per_hint * 4);
            let position = lattice.position(hint);
            let mut word = 0;
            for j in begin..(begin + 4).min(directions.count) {
                let w = directions.direction(j);
                let (farthest, _) = directions.border(lattice, hint, position, w);
                let reach = farthest - half_cell(lattice.room(hint), w);
                word |= stop(&maps, position, w, farthest, reach) << (8 * (j - begin));
            }
            word
        })
        .collect()
}

/// The nearest hit along a direction, over all maps, quantised; `farthest` is the distance to the border. Hits beyond
/// `reach`, half a cell before the border, are ignored: the walls mostly lie at the border, and rounding must not decide
/// whether they are hit.
fn stop(maps: &[Depths<'_>], position: Vec3, w: Vec3, farthest: f32, reach: f32) -> u32 {
    let mut nearest = OPEN;
    for map in maps {
        if let Some(t) = crossing(map, position, position + w * farthest, 0)
            && t * farthest < reach
        {
            nearest = nearest.min((t * OPEN as f32) as u32);
        }
    }
    nearest
}
