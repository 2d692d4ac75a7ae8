//! `push`: holes of every map filled from its coarser levels.

use rayon::prelude::*;

use super::atlas::Atlas;
use super::pull::CLOSE;
use crate::layout::EMPTY;

/// Bilinear weights of the four coarser texels around a texel, that which contains it first.
const WEIGHTS: [f32; 4] = [0.5625, 0.1875, 0.1875, 0.0625];

/// Fills holes, from the coarsest level down.
pub fn push(atlas: &mut Atlas) {
    let ism = atlas.ism;
    if ism.levels == 0 {
        return;
    }
    atlas.par_maps().for_each(|(fine, coarse)| {
        let mut begin = coarse.len();
        for level in (0..ism.levels).rev() {
            let side = (ism.tile >> level) as usize;
            let above_side = side / 2;
            begin -= above_side * above_side;
            let (done, rest) = coarse.split_at_mut(begin);
            let above = &rest[..above_side * above_side];
            let from = done.len().saturating_sub(side * side);
            let below = if level == 0 { &mut *fine } else { &mut done[from..] };
            let close = CLOSE * (1 << level) as f32;
            for (i, texel) in below.iter_mut().enumerate() {
                *texel = push_texel(*texel, above, above_side, [i % side, i / side], close);
            }
        }
    });
}

/// A texel that is empty takes the mean of those around it one level up; so does one that is farther than all four of them, by
/// more than what belongs together: on a plane, however slanted, no texel is.
#[inline]
fn push_texel(u: f32, above: &[f32], side: usize, [x, y]: [usize; 2], close: f32) -> f32 {
    let ([x0, x1], [y0, y1]) = (around(x, side), around(y, side));
    let c = [above[y0 * side + x0], above[y0 * side + x1], above[y1 * side + x0], above[y1 * side + x1]];
    let mut least = c[0];
    let (mut sum, mut weight) = (0.0, 0.0);
    for (c, w) in c.into_iter().zip(WEIGHTS) {
        least = if c < least { c } else { least };
        if c > 0.0 {
            sum += w * c;
            weight += w;
        }
    }
    // At the border of the map nothing surrounds a texel.
    let inside = x1 != x0 && y1 != y0;
    let hole = u == EMPTY || (inside && u * (1.0 + close) < least);
    if hole && weight > 0.0 { sum / weight } else { u }
}

/// The coarser texel that contains a texel, and the next one on the texel's side of its middle; at the border the same again.
#[inline]
fn around(i: usize, side: usize) -> [usize; 2] {
    let own = i / 2;
    [own, if i.is_multiple_of(2) { own.saturating_sub(1) } else { (own + 1).min(side - 1) }]
}
