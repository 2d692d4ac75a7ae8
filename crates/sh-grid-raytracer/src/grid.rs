//! Where the cells of the grids lie.

use glam::{UVec3, Vec3};
use indirect_core::Aabb;

/// Cells of the V-grid along each side of a cell of the SH-grid (§3.1).
pub const FINE: u32 = 4;

/// No cell.
pub const NONE: u32 = u32::MAX;

/// What is left free between the triangles' bounds and the grid's border, in cells. Not symmetric and no round numbers: surfaces in
/// the middle of a scene should not lie in the planes between cells, where rounding decides to which one a point belongs.
const MARGIN: [f32; 2] = [0.0137, 0.0219];

/// The cubic cells of the SH-grid; those of the R-grid's finest level are the same, and each holds 4×4×4 cells of the V-grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Corner with the least coordinates, metres.
    pub origin: Vec3,
    /// Side of a cell, metres.
    pub cell: f32,
    /// Cells along each axis, each at least 1.
    pub size: UVec3,
}

impl Default for Grid {
    fn default() -> Self {
        Self { origin: Vec3::ZERO, cell: 1.0, size: UVec3::ONE }
    }
}

impl Grid {
    /// A grid around `bounds` with `resolution` cells along the longest axis.
    #[must_use]
    pub fn around(bounds: &Aabb, resolution: u32) -> Self {
        let (extent, n) = (bounds.extent(), resolution.max(1) as f32);
        let longest = extent.max_element();
        // Finer than what coordinates resolve, cells would be empty or full by chance.
        let least = bounds.min.abs().max(bounds.max.abs()).max_element() * 1e-6;
        let cell = (longest / (n - MARGIN[0] - MARGIN[1]).max(0.5)).max(least).max(f32::MIN_POSITIVE * 1e6);
        if !cell.is_finite() {
            return Self::default();
        }
        let cells = (extent / cell + (MARGIN[0] + MARGIN[1])).ceil().max(Vec3::ONE).min(Vec3::splat(n));
        // What is free on the shorter axes lies half on either side.
        let free = (cells - extent / cell - (MARGIN[0] + MARGIN[1])).max(Vec3::ZERO) * 0.5;
        Self { origin: bounds.min - (free + MARGIN[0]) * cell, cell, size: cells.as_uvec3() }
    }

    /// Cells of the cube that holds them all.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.size.x as usize * self.size.y as usize * self.size.z as usize
    }

    /// Never: a grid has a cell.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        false
    }

    /// A point in units of cells from the origin.
    #[must_use]
    #[inline]
    pub fn local(&self, p: Vec3) -> Vec3 {
        (p - self.origin) * (1.0 / self.cell)
    }

    /// The cell that holds a point in units of cells; `None` outside, and for NaN.
    #[must_use]
    #[inline]
    pub fn cell_at(&self, local: Vec3) -> Option<UVec3> {
        let size = self.size.as_vec3();
        let inside = local.cmpge(Vec3::ZERO).all() && local.cmplt(size).all();
        inside.then(|| local.as_uvec3())
    }

    /// Number of a cell in the cube, x fastest.
    #[must_use]
    #[inline]
    pub const fn number(&self, cell: UVec3) -> u32 {
        (cell.z * self.size.y + cell.y) * self.size.x + cell.x
    }

    /// The cell of a number.
    #[must_use]
    #[inline]
    pub const fn cell_of(&self, number: u32) -> UVec3 {
        let (x, rest) = (number % self.size.x, number / self.size.x);
        UVec3::new(x, rest % self.size.y, rest / self.size.y)
    }

    /// Longest way through the grid, metres.
    #[must_use]
    pub fn diagonal(&self) -> f32 {
        self.cell * self.size.as_vec3().length()
    }

    /// Centre of a cell, metres.
    #[must_use]
    #[inline]
    pub fn centre(&self, cell: UVec3) -> Vec3 {
        self.origin + (cell.as_vec3() + 0.5) * self.cell
    }

    /// The grid of the next coarser level: 2×2×2 cells are one.
    #[must_use]
    pub fn coarser(&self) -> Self {
        let half = |n: u32| n.div_ceil(2);
        let size = UVec3::new(half(self.size.x), half(self.size.y), half(self.size.z));
        Self { cell: self.cell * 2.0, size, ..*self }
    }
}
