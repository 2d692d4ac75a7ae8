//! `bounce`: the light that hints receive from each other, once more.
use core::f32::consts::{FRAC_1_PI, PI};

use glam::{Vec2, Vec3};
use indirect_sampling::{mapping, rng::hash_combine, sobol};
use rayon::prelude::*;
use sh_math::twins::sh_basis_l2;

use super::field::{Field, Plane, surroundings_at};
use crate::{Lattice, Options, Params, Surroundings, Transport};

/// Places along a direction that [`Transport::Directions`] looks at.
pub const PLACES: u32 = 4;

/// `A_l` of the clamped cosine, per coefficient.
pub(super) const COSINE: [f32; 9] = {
    let (a0, a1, a2) = (PI, 2.094_395_2, 0.785_398_2);
    [a0, a1, a1, a1, a2, a2, a2, a2, a2]
};

/// The clamped cosine about `n`.
pub(super) fn cosine_lobe(n: Vec3) -> [f32; 9] {
    let basis = sh_basis_l2(n);
    core::array::from_fn(|i| COSINE[i] * basis[i])
}

/// One more bounce.
#[must_use]
pub fn bounce(
    lattice: &Lattice,
    first: &[f32],
    last: &[f32],
    surroundings: &[Surroundings],
    number: u32,
    options: &Options,
    params: &Params,
) -> Vec<f32> {
    let field = Field { lattice, order: options.order, hints: last };
    let coefficients = options.order.coefficients() as usize;
    let source = if params.transport == Transport::SphereAsPrinted { last } else { first };
    let seed = hash_combine(params.seed, number);
    (0..lattice.hints())
        .into_par_iter()
        .flat_map_iter(|hint| {
            let sh = match params.transport {
                Transport::Directions => directions(&field, surroundings, hint, seed, options, params),
                Transport::Sphere => sphere(&field, surroundings, hint, seed, options, params, false),
                Transport::SphereAsPrinted => sphere(&field, surroundings, hint, seed, options, params, true),
            };
            let begin = hint as usize * coefficients * 3;
            let before = &source[begin..begin + coefficients * 3];
            let after: Vec<f32> = sh[..coefficients]
                .iter()
                .zip(before.chunks_exact(3))
                .flat_map(|(c, b)| [b[0] + c.x, b[1] + c.y, b[2] + c.z])
                .collect();
            after
        })
        .collect()
}

fn visible(d: f32, near: f32, far: f32) -> f32 {
    if far > near { 1.0 - ((d - near) / (far - near)).clamp(0.0, 1.0) } else if d <= near { 1.0 } else { 0.0 }
}

fn exit(volume: &crate::Volume, p: Vec3, w: Vec3) -> f32 {
    let hi = volume.origin + volume.cell * volume.resolution.as_vec3();
    let mut t = f32::MAX;
    for a in 0..3 {
        if w[a] > 0.0 { t = t.min((hi[a] - p[a]) / w[a]) } else if w[a] < 0.0 { t = t.min((volume.origin[a] - p[a]) / w[a]) }
    }
    t.max(0.0)
}

fn directions(
    field: &Field<'_>, surroundings: &[Surroundings], hint: u32, seed: u32, options: &Options, params: &Params,
) -> [Vec3; 9] {
    let lattice = field.lattice;
    let position = lattice.position(hint);
    let volume = lattice.place(hint).0;
    let _s = surroundings[hint as usize];
    let mut sh = [Vec3::ZERO; 9];
    let key = hash_combine(seed, hint);
    let mode: u32 = std::env::var("RH_MODE").ok().and_then(|s| s.parse().ok()).unwrap_or(0);
    for j in 0..options.bounce_samples {
        let w = mapping::sphere_uniform(sobol::sample_2d(j, key));
        let t = exit(volume, position, w);
        let basis = sh_basis_l2(w);
        let lobe = cosine_lobe(-w);
        let mut value = Vec3::ZERO;
        if mode == 0 {
            let q = position + w * t;
            let (albedo, _, _) = surroundings_at(lattice, surroundings, q);
            value = albedo * FRAC_1_PI * field.weigh(q, &Plane::NONE, &lobe).max(Vec3::ZERO);
        } else {
            let mut total = 0.0;
            for i in 0..PLACES {
                let u = (i as f32 + sobol::sample_1d(j * PLACES + i, key ^ 5)) / PLACES as f32;
                let q = position + w * (t * u);
                let (albedo, r_min, _r_max) = surroundings_at(lattice, surroundings, q);
                let diag = (volume.cell * volume.resolution.as_vec3()).length() * params.range;
                let c = (1.0 - r_min / diag).max(0.0);
                let c = if mode == 2 { c.powi(8) } else { c };
                total += c;
                value += albedo * FRAC_1_PI * field.weigh(q, &Plane::NONE, &lobe).max(Vec3::ZERO) * c;
            }
            if total > 0.0 { value /= total; }
        }
        for (c, y) in sh.iter_mut().zip(basis) {
            *c += value * y;
        }
    }
    let scale = 4.0 * PI / options.bounce_samples as f32;
    sh.map(|c| c * scale)
}

fn sphere(
    field: &Field<'_>, surroundings: &[Surroundings], hint: u32, seed: u32, options: &Options, params: &Params, printed: bool,
) -> [Vec3; 9] {
    let lattice = field.lattice;
    let position = lattice.position(hint);
    let volume = lattice.place(hint).0;
    let own = surroundings[hint as usize];
    let extent = volume.cell * volume.resolution.as_vec3();
    let radius = extent.length() * params.range;
    let key = hash_combine(seed, hint);
    let mut sh = [Vec3::ZERO; 9];
    let (mut vw, mut v_sum, mut c_sum) = (0.0, 0.0, 0.0);
    for j in 0..options.bounce_samples {
        let w = mapping::sphere_uniform(sobol::sample_2d(j, key));
        let r = radius * sobol::sample_1d(j, key ^ 77).cbrt();
        let q = position + w * r;
        let lo = volume.origin; let hi = volume.origin + extent;
        if q.cmplt(lo).any() || q.cmpgt(hi).any() { continue; }
        let (albedo, r_min, r_max) = surroundings_at(lattice, surroundings, q);
        let v = visible(r, own.r_min + r_min, own.r_max + r_max);
        let c = (1.0 - r_min / radius).max(0.0);
        let rho = if printed { Vec3::ONE } else { albedo };
        let value = rho * FRAC_1_PI * field.weigh(q, &Plane::NONE, &cosine_lobe(-w)).max(Vec3::ZERO);
        vw += v * c; v_sum += v; c_sum += c;
        for (s, y) in sh.iter_mut().zip(sh_basis_l2(w)) { *s += value * y * (v * c); }
    }
    let denom = if printed { v_sum * c_sum } else { vw };
    let scale = if denom > 0.0 { 4.0 * PI / denom } else { 0.0 };
    sh.map(|c| c * scale)
}
#[allow(dead_code)]
fn _unused(_: Vec2) {}
