//! The V-grid and the SH-grid of a scene's surfaces (§3.1), sparse.

use glam::Vec3;
use indirect_core::octahedral;

use crate::grid::Grid;
use crate::layout::Voxel;

/// Which cells surfaces pass through, and how these lie in them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Voxels {
    /// The SH-grid.
    pub grid: Grid,
    /// For every cell of the grid its place among [`Self::cells`], or [`NONE`](crate::NONE).
    pub index: Vec<u32>,
    /// Numbers of the active cells: first the boundary cells, then those of their 26 neighbours that are none; both in order.
    pub cells: Vec<u32>,
    /// How many of them are boundary cells. The lists below have an entry for each of these.
    pub boundary: u32,
    /// Which of its 4×4×4 fine cells are boundary cells.
    pub voxels: Vec<Voxel>,
    /// Mean normals of the triangles of the fine boundary cells, octahedral. Surfaces have two sides: only the axis counts, its sign
    /// does not.
    pub normals: Vec<u32>,
    /// Area of the surfaces in a cell, both sides of each, shared out over the faces −x, +x, −y, +y, −z, +z by the squared cosines
    /// between face and side, m².
    pub areas: Vec<[f32; 6]>,
}

/// The six faces' shares of a direction: squared cosines with the three that it points to. They sum to 1 for a unit vector.
#[must_use]
#[inline]
pub fn face_shares(d: Vec3) -> [f32; 6] {
    let (below, above) = ((-d).max(Vec3::ZERO), d.max(Vec3::ZERO));
    let (below, above) = (below * below, above * above);
    [below.x, above.x, below.y, above.y, below.z, above.z]
}

impl Voxels {
    /// Place of the boundary cell that holds a point in units of cells; `None` where there is none.
    #[must_use]
    #[inline]
    pub fn boundary_at(&self, local: Vec3) -> Option<u32> {
        let cell = self.grid.cell_at(local)?;
        let place = self.index[self.grid.number(cell) as usize];
        (place < self.boundary).then_some(place)
    }

    /// The normal of a fine boundary cell, either sign.
    #[must_use]
    #[inline]
    pub fn normal(&self, place: u32, bit: u32) -> Vec3 {
        let voxel = &self.voxels[place as usize];
        octahedral::unpack(self.normals[(voxel.first_normal + voxel.rank(bit)) as usize])
    }

    /// Memory, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&self.index[..])
            + size_of_val(&self.cells[..])
            + size_of_val(&self.voxels[..])
            + size_of_val(&self.normals[..])
            + size_of_val(&self.areas[..])
    }
}
