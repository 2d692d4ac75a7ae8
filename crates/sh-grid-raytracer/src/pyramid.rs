//! Which cells the coarser levels of the R-grid have (§3.3).

use glam::UVec3;

use crate::grid::{Grid, NONE};
use crate::voxels::Voxels;

/// The cells of all levels of the R-grid. Level 0 has the boundary cells of the SH-grid; 2×2×2 cells of a level are one of the next.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pyramid {
    /// Level by level.
    pub levels: Vec<Level>,
    /// For every cell of the cubes of levels 1, 2, …, one cube after another, its place among all cells of the pyramid, or
    /// [`NONE`]. That of level 0 is [`Voxels::index`].
    pub index: Vec<u32>,
    /// The eight cells that each cell of levels 1, 2, … is made of, or [`NONE`].
    pub children: Vec<[u32; 8]>,
}

/// A level of the R-grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Where its cells lie.
    pub grid: Grid,
    /// Where its cube begins in [`Pyramid::index`]; 0 for level 0.
    pub cube: u32,
    /// Where its cells begin among those of all levels.
    pub first: u32,
    /// How many there are.
    pub count: u32,
}

impl Pyramid {
    /// All levels above the boundary cells of `voxels`.
    #[must_use]
    pub fn over(voxels: &Voxels) -> Self {
        let mut p = Self::default();
        p.levels.push(Level { grid: voxels.grid, cube: 0, first: 0, count: voxels.boundary });
        let mut numbers: Vec<u32> = voxels.cells[..voxels.boundary as usize].to_vec();
        while let Some(below) = p.levels.last().copied().filter(|l| l.grid.len() > 1) {
            let grid = below.grid.coarser();
            let (cube, first) = (p.index.len() as u32, below.first + below.count);
            p.index.resize(p.index.len() + grid.len(), NONE);
            let mut found = Vec::new();
            for (place, &number) in (below.first..).zip(&numbers) {
                let fine = below.grid.cell_of(number);
                let coarse = grid.number(fine / 2);
                let slot = &mut p.index[(cube + coarse) as usize];
                if *slot == NONE {
                    *slot = first + found.len() as u32;
                    found.push(coarse);
                    p.children.push([NONE; 8]);
                }
                let UVec3 { x, y, z } = fine % 2;
                let parent = *slot - voxels.boundary;
                p.children[parent as usize][((z * 2 + y) * 2 + x) as usize] = place;
            }
            p.levels.push(Level { grid, cube, first, count: found.len() as u32 });
            numbers = found;
        }
        p
    }

    /// Cells of all levels.
    #[must_use]
    pub fn len(&self) -> usize {
        self.levels.last().map_or(0, |l| (l.first + l.count) as usize)
    }

    /// Whether no surface lies in the grid.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Place of the cell of `level ≥ 1` that holds the cell `fine` of level 0; [`NONE`] where it has none.
    #[must_use]
    #[inline]
    pub fn ancestor(&self, fine: UVec3, level: u32) -> u32 {
        let l = &self.levels[level as usize];
        self.index[(l.cube + l.grid.number(fine >> level)) as usize]
    }
}
