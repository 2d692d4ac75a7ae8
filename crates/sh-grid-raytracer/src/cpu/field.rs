//! `field`: spherical harmonics of the radiance that arrives at the centres of the active cells, and of the distance from where (§3.4).

use core::f32::consts::PI;

use glam::{Mat3, Vec3, Vec4};
use indirect_accel::Accel;
use indirect_core::{Ray, octahedral};
use rayon::prelude::*;
use sh_math::basis;

use crate::cpu::lookup::{Look, Lookup};
use crate::cpu::traverse::first_voxel;
use crate::directions::turn_of;
use crate::settings::Traverse;
use crate::voxels::Voxels;

/// Coefficients of the highest order.
pub const MOST_COEFFICIENTS: usize = 16;

/// What cells look at.
#[derive(Debug, Clone, Copy)]
pub struct Sight<'a> {
    /// The scene.
    pub accel: &'a Accel<'a>,
    /// Normals of its triangles, octahedral.
    pub normals: &'a [u32],
    /// Its cells.
    pub voxels: &'a Voxels,
    /// What they reflect.
    pub lookup: Lookup<'a>,
    /// How rays find what they see.
    pub traverse: Traverse,
}

impl Sight<'_> {
    /// What a ray from `origin`, metres, meets, and where, metres. `area` is what it stands for at the distance of a cell, in faces of
    /// a cell.
    #[must_use]
    pub fn look(&self, origin: Vec3, direction: Vec3, area: f32) -> Option<(Look, f32)> {
        let grid = &self.voxels.grid;
        let local = grid.local(origin);
        let (place, normal, t, mark) = match self.traverse {
            Traverse::Rays => {
                let hit = self.accel.closest_hit(&Ray::new(origin, direction))?;
                let t = hit.t / grid.cell;
                let place = self.voxels.boundary_at(local + direction * t)?;
                (place, octahedral::unpack(self.normals[hit.triangle as usize]), t, hit.triangle + 1)
            }
            Traverse::Voxels => {
                let hit = first_voxel(self.voxels, local, direction, f32::INFINITY)?;
                let mark = hit.place.wrapping_mul(64).wrapping_add(hit.bit + 1);
                (hit.place, self.voxels.normal(hit.place, hit.bit), hit.t, mark)
            }
        };
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        let cell = grid.cell_of(self.voxels.cells[place as usize]);
        let look = Look { place, cell, normal, origin: local, direction, area: area * t * t, mark };
        Some((look, t * grid.cell))
    }
}

/// How a field is made.
#[derive(Debug, Clone, Copy)]
pub struct FieldSettings<'a> {
    /// Unit vectors, evenly spread.
    pub directions: &'a [Vec3],
    /// Turns of them; cells take different ones.
    pub turns: &'a [Mat3],
    /// Whether cells turn theirs.
    pub turned: bool,
    /// Whether looks have an area.
    pub footprint: bool,
    /// Chooses the turns.
    pub seed: u32,
    /// Coefficients of a cell.
    pub coefficients: u32,
}

/// The active cells, in order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cells {
    /// Coefficients, cell by cell: radiance, W/(sr·m²), and distance, metres.
    pub coefficients: Vec<Vec4>,
    /// Of each cell a number that differs where its rays end elsewhere.
    pub seen: Vec<u32>,
}

/// What arrives at the centre of each active cell. What leads out of the scene is black and as far as the grid is wide.
#[must_use]
pub fn field(sight: &Sight<'_>, settings: &FieldSettings<'_>) -> Cells {
    let FieldSettings { directions, turns, .. } = settings;
    let weight = 4.0 * PI / directions.len() as f32;
    let (grid, n) = (&sight.voxels.grid, settings.coefficients as usize);
    let far = grid.diagonal();
    let area = if settings.footprint { weight } else { 0.0 };
    let one = |&number: &u32| {
        let origin = grid.centre(grid.cell_of(number));
        let turn = settings.turned.then(|| turns[turn_of(number, settings.seed) as usize]);
        let (mut sums, mut places) = ([Vec4::ZERO; MOST_COEFFICIENTS], 0_u32);
        for &d in *directions {
            let d = turn.map_or(d, |t| t * d);
            let seen = sight.look(origin, d, area);
            let mut value = Vec4::new(0.0, 0.0, 0.0, far);
            if let Some((look, distance)) = seen {
                value = sight.lookup.radiance(&look).extend(distance);
                places = places.wrapping_add(look.mark);
            }
            let value = value * weight;
            let y: [f32; MOST_COEFFICIENTS] = basis(d.to_array());
            sums[..n].iter_mut().zip(y).for_each(|(s, y)| *s += value * y);
        }
        (sums, places)
    };
    let cells: Vec<_> = sight.voxels.cells.par_iter().with_min_len(4).map(one).collect();
    Cells {
        coefficients: cells.iter().flat_map(|(sums, _)| &sums[..n]).copied().collect(),
        seen: cells.iter().map(|(_, places)| *places).collect(),
    }
}
