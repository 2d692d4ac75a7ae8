//! `vpls`: virtual point lights (VPLs) from the texels of the maps, and `compact`, which drops those without flux.
//!
//! Every selection keeps the energy: `Σ Φ_VPL` is the reflected flux of the maps, per channel for [`Selection::All`] and
//! [`Selection::Grid`]; in luminance, and per channel in expectation, for [`Selection::Importance`].

use glam::{Vec2, Vec3};
use indirect_core::math::luminance;
use indirect_sampling::warp::{Empty, Warp};
use rayon::prelude::*;

use crate::{
    layout::{Node, Vpl},
    rsm::{Map, Rsm},
    selection::Selection,
};

/// One VPL per slot; a slot that found no reflecting texel holds [`Vpl::default`], whose flux is 0.
///
/// `points` are those of [`Selection::points`]; only [`Selection::Importance`] has any.
#[must_use]
pub fn vpls(rsm: &Rsm, selection: Selection, points: &[Vec2]) -> Vec<Vpl> {
    let n = rsm.resolution;
    match selection {
        Selection::All => {
            let texels = n as usize * n as usize;
            let slots = (0..texels * rsm.maps.len()).into_par_iter();
            slots.map(|s| all(&rsm.maps[s / texels], (s % texels) as u32)).collect()
        }
        Selection::Grid { cells } => {
            let cells = cells.min(n);
            let per_map = cells as usize * cells as usize;
            let slots = (0..per_map * rsm.maps.len()).into_par_iter();
            slots.map(|s| grid(&rsm.maps[s / per_map], n, cells, (s % per_map) as u32)).collect()
        }
        Selection::Importance { .. } => {
            let tops: Vec<Node> = rsm.maps.iter().map(|m| m.pyramid.top()).collect();
            points.par_iter().map(|&u| importance(&rsm.maps, &tops, u, points.len())).collect()
        }
    }
}

/// The VPLs with flux, in the order of their slots.
#[must_use]
pub fn compact(slots: &[Vpl]) -> Vec<Vpl> {
    slots.iter().filter(|v| has_flux(v.flux)).copied().collect()
}

fn has_flux(flux: Vec3) -> bool {
    flux.x + flux.y + flux.z > 0.0
}

/// The VPL of one texel, its flux and area multiplied by `scale`.
fn vpl_of_texel(map: &Map, texel: u32, scale: f32) -> Vpl {
    let i = texel as usize;
    let t = &map.texels[i];
    Vpl::new(map.surface.position[i], map.surface.normal[i], t.reflected * scale, t.area * scale)
}

/// [`Selection::All`]: the texel itself.
fn all(map: &Map, texel: u32) -> Vpl {
    if has_flux(map.texels[texel as usize].reflected) {
        vpl_of_texel(map, texel, 1.0)
    } else {
        Vpl::default()
    }
}

/// [`Selection::Grid`]: flux and area of the whole cell, at the reflecting texel nearest to the cell's centre.
fn grid(map: &Map, n: u32, cells: u32, cell: u32) -> Vpl {
    let (column, row) = (cell % cells, cell / cells);
    let (x_begin, x_end) = (column * n / cells, (column + 1) * n / cells);
    let (y_begin, y_end) = (row * n / cells, (row + 1) * n / cells);
    // Four times the cell's centre: integers, so that ties fall alike everywhere. A cell of even width has its centre between
    // two texels; an alternating nudge takes the left one in even columns and the right one in odd ones, so that the half
    // texels cancel instead of shifting all light one way.
    let centre_x = 2 * (x_begin + x_end) - 1 + 2 * (column % 2);
    let centre_y = 2 * (y_begin + y_end) - 1 + 2 * (row % 2);
    let mut flux = Vec3::ZERO;
    let mut area = 0.0;
    let mut nearest = u32::MAX;
    let mut texel = 0;
    for y in y_begin..y_end {
        for x in x_begin..x_end {
            let i = y * n + x;
            let t = &map.texels[i as usize];
            if !has_flux(t.reflected) {
                continue;
            }
            flux += t.reflected;
            area += t.area;
            let dx = (4 * x + 2).abs_diff(centre_x);
            let dy = (4 * y + 2).abs_diff(centre_y);
            if dx * dx + dy * dy < nearest {
                nearest = dx * dx + dy * dy;
                texel = i as usize;
            }
        }
    }
    if nearest == u32::MAX {
        return Vpl::default();
    }
    Vpl::new(map.surface.position[texel], map.surface.normal[texel], flux, area)
}

/// [`Selection::Importance`]: a map in proportion to its reflected luminance, then hierarchical warping down its pyramid
/// (Clarberg et al. 2005). A texel that is drawn with the probability `p` stands for `1 / (p · count)` of its flux
/// (`docs/errata.md`, thesis §3.3), and of its area likewise.
fn importance(maps: &[Map], tops: &[Node], u: Vec2, count: usize) -> Vpl {
    let mut total = 0.0;
    for top in tops {
        total += luminance(top.reflected);
    }
    // The map in whose share of the total u.x falls; rounding at the end falls to the last map that has any.
    let mut chosen = usize::MAX;
    let mut fraction = 0.0;
    let mut x = u.x * total;
    for (i, top) in tops.iter().enumerate() {
        let share = luminance(top.reflected);
        if share > 0.0 {
            chosen = i;
            fraction = x / share;
            if x < share {
                break;
            }
            x -= share;
        }
    }
    let Some(map) = maps.get(chosen) else { return Vpl::default() };
    let nodes = &map.pyramid.nodes;
    let warp = Warp::new(map.surface.size, |i| luminance(nodes[i].reflected), Empty::Error);
    let Ok(warp) = warp else { return Vpl::default() };
    let sample = warp.sample(Vec2::new(fraction, u.y));
    let texel = sample.texel[1] * map.surface.size[0] + sample.texel[0];
    let p = luminance(tops[chosen].reflected) / total * sample.pdf;
    vpl_of_texel(map, texel, 1.0 / (p * count as f32))
}
