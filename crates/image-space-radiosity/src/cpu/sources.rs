//! `sources`: what the coarsest lights tell before any is gathered: how bright it is about there, and where light bends.

use core::f32::consts::PI;

use glam::Vec3;
use rsm::PyramidLayout;

use super::blocks::Blocks;
use super::patches::Patches;
use crate::{
    layout::Patch,
    levels::{RECEIVER_CELLS, level_of_cells},
};

/// The patches of one level of all maps, one map after the other: the coarsest lights.
#[must_use]
pub fn sources(maps: &[Patches<'_>], level: usize, layout: &PyramidLayout) -> Vec<Patch> {
    let level = layout.levels[level];
    let nodes = level.offset as usize..level.offset as usize + level.len();
    maps.iter().flat_map(|map| nodes.clone().map(|node| map.at(node))).collect()
}

/// Mean over the channels of the irradiance that the lights would cast at a point if all faced it, and of what it bends
/// there across the distance 1: `Σ Φ/(πD)` in W/m² and `Σ Φ/(πD²)` in W/m⁴.
#[must_use]
pub fn sources_at(sources: &[Patch], position: Vec3) -> (f32, f32) {
    let (mut irradiance, mut bend) = (0.0, 0.0);
    for patch in sources {
        let weight = patch.weight();
        if weight > 0.0 {
            let v = patch.position - position;
            let d2 = v.dot(v) + patch.radius * patch.radius;
            let e = weight / (3.0 * PI * d2);
            irradiance += e;
            bend += e / d2;
        }
    }
    (irradiance, bend)
}

/// The irradiance that τ, `bend` and the cut-off are shares of, W/m²: the mean of [`sources_at`] over what the camera sees.
/// It follows the lights' power, and scaling the scene does not change its ratio to any other irradiance.
#[must_use]
pub fn reference_irradiance(sources: &[Patch], blocks: &Blocks<'_>, layout: &PyramidLayout) -> f32 {
    let level = layout.levels[level_of_cells(layout, RECEIVER_CELLS)];
    let (mut sum, mut pixels) = (0.0, 0);
    for node in level.offset as usize..level.offset as usize + level.len() {
        let block = blocks.at(node);
        if block.pixels > 0 {
            sum += sources_at(sources, block.position).0 * block.pixels as f32;
            pixels += block.pixels;
        }
    }
    if pixels > 0 { sum / pixels as f32 } else { 0.0 }
}
