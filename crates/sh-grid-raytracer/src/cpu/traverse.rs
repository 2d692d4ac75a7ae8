//! Rays through the two grids (§3.4.2): the SH-grid's cells, and within its boundary cells those of the V-grid.

use glam::{IVec3, UVec3, Vec3};

use crate::grid::FINE;
use crate::voxels::Voxels;

/// A fine boundary cell that a ray entered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VoxelHit {
    /// Where the ray entered it, in lengths of its direction.
    pub t: f32,
    /// Place of its cell among the boundary cells.
    pub place: u32,
    /// Its bit there.
    pub bit: u32,
}

/// Shorter components of a direction than this share of the longest are taken as that long, so that no distance is 0/0.
const LEAST_SLOPE: f32 = 1e-9;

/// Fine cells whose centres are no farther from a ray's origin along any axis, in fine cells, do not stop it: a ray that starts beside
/// a surface gets away from it.
const CLEAR: f32 = 1.01;

/// Steps through a grid from cell to cell (Amanatides & Woo 1987).
#[derive(Debug, Clone, Copy)]
struct Walk {
    cell: IVec3,
    step: IVec3,
    /// Where the ray leaves the cell along each axis.
    next: Vec3,
    delta: Vec3,
    /// Where it entered it.
    t: f32,
}

impl Walk {
    /// From the cell that holds `start`, a point of the ray, in a grid of cells of the size `side` whose corner is `low`; `last` bounds
    /// the cell.
    fn new(origin: Vec3, inverse: Vec3, (start, t): (Vec3, f32), side: f32, low: Vec3, last: IVec3) -> Self {
        let cell = ((start - low) / side).floor().as_ivec3().clamp(IVec3::ZERO, last);
        let up = inverse.cmpge(Vec3::ZERO);
        let step = IVec3::select(up, IVec3::ONE, IVec3::NEG_ONE);
        let border = low + (cell + IVec3::select(up, IVec3::ONE, IVec3::ZERO)).as_vec3() * side;
        Self { cell, step, next: (border - origin) * inverse, delta: inverse.abs() * side, t }
    }

    fn advance(&mut self) {
        let Vec3 { x, y, z } = self.next;
        if x <= y && x <= z {
            self.t = x;
            self.cell.x += self.step.x;
            self.next.x += self.delta.x;
        } else if y <= z {
            self.t = y;
            self.cell.y += self.step.y;
            self.next.y += self.delta.y;
        } else {
            self.t = z;
            self.cell.z += self.step.z;
            self.next.z += self.delta.z;
        }
    }

    fn is_within(&self, size: IVec3) -> bool {
        self.cell.cmpge(IVec3::ZERO).all() && self.cell.cmplt(size).all()
    }
}

/// The first fine boundary cell that a ray from `origin`, a point in the grid in units of cells, meets before `t_max`, but for those at
/// the origin itself.
#[must_use]
pub fn first_voxel(voxels: &Voxels, origin: Vec3, direction: Vec3, t_max: f32) -> Option<VoxelHit> {
    let grid = &voxels.grid;
    let least = direction.abs().max_element() * LEAST_SLOPE;
    let inverse =
        Vec3::select(direction.abs().cmplt(Vec3::splat(least)), Vec3::splat(least), direction).recip();
    let (size, side) = (grid.size.as_ivec3(), 1.0 / FINE as f32);
    let mut walk = Walk::new(origin, inverse, (origin, 0.0), 1.0, Vec3::ZERO, size - 1);
    while walk.is_within(size) && walk.t < t_max {
        let cell = walk.cell.as_uvec3();
        let place = voxels.index[grid.number(cell) as usize];
        if place < voxels.boundary {
            let (voxel, low) = (&voxels.voxels[place as usize], cell.as_vec3());
            let start = (origin + direction * walk.t, walk.t);
            let mut fine = Walk::new(origin, inverse, start, side, low, IVec3::splat(FINE as i32 - 1));
            while fine.is_within(IVec3::splat(FINE as i32)) {
                let UVec3 { x, y, z } = fine.cell.as_uvec3();
                let bit = (z * FINE + y) * FINE + x;
                let centre = low + (fine.cell.as_vec3() + 0.5) * side;
                if voxel.has(bit) && (centre - origin).abs().max_element() > CLEAR * side {
                    return (fine.t < t_max).then_some(VoxelHit { t: fine.t, place, bit });
                }
                fine.advance();
            }
        }
        walk.advance();
    }
    None
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::*;
    use indirect_gpu::shaders::SH_GRID_FIELD_VOXELS;
    use testkit::layout::check_constant;

    #[test]
    fn constants_are_those_of_the_shader() {
        check_constant(&SH_GRID_FIELD_VOXELS, "LEAST_SLOPE", LEAST_SLOPE).unwrap();
        check_constant(&SH_GRID_FIELD_VOXELS, "CLEAR", CLEAR).unwrap();
    }
}
