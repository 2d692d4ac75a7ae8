//! Interpolating the field between hints.

use core::f32::consts::{FRAC_PI_4, PI};

use glam::{UVec3, Vec3, Vec4};
use sh_math::twins::sh_lobe_l2;

use crate::{layout::Volume, settings::Order, volume::Lattice};

/// Least share of its weight that a hint behind the receiver's plane keeps, so that some weight is left where all are behind.
pub(crate) const LEAST_SHARE: f32 = 1e-7;

/// The coefficients of a hint as it stores them: four of red, green and blue each, four more of each, and the ninth of all
/// three. Order 2 keeps the first three vectors.
#[must_use]
pub fn pack(sh: &[Vec3; 9]) -> [Vec4; 7] {
    let four = |first: usize, channel: usize| {
        Vec4::new(sh[first][channel], sh[first + 1][channel], sh[first + 2][channel], sh[first + 3][channel])
    };
    [four(0, 0), four(0, 1), four(0, 2), four(4, 0), four(4, 1), four(4, 2), sh[8].extend(0.0)]
}

/// `A_l` of the clamped cosine.
const COSINE: Vec3 = Vec3::new(PI, 2.094_395_1, FRAC_PI_4);

/// The clamped cosine about the unit vector `n`.
pub(super) fn cosine_lobe(n: Vec3) -> [f32; 9] {
    sh_lobe_l2(COSINE, n)
}

/// Hints to read.
#[derive(Debug, Clone, Copy)]
pub struct Field<'a> {
    /// Where they are.
    pub lattice: &'a Lattice,
    /// How many coefficients they have.
    pub order: Order,
    /// Their coefficients, as [`Estimate::hints`](super::Estimate::hints) has them.
    pub hints: &'a [Vec4],
}

/// A plane in front of which hints are read and behind which they are not.
#[derive(Debug, Clone, Copy)]
pub struct Plane {
    /// A point of it.
    pub point: Vec3,
    /// Its unit normal.
    pub normal: Vec3,
    /// 1 to read only hints in front of it, 0 to read all.
    pub strength: f32,
}

impl Plane {
    /// No plane.
    pub const NONE: Self = Self { point: Vec3::ZERO, normal: Vec3::ZERO, strength: 0.0 };

    /// The share of its weight that a hint keeps: it grows from nothing at the plane to all of it an eighth of a cell before.
    fn share(&self, hint: Vec3, cell: Vec3) -> f32 {
        if self.strength == 0.0 {
            return 1.0;
        }
        let side = self.normal.dot(hint - self.point);
        (8.0 * side / self.normal.abs().dot(cell)).clamp(LEAST_SHARE, 1.0)
    }
}

/// The eight hints around a point: the cell coordinates of the lowest, and the trilinear weights of the next along each axis.
fn corners(volume: &Volume, q: Vec3) -> (UVec3, Vec3) {
    let last = volume.resolution.as_vec3() - 1.0;
    let g = ((q - volume.origin) / volume.cell - 0.5).clamp(Vec3::ZERO, last);
    let lowest = g.floor().min((last - 1.0).max(Vec3::ZERO));
    (lowest.as_uvec3(), g - lowest)
}

/// The weight of a volume at a point: 0 outside, 1 from a cell within its border on.
fn inside(volume: &Volume, q: Vec3) -> f32 {
    let t = (q - volume.origin) / volume.cell;
    let border = t.min(volume.resolution.as_vec3() - t);
    border.min_element().clamp(0.0, 1.0)
}

/// Calls `f(hint, position, weight)` for the up to eight hints around a point in a volume.
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

/// Calls `f(volume, weight)` for the volumes that are blended at a point; the weights add up to 1.
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

/// The hint whose cell holds `q`, in the first volume that has at least half of the weight there; outside of all, the
/// nearest of the last.
#[must_use]
pub fn nearest_hint(lattice: &Lattice, q: Vec3) -> u32 {
    let volumes = lattice.volumes();
    let last = volumes.len() - 1;
    let i = volumes.iter().position(|v| inside(v, q) >= 0.5).unwrap_or(last);
    let volume = &volumes[i];
    let end = volume.resolution.as_vec3() - 1.0;
    let place = ((q - volume.origin) / volume.cell).floor().clamp(Vec3::ZERO, end).as_uvec3();
    volume.first + (place.z * volume.resolution.y + place.y) * volume.resolution.x + place.x
}

impl Field<'_> {
    /// Diagonal of a cell at `q`, metres, blended as the field is.
    #[must_use]
    pub fn diagonal(&self, q: Vec3) -> f32 {
        let mut diagonal = 0.0;
        blend(self.lattice, q, |volume, weight| diagonal += volume.cell.length() * weight);
        diagonal
    }

    /// The field of one hint, weighed coefficient by coefficient: `Σ L_lm w_lm`.
    #[must_use]
    pub fn weigh_hint(&self, hint: u32, w: &[f32; 9]) -> Vec3 {
        let vectors = self.order.vectors() as usize;
        let c = &self.hints[hint as usize * vectors..][..vectors];
        let low = Vec4::new(w[0], w[1], w[2], w[3]);
        let mut value = Vec3::new(c[0].dot(low), c[1].dot(low), c[2].dot(low));
        if let [_, _, _, r, g, b, last] = c {
            let high = Vec4::new(w[4], w[5], w[6], w[7]);
            value += Vec3::new(r.dot(high), g.dot(high), b.dot(high)) + last.truncate() * w[8];
        }
        value
    }

    /// The field at `q`, weighed coefficient by coefficient: `Σ L_lm(q) w_lm`. With the lobe of a clamped cosine, irradiance.
    #[must_use]
    pub fn weigh(&self, q: Vec3, plane: &Plane, w: &[f32; 9]) -> (Vec3, f32) {
        let (mut result, mut height) = (Vec3::ZERO, 0.0);
        blend(self.lattice, q, |volume, weight| {
            let (mut sum, mut total, mut side) = (Vec3::ZERO, 0.0, 0.0);
            around(volume, q, |hint, position, share| {
                let share = share * plane.share(position, volume.cell);
                side += plane.normal.dot(position - plane.point) * share;
                sum += self.weigh_hint(hint, w) * share;
                total += share;
            });
            result += sum * (weight / total);
            height += side * (weight / total);
        });
        (result, height)
    }
}
