//! Blocks of all levels: those of level 0 are the camera's pixels, coarser ones are stored.

use glam::Vec3;
use indirect_core::GBuffer;
use rsm::Level;

use crate::layout::Block;

/// The nodes of a pyramid over the camera's pixels.
#[derive(Debug, Clone, Copy)]
pub struct Blocks<'a> {
    camera: &'a GBuffer,
    coarse: &'a [Block],
}

impl<'a> Blocks<'a> {
    /// From the pixels and the stored blocks, level 1 first: those that [`mips`](super::mips) makes.
    #[must_use]
    pub const fn new(camera: &'a GBuffer, coarse: &'a [Block]) -> Self {
        Self { camera, coarse }
    }

    /// The block of a node.
    #[must_use]
    #[inline]
    pub fn at(&self, node: usize) -> Block {
        match node.checked_sub(self.camera.len()) {
            None => pixel(self.camera, node),
            Some(i) => self.coarse[i],
        }
    }

    /// Whether a node shows no surface.
    #[inline]
    pub(super) fn is_empty(&self, node: usize) -> bool {
        match node.checked_sub(self.camera.len()) {
            None => self.camera.normal[node] == Vec3::ZERO,
            Some(i) => self.coarse[i].pixels == 0,
        }
    }

    /// Position and normal of a node that shows a surface.
    #[inline]
    pub(super) fn point(&self, node: usize) -> (Vec3, Vec3) {
        match node.checked_sub(self.camera.len()) {
            None => (self.camera.position[node], self.camera.normal[node]),
            Some(i) => (self.coarse[i].position, self.coarse[i].normal),
        }
    }

    /// The blocks of a level above 0, row-major.
    #[must_use]
    pub fn level(&self, level: Level) -> &'a [Block] {
        &self.coarse[level.offset as usize - self.camera.len()..][..level.len()]
    }
}

/// The block of one pixel.
#[inline]
pub(super) fn pixel(camera: &GBuffer, i: usize) -> Block {
    if camera.normal[i] == Vec3::ZERO {
        return Block::EMPTY;
    }
    let depth = camera.depth[i];
    Block {
        position: camera.position[i],
        depth_min: depth,
        normal: camera.normal[i],
        depth_max: depth,
        versine: 0.0,
        pixels: 1,
        mixed: 0,
        radius: 0.0,
    }
}
