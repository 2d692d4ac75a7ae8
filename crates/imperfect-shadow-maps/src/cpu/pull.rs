//! `pull`: coarser levels of every map, from the texels that hold something (Ritschel et al. 2008, after Grossman & Dally 1998
//! and Marroquim, Kraus & Cavalcanti 2007).

use rayon::prelude::*;

use super::atlas::Atlas;

/// Depths that differ by less than this share at the finest level belong together; each coarser level doubles it. Ritschel et
/// al. 2008 take 5 % of the scene's extent; a share of the depth needs no scene.
pub(super) const CLOSE: f32 = 0.1;

/// Fills the coarser levels.
pub fn pull(atlas: &mut Atlas) {
    let ism = atlas.ism;
    if ism.levels == 0 {
        return;
    }
    atlas.par_maps().for_each(|(fine, coarse)| {
        let mut side = ism.tile as usize;
        let mut close = CLOSE;
        let (mut begin, mut end) = (0, 0);
        for level in 1..=ism.levels {
            let above = side / 2;
            let (done, rest) = coarse.split_at_mut(end);
            let below = if level == 1 { &*fine } else { &done[begin..] };
            for (i, texel) in rest[..above * above].iter_mut().enumerate() {
                let at = 2 * (i / above) * side + 2 * (i % above);
                *texel =
                    pull_texel([below[at], below[at + 1], below[at + side], below[at + side + 1]], close);
            }
            (begin, end) = (end, end + above * above);
            side = above;
            close *= 2.0;
        }
    });
}

/// The mean of those of four texels that are close to the second nearest, or to the only one: one alone in front of others is an
/// outlier.
#[inline]
fn pull_texel(u: [f32; 4], close: f32) -> f32 {
    let (a, b) = (u[0].max(u[1]), u[0].min(u[1]));
    let (c, d) = (u[2].max(u[3]), u[2].min(u[3]));
    let (first, second) = (a.max(c), a.min(c).max(b.max(d)));
    let nearest = if second > 0.0 { second } else { first };
    let (low, high) = (nearest / (1.0 + close), nearest * (1.0 + close));
    let (mut sum, mut count) = (0.0, 0.0);
    for u in u {
        if u > 0.0 && u >= low && u <= high {
            sum += u;
            count += 1.0;
        }
    }
    if count > 0.0 { sum / count } else { 0.0 }
}
