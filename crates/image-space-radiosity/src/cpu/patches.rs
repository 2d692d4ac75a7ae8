//! `patches`: texels of the reflective shadow maps put together to lights of any size, level by level (§3.3).
//!
//! A patch has the sum of the flux and of the area, the flux-weighted mean of positions and normals, and bounds of all three.
//! No level loses or gains flux.

use core::f32::consts::FRAC_1_PI;

use glam::Vec3;
use indirect_core::{GBuffer, math::versine_of_sum};
use rayon::prelude::*;
use rsm::{PyramidLayout, Rsm, Texel};

use crate::layout::Patch;

/// The patches of all levels of each map, one map after the other.
#[must_use]
pub fn patches(rsm: &Rsm, layout: &PyramidLayout) -> Vec<Patch> {
    let mut all = Vec::with_capacity(rsm.maps.len() * layout.len());
    for map in &rsm.maps {
        all.extend(patches_of_map(&map.surface, &map.texels, layout));
    }
    all
}

fn patches_of_map(surface: &GBuffer, texels: &[Texel], layout: &PyramidLayout) -> Vec<Patch> {
    let mut patches = Vec::with_capacity(layout.len());
    (0..texels.len())
        .into_par_iter()
        .with_min_len(1024)
        .map(|i| leaf(surface.position[i], surface.normal[i], &texels[i]))
        .collect_into_vec(&mut patches);
    for pair in layout.levels.windows(2) {
        let (fine, coarse) = (pair[0], pair[1]);
        let children = &patches[fine.offset as usize..];
        let width = coarse.size[0];
        let level: Vec<Patch> = (0..coarse.len() as u32)
            .into_par_iter()
            .with_min_len(1024)
            .map(|i| parent(children, fine.size, i % width, i / width))
            .collect();
        patches.extend(level);
    }
    patches
}

/// The patch of one texel: a disc.
fn leaf(position: Vec3, normal: Vec3, texel: &Texel) -> Patch {
    if texel.reflected.x + texel.reflected.y + texel.reflected.z <= 0.0 {
        return Patch::default();
    }
    Patch {
        position,
        area: texel.area,
        normal,
        radius: (texel.area * FRAC_1_PI).sqrt(),
        flux: texel.reflected,
        ..Patch::default()
    }
}

/// The patch of the up to four children at `(2x, 2y)…(2x+1, 2y+1)`.
fn parent(children: &[Patch], size: [u32; 2], x: u32, y: u32) -> Patch {
    let mut patch = Patch::default();
    let x_end = (2 * x + 2).min(size[0]);
    let y_end = (2 * y + 2).min(size[1]);
    let mut brightest = Vec3::ZERO;
    let mut most = 0.0;
    for cy in 2 * y..y_end {
        for cx in 2 * x..x_end {
            let child = &children[(cy * size[0] + cx) as usize];
            patch.flux += child.flux;
            patch.area += child.area;
            let weight = child.weight();
            if weight > most {
                most = weight;
                brightest = child.normal;
            }
        }
    }
    let total = patch.weight();
    if total <= 0.0 {
        return patch;
    }
    let mut axis = Vec3::ZERO;
    for cy in 2 * y..y_end {
        for cx in 2 * x..x_end {
            let child = &children[(cy * size[0] + cx) as usize];
            let share = child.weight() / total;
            patch.position += child.position * share;
            axis += child.normal * share;
        }
    }
    let length = axis.dot(axis).sqrt();
    let cancelled = length < 1e-3;
    // Normals that cancel: the brightest is better than none, the cone is everything.
    patch.normal = if cancelled { brightest } else { axis * (1.0 / length) };
    for cy in 2 * y..y_end {
        for cx in 2 * x..x_end {
            let child = &children[(cy * size[0] + cx) as usize];
            if child.weight() > 0.0 {
                let v = child.position - patch.position;
                patch.radius = patch.radius.max(v.dot(v).sqrt() + child.radius);
                let offset = child.normal - patch.normal;
                let versine = 0.5 * offset.dot(offset);
                let sine = (versine * (2.0 - versine)).max(0.0).sqrt();
                let relief = patch.normal.dot(v).abs() + child.relief + child.radius * sine;
                patch.relief = patch.relief.max(relief);
                patch.versine = patch.versine.max(versine_of_sum(versine, child.versine));
            }
        }
    }
    if cancelled {
        patch.versine = 2.0;
    }
    patch
}
