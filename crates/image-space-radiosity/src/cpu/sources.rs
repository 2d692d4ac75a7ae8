//! `sources`: what the coarsest lights tell before any is gathered: how bright it is about there, and where light bends.

use core::f32::consts::PI;

use glam::Vec3;
use rsm::PyramidLayout;

use crate::{
    layout::{Block, Patch},
    levels::{RECEIVER_CELLS, SOURCE_CELLS, level_of_cells},
};

/// The coarsest lights of all maps.
#[derive(Debug, Clone, Copy)]
pub struct Sources<'a> {
    patches: &'a [Patch],
    /// Patches of each map, the first of the coarse level and their number.
    per_map: usize,
    first: usize,
    count: usize,
}

impl<'a> Sources<'a> {
    /// From the patches of all maps; none where there are no patches.
    #[must_use]
    pub fn new(patches: &'a [Patch], layout: &PyramidLayout) -> Self {
        let level = layout.levels[level_of_cells(layout, SOURCE_CELLS)];
        Self { patches, per_map: layout.len(), first: level.offset as usize, count: level.len() }
    }

    /// Mean over the channels of the irradiance that the lights would cast at a point if all faced it, and of what it bends
    /// there across the distance 1: `Σ Φ/(πD)` in W/m² and `Σ Φ/(πD²)` in W/m⁴.
    #[must_use]
    pub fn at(&self, position: Vec3) -> (f32, f32) {
        let (mut irradiance, mut bend) = (0.0, 0.0);
        for map in self.patches.chunks_exact(self.per_map) {
            for patch in &map[self.first..self.first + self.count] {
                let weight = patch.weight();
                if weight > 0.0 {
                    let v = patch.position - position;
                    let d2 = v.dot(v) + patch.radius * patch.radius;
                    let e = weight / (3.0 * PI * d2);
                    irradiance += e;
                    bend += e / d2;
                }
            }
        }
        (irradiance, bend)
    }
}

/// The irradiance that τ, `bend` and the cut-off are shares of, W/m²: the mean of [`Sources::at`] over what the camera sees.
/// It follows the lights' power, and scaling the scene does not change its ratio to any other irradiance.
#[must_use]
pub fn reference_irradiance(sources: &Sources<'_>, blocks: &[Block], layout: &PyramidLayout) -> f32 {
    let level = layout.levels[level_of_cells(layout, RECEIVER_CELLS)];
    let (mut sum, mut pixels) = (0.0, 0);
    for block in &blocks[level.offset as usize..][..level.len()] {
        if block.pixels > 0 {
            sum += sources.at(block.position).0 * block.pixels as f32;
            pixels += block.pixels;
        }
    }
    if pixels > 0 { sum / pixels as f32 } else { 0.0 }
}
