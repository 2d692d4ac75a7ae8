//! `bounce`: what hints receive from each other, for the second and every later bounce.
//!
//! ```text
//! L⁽ᵏ⁾ = L⁽¹⁾ + T L⁽ᵏ⁻¹⁾
//! (T L)_lm = 4π · Σ_j w_j ρ_j/π · E_j(−ω_j) Y_lm(ω_j) / Σ_j w_j
//! ```
//!
//! `E_j(−ω_j)` is the irradiance at point `j`, in direction `ω_j`, on a surface that faces the hint: that of the hint in
//! whose cell it lies, without interpolation, since the sum over points averages already. Each operator maps a uniform field
//! `L` to `ρL`, so that the bounces of a closed uniform room add up to `Σρⁱ` (`docs/errata.md`, Radiance Hints eq. 8 to 10,
//! which also describes what the printed form does).

use core::f32::consts::{FRAC_1_PI, PI};

use glam::{Vec3, Vec4};
use indirect_sampling::{
    mapping,
    rng::{hash_combine, unit_f32},
    sobol,
};
use rayon::prelude::*;
use sh_math::twins::sh_basis_l2;

use super::{
    directions::{Directions, OPEN, bounce_seed, half_cell},
    field::{Field, cosine_lobe, nearest_hint, pack},
};
use crate::{
    layout::Surroundings,
    settings::{Transport, words_of_stops},
};

/// Points along a direction, from the border inwards, at which [`Transport::Directions`] tries to find a hint that sees a lit
/// surface.
pub(crate) const PLACES: u32 = 4;

/// The hints after bounce `number`, from `first`, those after the first bounce, and `last`, those after the one before.
/// `surroundings` are those of the estimate, `stops` the words of [`stops`](super::stops), or none.
#[must_use]
pub fn bounce(
    last: &Field<'_>,
    first: &[Vec4],
    surroundings: &[Surroundings],
    stops: &[u32],
    directions: &Directions,
    transport: Transport,
    number: u32,
) -> Vec<Vec4> {
    let vectors = last.order.vectors() as usize;
    let source = Source { field: *last, surroundings, stops, directions };
    let base = if transport == Transport::SphereAsPrinted { last.hints } else { first };
    let mut next = vec![Vec4::ZERO; base.len()];
    next.par_chunks_exact_mut(vectors).zip(base.par_chunks_exact(vectors)).enumerate().for_each(
        |(hint, (next, base))| {
            let sh = match transport {
                Transport::Directions => source.directions(hint as u32),
                Transport::Sphere => source.sphere(hint as u32, number, false),
                Transport::SphereAsPrinted => source.sphere(hint as u32, number, true),
            };
            for ((next, base), more) in next.iter_mut().zip(base).zip(pack(&sh)) {
                *next = *base + more;
            }
        },
    );
    next
}

struct Source<'a> {
    field: Field<'a>,
    surroundings: &'a [Surroundings],
    stops: &'a [u32],
    directions: &'a Directions,
}

impl Source<'_> {
    /// [`Transport::Directions`].
    fn directions(&self, hint: u32) -> [Vec3; 9] {
        let (lattice, directions) = (self.field.lattice, self.directions);
        let position = lattice.position(hint);
        let mut sh = [Vec3::ZERO; 9];
        for j in 0..directions.count {
            let w = directions.direction(j);
            let (mut farthest, face) = directions.border(lattice, hint, position, w);
            let stop = stop_of(self.stops, hint, j, words_of_stops(directions.count));
            if stop != OPEN {
                let half = half_cell(lattice.room(hint), w);
                farthest = (farthest * (stop as f32 / OPEN as f32) - half).max(0.0);
            }
            // From there inwards, until a hint sees a lit surface: others are within objects or outside of the room.
            let mut radiance = Vec3::ZERO;
            for i in 0..PLACES {
                let q = position + w * (farthest * (1.0 - i as f32 / PLACES as f32));
                let other = nearest_hint(lattice, q);
                let around = &self.surroundings[other as usize];
                if around.r_max > 0.0 {
                    let albedo = match &directions.enclosure {
                        Some(enclosure) if stop == OPEN => enclosure.albedo[face],
                        _ => Vec3::from(around.albedo),
                    };
                    radiance = self.radiance(other, w, albedo);
                    break;
                }
            }
            for (c, y) in sh.iter_mut().zip(sh_basis_l2(w)) {
                *c += radiance * y;
            }
        }
        let scale = 4.0 * PI / directions.count as f32;
        sh.map(|c| c * scale)
    }

    /// [`Transport::Sphere`], and [`Transport::SphereAsPrinted`].
    fn sphere(&self, hint: u32, number: u32, printed: bool) -> [Vec3; 9] {
        let (lattice, directions) = (self.field.lattice, self.directions);
        let (position, volume) = (lattice.position(hint), lattice.room(hint));
        let extent = volume.extent();
        let reach = directions.range * extent.length();
        let own = &self.surroundings[hint as usize];
        let key = hash_combine(bounce_seed(directions.seed, number), hint);
        let mut sh = [Vec3::ZERO; 9];
        let (mut weights, mut visible, mut confident) = (0.0, 0.0, 0.0);
        for j in 0..directions.count {
            let w = mapping::sphere_uniform(sobol::sample_2d(j, key));
            // The largest of three even numbers has the density 3r² of the radius in a ball.
            let u = |i: u32| unit_f32(hash_combine(key, 3 * j + i));
            let r = u(0).max(u(1)).max(u(2)) * reach;
            let q = position + w * r;
            let t = q - volume.origin;
            if t.cmplt(Vec3::ZERO).any() || t.cmpgt(extent).any() {
                continue;
            }
            let other = nearest_hint(lattice, q);
            let around = &self.surroundings[other as usize];
            let v = visibility(r, own.r_min + around.r_min, own.r_max + around.r_max);
            let c = (1.0 - around.r_min / reach).max(0.0);
            let albedo = if printed { Vec3::ONE } else { Vec3::from(around.albedo) };
            let radiance = self.radiance(other, w, albedo) * (v * c);
            for (s, y) in sh.iter_mut().zip(sh_basis_l2(w)) {
                *s += radiance * y;
            }
            weights += v * c;
            visible += v;
            confident += c;
        }
        let total = if printed { visible * confident } else { weights };
        let scale = if total > 0.0 { 4.0 * PI / total } else { 0.0 };
        sh.map(|c| c * scale)
    }

    /// The radiance, W/(sr·m²), that a surface of this albedo at the position of a hint reflects towards `−w`.
    fn radiance(&self, hint: u32, w: Vec3, albedo: Vec3) -> Vec3 {
        let irradiance = self.field.weigh_hint(hint, &cosine_lobe(-w));
        albedo * FRAC_1_PI * irradiance.max(Vec3::ZERO)
    }
}

/// Eq. 11: 1 below the sum of the least distances, 0 beyond that of the greatest, linear between; a step where both are the
/// same (one sample, or none).
#[must_use]
pub fn visibility(d: f32, near: f32, far: f32) -> f32 {
    if far > near {
        1.0 - ((d - near) / (far - near)).clamp(0.0, 1.0)
    } else if d <= near {
        1.0
    } else {
        0.0
    }
}

/// The quantised hit distance of direction `j`; [`OPEN`] where nothing was tested.
fn stop_of(stops: &[u32], hint: u32, j: u32, per_hint: u32) -> u32 {
    if stops.is_empty() {
        return OPEN;
    }
    stops[(hint * per_hint + j / 4) as usize] >> (8 * (j % 4)) & 255
}
