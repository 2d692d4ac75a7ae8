//! `traverse`: each tile of neighbouring fragments gathers its own cut through the tree of lights (§3.5.1).
//!
//! The walk keeps no stack: a branch is either skipped to [`Branch::next`] or followed by its first child. The fragments of a
//! tile share the cut that the nearest point of their bounding sphere needs, which is at least as fine as each alone.

use glam::Vec3;
use rayon::prelude::*;
use rsm::{Form, Vpl, cpu::Receivers};

use crate::{layout::Branch, levels::TILE};

/// Irradiance per fragment, W/m², and the number of lights in the cut of each tile.
#[must_use]
pub fn traverse(tree: &[Branch], points: &[(Vec3, Vec3)], form: Form) -> (Vec<Vec3>, Vec<u32>) {
    let tiles: Vec<(Vec<Vec3>, u32)> = points
        .par_chunks(TILE)
        .map_init(Vec::new, |lights, tile| {
            let (centre, radius) = bounds(tile);
            cut(tree, centre, radius, lights);
            let receivers: Receivers = tile.iter().copied().collect();
            (rsm::cpu::gather(lights, &receivers, form), lights.len() as u32)
        })
        .collect();
    let cuts = tiles.iter().map(|(_, cut)| *cut).collect();
    (tiles.into_iter().flat_map(|(e, _)| e).collect(), cuts)
}

/// A sphere around points.
#[must_use]
pub fn bounds(points: &[(Vec3, Vec3)]) -> (Vec3, f32) {
    let (mut min, mut max) = (Vec3::MAX, Vec3::MIN);
    for (p, _) in points {
        min = min.min(*p);
        max = max.max(*p);
    }
    let centre = (min + max) * 0.5;
    let mut radius2 = 0.0_f32;
    for (p, _) in points {
        let v = *p - centre;
        radius2 = radius2.max(v.dot(v));
    }
    (centre, radius2.sqrt())
}

/// The lights that receivers in the sphere need, in the order of the tree.
pub fn cut(tree: &[Branch], centre: Vec3, radius: f32, lights: &mut Vec<Vpl>) {
    lights.clear();
    let mut i = 0;
    while let Some(branch) = tree.get(i) {
        let v = branch.position - centre;
        let reach = branch.reach + radius;
        if branch.reach > 0.0 && v.dot(v) < reach * reach {
            i += 1;
            continue;
        }
        if branch.flux.x + branch.flux.y + branch.flux.z > 0.0 {
            lights.push(branch.vpl());
        }
        i = branch.next as usize;
    }
}
