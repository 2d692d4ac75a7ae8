//! The field at a point of a surface: from the 27 cells around it (§4.1).

use glam::{IVec3, Vec3, Vec4};
use indirect_accel::Accel;
use indirect_core::{Ray, math};
use sh_math::Sh;

use crate::cpu::field::MOST_COEFFICIENTS;
use crate::grid::NONE;
use crate::settings::Weights;
use crate::voxels::Voxels;

/// The field at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Local {
    /// Coefficients: radiance, W/(sr·m²), and distance, metres.
    pub sh: Sh<MOST_COEFFICIENTS, Vec4>,
    /// A number that differs where other cells count.
    pub choices: u32,
}

impl Default for Local {
    fn default() -> Self {
        Self { sh: Sh([Vec4::ZERO; MOST_COEFFICIENTS]), choices: 0 }
    }
}

impl Local {
    /// Irradiance on a surface with the normal `n`, W/m², in closed form; channels that ring below 0 are 0.
    #[must_use]
    pub fn irradiance(&self, n: Vec3) -> Vec3 {
        self.sh.irradiance(n.to_array()).truncate().max(Vec3::ZERO)
    }

    /// Radiance from a direction, W/(sr·m²), and distance in it, metres.
    #[must_use]
    pub fn evaluate(&self, direction: Vec3) -> Vec4 {
        self.sh.evaluate(direction.to_array())
    }
}

/// How far in front of a surface a cell's centre lies from which on its weight is full, in cells.
pub const FULL_SIDE: f32 = 0.25;

/// A field and how it is interpolated.
#[derive(Debug, Clone, Copy)]
pub struct Field<'a> {
    /// The scene, for what is between a point and a cell.
    pub accel: &'a Accel<'a>,
    /// The cells.
    pub voxels: &'a Voxels,
    /// Their coefficients.
    pub cells: &'a [Vec4],
    /// Coefficients of a cell.
    pub coefficients: u32,
    /// Which cells count.
    pub weights: Weights,
    /// [`Params::reach`](crate::Params::reach).
    pub reach: f32,
}

impl Field<'_> {
    /// The field at the point `p` of a surface with the normal `n`. Where no cell counts, in gaps that are narrower than cells, those
    /// count that the next less strict of [`Weights`] lets; 0 where there is none at all.
    #[must_use]
    pub fn at(&self, p: Vec3, n: Vec3) -> Local {
        let rules = [Weights::Visible, Weights::Side, Weights::AsPrinted];
        let mut local = Local::default();
        for rule in rules.into_iter().skip_while(|rule| *rule != self.weights) {
            let total = self.add(&mut local, p, n, rule);
            if total > 0.0 {
                let scale = 1.0 / total;
                local.sh.0.iter_mut().for_each(|s| *s *= scale);
                break;
            }
        }
        local
    }

    /// Adds the cells that a rule lets count and returns the sum of their weights.
    fn add(&self, local: &mut Local, p: Vec3, n: Vec3, rule: Weights) -> f32 {
        let grid = &self.voxels.grid;
        let x = grid.local(p);
        // No cell is near; NaN is nowhere.
        let reached = x.cmpge(Vec3::NEG_ONE).all() && x.cmple(grid.size.as_vec3() + 1.0).all();
        if !reached {
            return 0.0;
        }
        let home = x.floor().as_ivec3();
        let (size, count) = (grid.size.as_ivec3(), self.coefficients as usize);
        let mut total = 0.0;
        for k in 0..27 {
            let cell = home + IVec3::new(k % 3, k / 3 % 3, k / 9) - 1;
            if cell.cmplt(IVec3::ZERO).any() || cell.cmpge(size).any() {
                continue;
            }
            let place = self.voxels.index[grid.number(cell.as_uvec3()) as usize];
            let v = cell.as_vec3() + 0.5 - x;
            let weight = self.weight(v, n, rule);
            if place == NONE || weight <= 0.0 || rule == Weights::Visible && !self.is_visible(p, n, v) {
                continue;
            }
            let cell = &self.cells[place as usize * count..][..count];
            local.sh.0.iter_mut().zip(cell).for_each(|(s, c)| *s += *c * weight);
            local.choices = local.choices.wrapping_add(place + 1);
            total += weight;
        }
        total
    }

    /// Of a cell whose centre is `v` cells away.
    fn weight(&self, v: Vec3, n: Vec3, rule: Weights) -> f32 {
        let r = v.length() / self.reach;
        if r >= 1.0 {
            return 0.0;
        }
        let near = (2.0 * r - 3.0) * r * r + 1.0;
        if rule == Weights::AsPrinted { near } else { near * (n.dot(v) / FULL_SIDE).clamp(0.0, 1.0) }
    }

    /// Whether nothing is between the point and the centre of a cell.
    fn is_visible(&self, p: Vec3, n: Vec3, v: Vec3) -> bool {
        let origin = math::offset_ray_origin_scaled(p, n, self.accel.unit());
        !self.accel.any_hit(&Ray { origin, direction: v * self.voxels.grid.cell, t_max: 1.0 })
    }
}
