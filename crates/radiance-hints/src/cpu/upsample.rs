//! `upsample`: irradiance at every pixel from that at one of 2 × 2 or 4 × 4 (Radiance Hints §9.3).

use glam::Vec3;
use indirect_core::GBuffer;
use rayon::prelude::*;

use super::{
    field::Field,
    reconstruct::{irradiance, low_size, pixel_of},
};
use crate::{Params, Scale};

/// Total weight below which the neighbours say nothing about a pixel: it reads the field itself.
const LEAST_WEIGHT: f32 = 0.05;

/// Irradiance per pixel, W/m², from that per texel of [`reconstruct`](super::reconstruct) at the same scale.
///
/// A joint bilateral filter over the four nearest texels: a texel counts as far as its surface lies in the pixel's plane and
/// has its normal. A pixel that no texel speaks for, at an edge or on a thin thing, reads the field itself. Nothing depends
/// on the scene's scale: distances are compared with each other.
#[must_use]
pub fn upsample(
    field: &Field<'_>,
    camera: &GBuffer,
    low: &[Vec3],
    scale: Scale,
    params: &Params,
) -> Vec<Vec3> {
    if scale == Scale::Full {
        return low.to_vec();
    }
    let small = low_size(camera.size, scale);
    (0..camera.len() as u32)
        .into_par_iter()
        .map(|i| upsample_pixel(field, camera, low, small, scale.step(), i, params))
        .collect()
}

fn upsample_pixel(
    field: &Field<'_>,
    camera: &GBuffer,
    low: &[Vec3],
    small: [u32; 2],
    step: u32,
    i: u32,
    params: &Params,
) -> Vec3 {
    if !camera.is_surface(i as usize) {
        return Vec3::ZERO;
    }
    let (p, n) = (camera.position[i as usize], camera.normal[i as usize]);
    let [width, height] = camera.size;
    let place = |pixel: u32| ((pixel as f32 - (step / 2) as f32) / step as f32).max(0.0);
    let (x, y) = (place(i % width), place(i / width));
    let (x0, y0) = (x.floor(), y.floor());
    let (tx, ty) = (x - x0, y - y0);
    let (mut sum, mut total) = (Vec3::ZERO, 0.0);
    for corner in 0..4_u32 {
        let (right, below) = (corner & 1, corner >> 1);
        let a = (x0 as u32 + right).min(small[0] - 1);
        let b = (y0 as u32 + below).min(small[1] - 1);
        let at = (pixel_of(b, step, height) * width + pixel_of(a, step, width)) as usize;
        let m = camera.normal[at];
        let d = camera.position[at] - p;
        // How far it is out of the plane, as a share of its distance.
        let distance = d.dot(d).sqrt();
        let out = if distance > 0.0 { n.dot(d).abs() / distance } else { 0.0 };
        let alike = n.dot(m).max(0.0);
        let alike = alike * alike;
        let bilinear = (if right == 1 { tx } else { 1.0 - tx }) * (if below == 1 { ty } else { 1.0 - ty });
        let weight = bilinear * (1.0 - 4.0 * out).max(0.0) * (alike * alike);
        sum += low[(b * small[0] + a) as usize] * weight;
        total += weight;
    }
    if total < LEAST_WEIGHT { irradiance(field, p, n, params.reconstruction) } else { sum * (1.0 / total) }
}
