//! Surface points that receive light, in blocks of lanes.

use glam::Vec3;
use indirect_core::GBuffer;

/// Receivers that the kernel treats at once.
pub(super) const LANES: usize = 8;

/// One value per lane.
pub(super) type Lanes = [f32; LANES];

/// Positions and normals of [`LANES`] receivers, component by component.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Block {
    pub(super) position: [Lanes; 3],
    pub(super) normal: [Lanes; 3],
}

/// Surface points that receive light, arranged for the kernel.
#[derive(Debug, Clone, Default)]
pub struct Receivers {
    pub(super) blocks: Vec<Block>,
    pub(super) len: usize,
}

impl Receivers {
    /// Number of receivers.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    #[cfg(test)]
    pub(super) fn first_block(&self) -> &Block {
        &self.blocks[0]
    }

    /// The texels of `surface` that see something, and the index of each.
    #[must_use]
    pub fn of_surface(surface: &GBuffer) -> (Self, Vec<u32>) {
        let texels: Vec<u32> =
            (0..surface.len()).filter(|&i| surface.is_surface(i)).map(|i| i as u32).collect();
        let points = texels.iter().map(|&i| (surface.position[i as usize], surface.normal[i as usize]));
        (points.collect(), texels)
    }
}

impl FromIterator<(Vec3, Vec3)> for Receivers {
    /// Collects pairs of world position, metres, and unit normal.
    fn from_iter<T: IntoIterator<Item = (Vec3, Vec3)>>(points: T) -> Self {
        let mut receivers = Self::default();
        for (position, normal) in points {
            let lane = receivers.len % LANES;
            if lane == 0 {
                receivers.blocks.push(Block::default());
            }
            if let Some(block) = receivers.blocks.last_mut() {
                for axis in 0..3 {
                    block.position[axis][lane] = position[axis];
                    block.normal[axis][lane] = normal[axis];
                }
            }
            receivers.len += 1;
        }
        receivers
    }
}
