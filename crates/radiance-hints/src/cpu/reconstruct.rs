//! `reconstruct`: irradiance of pixels from the field.

use glam::Vec3;
use indirect_core::{GBuffer, math::orthonormal_basis};
use rayon::prelude::*;

use super::{bounce::cosine_lobe, field::{Field, Plane}};
use crate::Reconstruction;

/// Places of the field that a pixel reads.
pub const READS: usize = 4;

/// Irradiance on a point.
#[must_use]
pub fn irradiance(field: &Field<'_>, p: Vec3, n: Vec3, form: Reconstruction) -> Vec3 {
    let (radius, lift, strength) = match form {
        Reconstruction::NearSurface => {
            let g = |k: &str, d: f32| std::env::var(k).ok().and_then(|s| s.parse().ok()).unwrap_or(d);
            (g("RH_RADIUS", 0.25), g("RH_LIFT", 0.25), 1.0)
        }
        Reconstruction::AsPrinted => (1.0, 0.5, 0.0),
    };
    let cell = field.lattice.volumes()[0].cell;
    let diagonal = cell.length();
    let (t, b) = orthonormal_basis(n);
    let (sin80, cos80) = (0.984_807_75, 0.173_648_18);
    let (s60, c60) = (0.866_025_4, 0.5);
    let lobe = cosine_lobe(n);
    let plane = Plane { point: p, normal: n, strength };
    let base = p + n * (lift * diagonal);
    let ring = [t, t * -c60 + b * s60, t * -c60 - b * s60];
    let mut sum = field.weigh(base + n * (radius * diagonal), &plane, &lobe);
    for r in ring {
        sum += field.weigh(base + (r * sin80 + n * cos80) * (radius * diagonal), &plane, &lobe);
    }
    (sum * (1.0 / READS as f32)).max(Vec3::ZERO)
}

/// All pixels.
#[must_use]
pub fn reconstruct(field: &Field<'_>, camera: &GBuffer, form: Reconstruction) -> Vec<Vec3> {
    (0..camera.len())
        .into_par_iter()
        .map(|i| {
            if camera.is_surface(i) { irradiance(field, camera.position[i], camera.normal[i], form) } else { Vec3::ZERO }
        })
        .collect()
}
