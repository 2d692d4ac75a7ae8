//! `estimate`: the radiance of the first bounce that arrives at each hint, as spherical harmonics.
//!
//! ```text
//! L_lm = Σ_k Φ_k cosθ_k / (π d_k² + a_k) · Y_lm(ω_k),   ω_k from y_k to the sample k
//! ```
//!
//! `Φ_k` is the flux that sample `k` reflects (`docs/errata.md`, Radiance Hints eq. 2–4), `cosθ_k` the cosine at its
//! surface, `y_k` a point in the hint's cell, `a_k` the share [`Params::footprint`](crate::Params::footprint) of the
//! sample's area, which bounds the radiance at a hint close to it.

use core::f32::consts::{FRAC_1_PI, PI};

use glam::{Vec3, Vec4};
use rayon::prelude::*;
use sh_math::twins::sh_basis_l2;

use super::{
    field::pack,
    look::{Looked, Samples, place_of, shift_of},
    occlusion::share_of_blocked,
};
use crate::{
    layout::Surroundings,
    settings::{Order, words_of_samples},
    volume::Lattice,
};

/// Least squared distance between a hint and a sample: where they coincide there is no direction, and the sample is left out.
pub(crate) const LEAST_D2: f32 = 1e-37;

/// The field after the first bounce, W/(sr·m²), and, for more than one bounce, the lit surfaces around each hint.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Estimate {
    /// [`Order::vectors`](crate::Order::vectors) vectors per hint, see [`pack`].
    pub hints: Vec<Vec4>,
    /// One per hint, or none.
    pub surroundings: Vec<Surroundings>,
}

/// Estimates all hints. `blocked` are the words of [`occlusion`](super::occlusion), none where there is no test; `jitter` and
/// `footprint` as in [`Params`](crate::Params). The surroundings are kept where `later` bounces follow.
#[must_use]
pub fn estimate(
    lattice: &Lattice,
    samples: &Samples<'_>,
    blocked: &[u32],
    order: Order,
    (jitter, footprint): (f32, f32),
    later: bool,
) -> Estimate {
    let found: Vec<_> = (0..lattice.hints())
        .into_par_iter()
        .map(|i| estimate_hint(lattice, i, samples, blocked, jitter, footprint))
        .collect();
    let vectors = order.vectors() as usize;
    let hints = found.iter().flat_map(|(sh, _)| pack(sh).into_iter().take(vectors)).collect();
    let surroundings = if later { found.iter().map(|(_, s)| *s).collect() } else { Vec::new() };
    Estimate { hints, surroundings }
}

fn estimate_hint(
    lattice: &Lattice,
    hint: u32,
    samples: &Samples<'_>,
    blocked: &[u32],
    jitter: f32,
    footprint: f32,
) -> ([Vec3; 9], Surroundings) {
    let count = samples.draw.samples;
    let (position, cell) = (lattice.position(hint), lattice.place(hint).0.cell);
    let looked = Looked::new(samples, lattice, hint);
    let shift = shift_of(samples.draw.seed, hint);
    let mut sh = [Vec3::ZERO; 9];
    let (mut r_min, mut r_max) = (f32::MAX, 0.0_f32);
    // Reflected and incident flux weighted as this hint sees it, and unweighted.
    let (mut seen, mut seen_incident) = (Vec3::ZERO, Vec3::ZERO);
    let (mut all, mut all_incident) = (Vec3::ZERO, Vec3::ZERO);
    for k in 0..count {
        let (s, scale) = looked.sample(k);
        let area = s.area * scale;
        let v = s.position - place_of(position, cell, jitter, shift, k);
        let d2 = v.dot(v);
        if d2 < LEAST_D2 || area <= 0.0 {
            continue;
        }
        let d = d2.sqrt();
        let w = v * (1.0 / d);
        let cosine = (-s.normal.dot(w)).max(0.0);
        let h = (d2 + area * footprint * FRAC_1_PI).sqrt();
        let weight = 2.0 * cosine / (PI * h * (h + d)) * open(blocked, hint, k, count);
        let c = d / h;
        let bands = [1.0, 0.5 * (1.0 + c), 0.5 * c * (1.0 + c)];
        let basis = sh_basis_l2(w);
        let (flux, incident) = (s.flux * scale, s.incident * scale);
        let radiance = flux * weight;
        for (i, (c, y)) in sh.iter_mut().zip(basis).enumerate() {
            *c += radiance * (y * bands[sh_math::band(i)]);
        }
        if weight > 0.0 {
            r_min = r_min.min(d);
            r_max = r_max.max(d);
        }
        seen += radiance;
        seen_incident += incident * weight;
        all += flux;
        all_incident += incident;
    }
    let share = |a: f32, b: f32, c: f32, d: f32| {
        if b > 0.0 {
            (a / b).min(1.0)
        } else if d > 0.0 {
            (c / d).min(1.0)
        } else {
            0.0
        }
    };
    let albedo = core::array::from_fn(|c| share(seen[c], seen_incident[c], all[c], all_incident[c]));
    let r_min = if r_max > 0.0 { r_min } else { 0.0 };
    (sh, Surroundings { albedo, r_min, r_max })
}

/// The share of a sample's light that arrives; see [`occlusion`](super::occlusion).
fn open(blocked: &[u32], hint: u32, k: u32, samples: u32) -> f32 {
    if blocked.is_empty() {
        return 1.0;
    }
    let word = blocked[(hint * words_of_samples(samples) + k / 8) as usize];
    share_of_blocked(word >> (4 * (k % 8)) & 15)
}
