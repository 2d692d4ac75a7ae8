//! `smooth`: a frame's irradiance blended with that of the frames before, by an exponential moving average along the
//! reprojected pixels (Papaioannou 2011, "Real-Time Diffuse Global Illumination Using Radiance Hints", §9.1, factor 0.5).

use glam::Vec3;
use indirect_core::{GBuffer, View};
use rayon::prelude::*;

/// How far the depth that the last frame saw may be from the one expected there, as a share of it.
pub const DEPTH_TOLERANCE: f32 = 0.02;

/// The frame before.
#[derive(Debug, Clone, Copy)]
pub struct Previous<'a> {
    /// Its camera.
    pub view: &'a View,
    /// Its width and height, pixels; need not be those of the present one. Arrays of another length are ignored.
    pub size: [u32; 2],
    /// View depth per pixel, metres; 0 where it saw nothing.
    pub depth: &'a [f32],
    /// Its smoothed irradiance, W/m².
    pub irradiance: &'a [Vec3],
}

/// `current` blended with what the frame before had at the same surface: `factor` is the share of the past, `[0, 1)`, 0.5 in
/// the paper. All irradiance in W/m².
///
/// Where a pixel's surface was outside of the last image, or behind what it saw there, or the past is not finite, the present
/// stands alone.
#[must_use]
pub fn smooth(current: &[Vec3], camera: &GBuffer, previous: &Previous<'_>, factor: f32) -> Vec<Vec3> {
    (0..camera.len()).into_par_iter().map(|i| smooth_pixel(current[i], camera, previous, factor, i)).collect()
}

fn smooth_pixel(current: Vec3, camera: &GBuffer, previous: &Previous<'_>, factor: f32, i: usize) -> Vec3 {
    if !camera.is_surface(i) {
        return Vec3::ZERO;
    }
    let [width, height] = previous.size;
    let pixels = width as usize * height as usize;
    if previous.depth.len() != pixels || previous.irradiance.len() != pixels {
        return current;
    }
    let p = camera.position[i];
    let Some(at) = previous.view.image_point(p) else { return current };
    let expected = previous.view.forward.dot(p - previous.view.origin);
    // Between the centres of four pixels.
    let (x, y) = (at.x * width as f32 - 0.5, at.y * height as f32 - 0.5);
    let (x0, y0) = (x.floor(), y.floor());
    let (tx, ty) = (x - x0, y - y0);
    let (mut sum, mut total) = (Vec3::ZERO, 0.0);
    for corner in 0..4_u32 {
        let (right, below) = ((corner & 1) as f32, (corner >> 1) as f32);
        let (a, b) = (x0 + right, y0 + below);
        if !(a >= 0.0 && b >= 0.0 && a < width as f32 && b < height as f32) {
            continue;
        }
        let k = b as usize * width as usize + a as usize;
        let past = previous.irradiance[k];
        if (previous.depth[k] - expected).abs() <= DEPTH_TOLERANCE * expected.abs() && past.is_finite() {
            let weight = (1.0 - (tx - right).abs()) * (1.0 - (ty - below).abs());
            sum += past * weight;
            total += weight;
        }
    }
    if total <= 0.0 { current } else { current + (sum * (1.0 / total) - current) * (factor * total) }
}
