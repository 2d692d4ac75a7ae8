//! `upsample`: irradiance at every pixel from that at one of 2 × 2 or 4 × 4 (Radiance Hints §9.3).

use glam::Vec3;
use indirect_core::GBuffer;
use indirect_filter::{Reduced, cpu::bilateral};
use rayon::prelude::*;

use super::{field::Field, reconstruct::irradiance};
use crate::settings::Reconstruction;

/// Sum of the bilateral weights below which a pixel is not interpolated: it reads the field itself.
pub(crate) const LEAST_WEIGHT: f32 = 0.05;

/// Irradiance per pixel, W/m², from `low`, that per texel which [`reconstruct`](super::reconstruct) makes.
///
/// A joint bilateral filter over the four nearest texels ([`bilateral`]). A pixel whose surface none of them shows, at an
/// edge or on a thin object, reads the field itself.
#[must_use]
pub fn upsample(
    field: &Field<'_>,
    camera: &GBuffer,
    reduced: &Reduced,
    low: &[Vec3],
    form: Reconstruction,
) -> Vec<Vec3> {
    (0..camera.len() as u32)
        .into_par_iter()
        .map(|i| upsample_pixel(field, camera, reduced, low, form, i))
        .collect()
}

fn upsample_pixel(
    field: &Field<'_>,
    camera: &GBuffer,
    reduced: &Reduced,
    low: &[Vec3],
    form: Reconstruction,
    i: u32,
) -> Vec3 {
    if !camera.is_surface(i as usize) {
        return Vec3::ZERO;
    }
    let (sum, total) = bilateral(camera, reduced, low, i);
    if total < LEAST_WEIGHT {
        return irradiance(field, camera.position[i as usize], camera.normal[i as usize], form);
    }
    sum * (1.0 / total)
}
