//! `reconstruct`: the irradiance that the field casts on pixels.
//!
//! ```text
//! E(q) = Σ_lm A_l L_lm(q) Y_lm(n)
//! ```
//!
//! at points `q` in front of the surface (`A_l` as `docs/errata.md`, Radiance Hints eq. 6–7). As printed (§5) there are
//! four, on a hemisphere, the first above the pixel, the others on a ring 80° from the normal, and the result is their mean:
//! that of a point about a diagonal of a cell away from the surface. By default four lie close around the pixel and one
//! about two cells in front of it; with the mean distances `s₁ < s₂` of the hints that either read from,
//!
//! ```text
//! E = E₁ + (E₁ − E₂) · min(s₁/(s₂ − s₁), g)
//! ```
//!
//! is exact for fields that change linearly along the normal. `g` bounds the amplification of noise.

use glam::Vec3;
use indirect_core::{GBuffer, math::orthonormal_basis};
use indirect_filter::Reduced;
use rayon::prelude::*;

use super::field::{Field, Plane, cosine_lobe};
use crate::settings::Reconstruction;

/// Sine and cosine of 80°.
const RING: (f32, f32) = (0.984_807_7, 0.173_648_18);
/// Sine and cosine of 120°.
const TURN: (f32, f32) = (0.866_025_4, -0.5);
/// Near the surface: radius and height of the ring and height of the far point, in diagonals of a cell, and the bound `g` of
/// the extrapolation. Chosen by measurement on the Cornell box.
pub(crate) const NEAR_RADIUS: f32 = 0.3;
pub(crate) const NEAR_LIFT: f32 = 0.08;
pub(crate) const FAR_LIFT: f32 = 1.1;
pub(crate) const MOST_GAIN: f32 = 0.2;

/// Irradiance on the point `p` with the unit normal `n`, W/m².
#[must_use]
pub fn irradiance(field: &Field<'_>, p: Vec3, n: Vec3, form: Reconstruction) -> Vec3 {
    let diagonal = field.diagonal(p);
    let lobe = cosine_lobe(n);
    let (t, b) = orthonormal_basis(n);
    // A truncated series may fall below 0 where little light arrives.
    match form {
        Reconstruction::NearSurface => {
            let plane = Plane { point: p, normal: n, strength: 1.0 };
            // Not in the plane itself: where it passes through a layer of hints, the next layer must already have weight.
            let base = p + n * (NEAR_LIFT * diagonal);
            let (mut near, mut s1) = (Vec3::ZERO, 0.0);
            for d in [t, b, -t, -b] {
                let (e, s) = field.weigh(base + d * (NEAR_RADIUS * diagonal), &plane, &lobe);
                near += e;
                s1 += s;
            }
            let (near, s1) = (near * 0.25, s1 * 0.25);
            let (far, s2) = field.weigh(p + n * (FAR_LIFT * diagonal), &plane, &lobe);
            let gap = (s2 - s1).max(s1 * (1.0 / MOST_GAIN));
            let gain = if s1 > 0.0 { s1 / gap } else { 0.0 };
            (near + (near - far) * gain).max(Vec3::ZERO)
        }
        Reconstruction::AsPrinted => {
            let base = p + n * (0.5 * diagonal);
            let mut sum = field.weigh(base + n * diagonal, &Plane::NONE, &lobe).0;
            for d in [t, t * TURN.1 + b * TURN.0, t * TURN.1 - b * TURN.0] {
                let q = base + (d * RING.0 + n * RING.1) * diagonal;
                sum += field.weigh(q, &Plane::NONE, &lobe).0;
            }
            (sum * 0.25).max(Vec3::ZERO)
        }
    }
}

/// Irradiance per texel of the smaller image of `reduced`, W/m², at the pixels that its texels sample; 0 where the camera sees
/// nothing.
#[must_use]
pub fn reconstruct(
    field: &Field<'_>,
    camera: &GBuffer,
    reduced: &Reduced,
    form: Reconstruction,
) -> Vec<Vec3> {
    (0..reduced.texels())
        .into_par_iter()
        .map(|i| {
            let pixel = reduced.pixel_of([i % reduced.small[0], i / reduced.small[0]]) as usize;
            if !camera.is_surface(pixel) {
                return Vec3::ZERO;
            }
            irradiance(field, camera.position[pixel], camera.normal[pixel], form)
        })
        .collect()
}
