//! `near`: stratified samples of the lit surface close to a hint.
//!
//! Of a surface half a cell away, a hint's list holds a sample or two, if any, and each is bright: most of the noise of the
//! field comes from there. So each hint is projected into each map. Where the surface found there is near, a window of
//! texels around the projection is stratified by the nodes of the map's pyramid: of each node one texel is drawn in
//! proportion to its flux and stands for the whole node: `side²` fine nodes in the middle and nodes twice as wide around
//! them. Samples of the list that fall into the window are left out. The expected sum of both is that over all texels.

use glam::Vec2;
use indirect_core::{Projection, View, math::luminance};
use indirect_sampling::{
    rng::hash_combine,
    sobol,
    warp::{Empty, Warp, level_size, top_level},
};
use rayon::prelude::*;
use rsm::{Level, Map, Rsm};

use super::sample::sample_of_texel;
use crate::{
    layout::{Near, Sample, Window},
    setup::Draw,
    volume::Lattice,
};

/// Farthest surface that is near, in diagonals of a cell. This and the next chosen by measurement on the Cornell box.
pub(crate) const REACH: f32 = 1.0;
/// Least edge of the fine half of a window, in diagonals of a cell; nodes are powers of two, so it is up to twice that.
pub(crate) const SPAN: f32 = 0.7;
/// Offset of a window's middle within a node, so that in symmetric scenes rounding does not decide which node it is.
pub(crate) const OFF_CENTRE: f32 = 0.38;

/// The windows of all hints and the samples in them; nothing for other samplings than
/// [`Sampling::Nearby`](crate::Sampling::Nearby).
#[must_use]
pub fn near(rsm: &Rsm, lattice: &Lattice, draw: &Draw) -> Near {
    let (side, count, seed) = (draw.side(), draw.near() as usize, draw.seed);
    if count == 0 {
        return Near::default();
    }
    let hints = lattice.hints() as usize;
    let mut windows = vec![Window::default(); hints];
    let mut samples = vec![Sample::default(); hints * count];
    samples.par_chunks_exact_mut(count).zip(&mut windows).enumerate().for_each(
        |(hint, (samples, window))| {
            for map in 0..rsm.maps.len() {
                near_in_map(rsm, map, lattice, hint as u32, (side, seed), window, samples);
            }
        },
    );
    Near { resolution: rsm.resolution, windows, samples }
}

/// Gives the hint a window in this map, if more light comes from there than from the window that it has.
fn near_in_map(
    rsm: &Rsm,
    map: usize,
    lattice: &Lattice,
    hint: u32,
    (side, seed): (u32, u32),
    window: &mut Window,
    samples: &mut [Sample],
) {
    let Map { view, surface, pyramid, .. } = &rsm.maps[map];
    let (position, diagonal) = (lattice.position(hint), lattice.place(hint).0.cell.length());
    let n = rsm.resolution;
    let Some(plane) = view.image_point(position) else { return };
    // The projection of a hint outside of the light's view is clamped to the border of the map.
    let at = (plane * n as f32).clamp(Vec2::ZERO, Vec2::splat(n as f32 - 0.5));
    let texel = (at.y as u32 * n + at.x as u32) as usize;
    let v = position - surface.position[texel];
    let d2 = v.dot(v);
    // Where the map sees nothing the normal is 0.
    let near = d2 < (REACH * diagonal) * (REACH * diagonal) && surface.normal[texel].dot(v) > 0.0;
    if !near {
        return;
    }
    // The finest nodes of which `side` are as wide as the window has to be.
    let wanted = SPAN * diagonal / (side as f32 * texel_edge(view, surface.depth[texel], n));
    let mut fine = 0;
    while fine < top_level([n, n]) && ((1_u32 << fine) as f32) < wanted {
        fine += 1;
    }
    let coarse = (fine + 1).min(top_level([n, n]));
    // The first of `count` nodes around the projection.
    let begin = |x: f32, level: u32, count: u32| {
        (x / (1_u32 << level) as f32 - 0.5 * count as f32 + OFF_CENTRE).max(0.0) as u32
    };
    let width = level_size([n, n], coarse)[0];
    let outer = [at.x, at.y].map(|x| begin(x, coarse, side).min(width - side.min(width)));
    let end = outer.map(|x| (x + side).min(width));
    let node = |level: u32, x: u32, y: u32| {
        let Level { offset, size } = pyramid.layout.levels[level as usize];
        &pyramid.nodes[(offset + y * size[0] + x) as usize]
    };
    let mut flux = 0.0;
    for y in outer[1]..end[1] {
        for x in outer[0]..end[0] {
            flux += luminance(node(coarse, x, y).reflected);
        }
    }
    let score = flux / d2.max(0.25 * diagonal * diagonal);
    let better = score > window.score;
    if !better {
        return;
    }
    let texels = |x: u32| (x << coarse).min(n);
    *window = Window { first: outer.map(texels), end: end.map(texels), map: map as u32, score, ..*window };

    let Ok(warp) = Warp::new([n, n], |i| luminance(pyramid.nodes[i].reflected), Empty::Error) else { return };
    let scramble = hash_combine(seed, hint);
    samples.fill(Sample::default());
    let mut k = 0;
    let mut draw = |level: u32, x: u32, y: u32| {
        if luminance(node(level, x, y).reflected) > 0.0
            && let Some(drawn) = warp.sample_within(level, [x, y], sobol::sample_2d(k, scramble))
        {
            let texel = drawn.texel[1] * n + drawn.texel[0];
            samples[k as usize] = sample_of_texel(rsm, map, texel, 1.0 / drawn.pdf);
        }
        k += 1;
    };
    // Where there is no coarser level, the window is the map.
    let half = if coarse > fine { side / 2 } else { 0 };
    let inner = [0, 1].map(|i| begin(at[i], coarse, half).clamp(outer[i], outer[i] + side - half));
    for y in outer[1]..end[1] {
        for x in outer[0]..end[0] {
            if x < inner[0] || x >= inner[0] + half || y < inner[1] || y >= inner[1] + half {
                draw(coarse, x, y);
            }
        }
    }
    let [width, _] = level_size([n, n], fine);
    for y in 2 * inner[1]..(2 * (inner[1] + half)).min(width) {
        for x in 2 * inner[0]..(2 * (inner[0] + half)).min(width) {
            draw(fine, x, y);
        }
    }
}

/// Edge of a texel at a depth, metres.
fn texel_edge(view: &View, depth: f32, resolution: u32) -> f32 {
    let half = match view.projection {
        Projection::Perspective { tan_half } => tan_half.max_element() * depth,
        Projection::Orthographic { half_size } => half_size.max_element(),
    };
    2.0 * half / resolution as f32
}
