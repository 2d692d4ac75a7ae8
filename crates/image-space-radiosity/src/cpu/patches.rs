//! `patches`: texels of the reflective shadow maps put together to lights of any size, level by level (§3.3).
//!
//! A patch has the sum of the flux and of the area, the flux-weighted mean of positions and normals, and bounds of all three.
//! No level loses or gains flux.

use core::f32::consts::FRAC_1_PI;

use glam::Vec3;
use indirect_core::math::versine_of_sum;
use rayon::prelude::*;
use rsm::{Map, PyramidLayout, Texel, Vpl};

use crate::layout::Patch;

/// The patches of all levels of a map: those of level 0 are its texels, coarser ones are stored.
#[derive(Debug, Clone, Copy)]
pub struct Patches<'a> {
    positions: &'a [Vec3],
    normals: &'a [Vec3],
    texels: &'a [Texel],
    coarse: &'a [Patch],
}

impl<'a> Patches<'a> {
    /// From the texels and the stored patches, level 1 first: those that [`patches`] makes.
    #[must_use]
    pub fn new(map: &'a Map, coarse: &'a [Patch]) -> Self {
        Self { positions: &map.surface.position, normals: &map.surface.normal, texels: &map.texels, coarse }
    }

    /// The patch of a node.
    #[must_use]
    #[inline]
    pub fn at(&self, node: usize) -> Patch {
        match node.checked_sub(self.texels.len()) {
            None => self.texel(node),
            Some(i) => self.coarse[i],
        }
    }

    /// The patch of a node, or the light of a texel.
    #[inline]
    pub(super) fn get(&self, node: usize) -> Result<&'a Patch, Vpl> {
        match node.checked_sub(self.texels.len()) {
            Some(i) => Ok(&self.coarse[i]),
            None if weight(self.texels[node].reflected) <= 0.0 => Err(Vpl::default()),
            None => {
                let texel = &self.texels[node];
                Err(Vpl::new(self.positions[node], self.normals[node], texel.reflected, texel.area))
            }
        }
    }

    /// Sum of the flux of a node over the channels, W.
    #[inline]
    pub(super) fn weight(&self, node: usize) -> f32 {
        match node.checked_sub(self.texels.len()) {
            None => weight(self.texels[node].reflected),
            Some(i) => self.coarse[i].weight(),
        }
    }

    /// The patch of a node above level 0.
    #[inline]
    pub(super) fn coarse(&self, node: usize) -> &'a Patch {
        &self.coarse[node - self.texels.len()]
    }

    /// The patch of one texel: a disc.
    #[inline]
    fn texel(&self, i: usize) -> Patch {
        let texel = &self.texels[i];
        if weight(texel.reflected) <= 0.0 {
            return Patch::default();
        }
        Patch {
            position: self.positions[i],
            area: texel.area,
            normal: self.normals[i],
            radius: (texel.area * FRAC_1_PI).sqrt(),
            flux: texel.reflected,
            ..Patch::default()
        }
    }
}

/// The patches of the levels `1..` of a map, whose size is that of `layout`.
#[must_use]
pub fn patches(map: &Map, layout: &PyramidLayout) -> Vec<Patch> {
    let first = map.texels.len();
    let texels = Patches::new(map, &[]);
    let mut patches = Vec::with_capacity(layout.len() - first);
    for (level, pair) in (1..).zip(layout.levels.windows(2)) {
        let (fine, coarse) = (pair[0], pair[1]);
        let (width, fine_width) = (coarse.size[0], fine.size[0]);
        let nodes = (0..coarse.len() as u32).into_par_iter().with_min_len(1024);
        let at = |i: u32| [i % width, i / width];
        let nodes: Vec<Patch> = if level == 1 {
            let child = |x, y| texels.texel((y * fine_width + x) as usize);
            nodes.map(|i| parent(child, fine.size, at(i))).collect()
        } else {
            let children = &patches[fine.offset as usize - first..];
            let child = |x, y| children[(y * fine_width + x) as usize];
            nodes.map(|i| parent(child, fine.size, at(i))).collect()
        };
        patches.extend(nodes);
    }
    patches
}

/// Sum of the channels.
fn weight(flux: Vec3) -> f32 {
    flux.x + flux.y + flux.z
}

/// The patch of the up to four children at `(2x, 2y)…(2x+1, 2y+1)`.
fn parent(child: impl Fn(u32, u32) -> Patch, size: [u32; 2], [x, y]: [u32; 2]) -> Patch {
    let mut patch = Patch::default();
    let x_end = (2 * x + 2).min(size[0]);
    let y_end = (2 * y + 2).min(size[1]);
    let mut brightest = Vec3::ZERO;
    let mut most = 0.0;
    for cy in 2 * y..y_end {
        for cx in 2 * x..x_end {
            let child = child(cx, cy);
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
            let child = child(cx, cy);
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
            let child = child(cx, cy);
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
