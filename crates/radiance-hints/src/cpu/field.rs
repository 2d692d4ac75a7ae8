//! Reading the field between hints.

use glam::{UVec3, Vec3};

use crate::{Lattice, Order, Surroundings, Volume};

/// Least share of its weight that a hint behind the receiver's plane keeps: where all are behind, they decide alone.
const LEAST_SHARE: f32 = 1e-4;

/// Hints to read.
#[derive(Debug, Clone, Copy)]
pub struct Field<'a> {
    /// Where they are.
    pub lattice: &'a Lattice,
    /// How many coefficients they have.
    pub order: Order,
    /// Their coefficients, as [`Estimate::hints`](super::Estimate::hints) has them.
    pub hints: &'a [f32],
}

/// Hints before a plane count, those behind do not.
#[derive(Debug, Clone, Copy)]
pub struct Plane {
    /// A point of it.
    pub point: Vec3,
    /// Its unit normal.
    pub normal: Vec3,
    /// 1 to look at it, 0 to count all hints.
    pub strength: f32,
}

impl Plane {
    /// No plane.
    pub const NONE: Self = Self { point: Vec3::ZERO, normal: Vec3::ZERO, strength: 0.0 };

    /// The share of its weight that a hint keeps: it grows from nothing at the plane to all of it a quarter of a cell before.
    fn share(&self, hint: Vec3, cell: Vec3) -> f32 {
        if self.strength == 0.0 {
            return 1.0;
        }
        let side = self.normal.dot(hint - self.point);
        (4.0 * side / self.normal.abs().dot(cell)).clamp(LEAST_SHARE, 1.0)
    }
}

/// The eight hints around a place: the lowest, and the share of the way to the next along each axis.
fn corners(volume: &Volume, q: Vec3) -> (UVec3, Vec3) {
    let last = volume.resolution.as_vec3() - 1.0;
    let g = ((q - volume.origin) / volume.cell - 0.5).clamp(Vec3::ZERO, last);
    let lowest = g.floor().min((last - 1.0).max(Vec3::ZERO));
    (lowest.as_uvec3(), g - lowest)
}

/// How much a volume has to say about a place: 0 outside, 1 from a cell within its border on.
fn inside(volume: &Volume, q: Vec3) -> f32 {
    let t = (q - volume.origin) / volume.cell;
    let border = t.min(volume.resolution.as_vec3() - t);
    border.min_element().clamp(0.0, 1.0)
}

/// Calls `f(hint, position, weight)` for the up to eight hints around a place in a volume.
fn around(volume: &Volume, q: Vec3, mut f: impl FnMut(u32, Vec3, f32)) {
    let (lowest, t) = corners(volume, q);
    let r = volume.resolution;
    for corner in 0..8_u32 {
        let bit = UVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
        let place = (lowest + bit).min(r - 1);
        let part = |axis: usize| if bit[axis] == 1 { t[axis] } else { 1.0 - t[axis] };
        let weight = part(0) * part(1) * part(2);
        if weight > 0.0 {
            let hint = volume.first + (place.z * r.y + place.y) * r.x + place.x;
            f(hint, volume.origin + volume.cell * (place.as_vec3() + 0.5), weight);
        }
    }
}

/// Calls `f(volume, weight)` for the volumes that have a say about a place; the weights add up to 1.
fn blend(lattice: &Lattice, q: Vec3, mut f: impl FnMut(&Volume, f32)) {
    let volumes = lattice.volumes();
    let mut rest = 1.0;
    for (i, volume) in volumes.iter().enumerate() {
        let last = i + 1 == volumes.len();
        let weight = if last { rest } else { rest * inside(volume, q) };
        if weight > 0.0 {
            f(volume, weight);
        }
        rest -= weight;
    }
}

impl Field<'_> {
    /// Diagonal of a cell at `q`, metres, blended as the field is.
    #[must_use]
    pub fn diagonal(&self, q: Vec3) -> f32 {
        let mut diagonal = 0.0;
        blend(self.lattice, q, |volume, weight| diagonal += volume.cell.length() * weight);
        diagonal
    }

    /// The field at `q`, weighed coefficient by coefficient: `Σ L_lm(q) w_lm`. With the lobe of a clamped cosine, irradiance.
    #[must_use]
    pub fn weigh(&self, q: Vec3, plane: &Plane, w: &[f32; 9]) -> (Vec3, f32) {
        let coefficients = self.order.coefficients() as usize;
        let (mut result, mut height) = (Vec3::ZERO, 0.0);
        blend(self.lattice, q, |volume, weight| {
            let (mut sum, mut total, mut side) = (Vec3::ZERO, 0.0, 0.0);
            around(volume, q, |hint, position, share| {
                let share = share * plane.share(position, volume.cell);
                side += plane.normal.dot(position - plane.point) * share;
                let first = hint as usize * coefficients * 3;
                let mut value = Vec3::ZERO;
                for (c, w) in self.hints[first..first + coefficients * 3].chunks_exact(3).zip(w) {
                    value += Vec3::new(c[0], c[1], c[2]) * *w;
                }
                sum += value * share;
                total += share;
            });
            result += sum * (weight / total);
            height += side * (weight / total);
        });
        (result, height)
    }
}

/// What is known of the surroundings of a place: albedo, least and greatest distance, interpolated.
#[must_use]
pub fn surroundings_at(lattice: &Lattice, surroundings: &[Surroundings], q: Vec3) -> (Vec3, f32, f32) {
    let (mut albedo, mut r_min, mut r_max) = (Vec3::ZERO, 0.0, 0.0);
    blend(lattice, q, |volume, weight| {
        around(volume, q, |hint, _, share| {
            let s = &surroundings[hint as usize];
            let share = share * weight;
            albedo += Vec3::from(s.albedo) * share;
            r_min += s.r_min * share;
            r_max += s.r_max * share;
        });
    });
    (albedo, r_min, r_max)
}
