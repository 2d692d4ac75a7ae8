//! `smooth`: a frame's irradiance blended with that of the frames before, by an exponential moving average along the
//! reprojected pixels (Papaioannou 2011, "Real-Time Diffuse Global Illumination Using Radiance Hints", §9.1, factor 0.5).

use glam::{Vec3, Vec4};
use indirect_core::{GBuffer, View};
use rayon::prelude::*;

use crate::History;

/// How far the depth that the last frame saw may be from the one expected there, as a share of it.
pub const DEPTH_TOLERANCE: f32 = 0.02;

/// `current`, the irradiance of a frame in which `view` sees `camera`, blended with what the frame before had at the same
/// surface: `factor` is the share of the past, `[0, 1)`, 0.5 in the paper.
///
/// Where a pixel's surface was outside of the last image, or behind what it saw there, or the past is not finite, the present
/// stands alone; also where there is no past, or where its number of pixels is not that of its size.
#[must_use]
pub fn smooth(
    current: &[Vec3],
    (view, camera): (&View, &GBuffer),
    past: Option<&History>,
    factor: f32,
) -> History {
    let past = past.filter(|h| h.pixels.len() == h.size[0] as usize * h.size[1] as usize);
    let pixel = |i: usize| match past {
        _ if !camera.is_surface(i) => Vec3::ZERO,
        Some(past) => smooth_pixel(current[i], camera.position[i], past, factor),
        None => current[i],
    };
    let pixels = (0..camera.len()).into_par_iter().map(|i| pixel(i).extend(camera.depth[i])).collect();
    History { view: *view, size: camera.size, pixels }
}

fn smooth_pixel(current: Vec3, p: Vec3, past: &History, factor: f32) -> Vec3 {
    let History { view, size: [width, height], pixels } = past;
    let Some(at) = view.image_point(p) else { return current };
    let expected = view.forward.dot(p - view.origin);
    // Between the centres of four pixels.
    let (x, y) = (at.x * *width as f32 - 0.5, at.y * *height as f32 - 0.5);
    let (x0, y0) = (x.floor(), y.floor());
    let (tx, ty) = (x - x0, y - y0);
    let (mut sum, mut total) = (Vec3::ZERO, 0.0);
    for corner in 0..4_u32 {
        let (right, below) = ((corner & 1) as f32, (corner >> 1) as f32);
        let (a, b) = (x0 + right, y0 + below);
        if !(a >= 0.0 && b >= 0.0 && a < *width as f32 && b < *height as f32) {
            continue;
        }
        let seen: Vec4 = pixels[b as usize * *width as usize + a as usize];
        let before = seen.truncate();
        if (seen.w - expected).abs() <= DEPTH_TOLERANCE * expected.abs() && before.is_finite() {
            let weight = (1.0 - (tx - right).abs()) * (1.0 - (ty - below).abs());
            sum += before * weight;
            total += weight;
        }
    }
    if total <= 0.0 { current } else { current + (sum * (1.0 / total) - current) * (factor * total) }
}
