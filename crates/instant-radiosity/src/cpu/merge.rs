//! `merge`: the pixels of a block put together, and with the frame before (thesis §3.4.1 and §3.5).
//!
//! A box filter of interleave² pixels, which meets every part once, leaves out neighbours of another surface. What it gives is blended
//! with what the surface had in the frame before, by a confidence (equations 3.1 to 3.6). Two things are added to the thesis, both
//! from what the filter knows already: a history of `m` frames counts `m/(m + 1)` at most, so that young ones are plain means; and the
//! past is brought back to within `outliers` standard errors of the filter's mean, estimated from the spread of its pixels, so
//! that it follows a change of light that noise cannot explain.

use glam::{Vec2, Vec3, Vec4};
use indirect_core::{GBuffer, View, math::luminance};
use indirect_filter::cpu::DEPTH_TOLERANCE;
use rayon::prelude::*;

use crate::settings::Params;

/// What a frame leaves to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct History {
    /// The frame's camera.
    pub view: View,
    /// Width and height, pixels; need not be those of the next frame.
    pub size: [u32; 2],
    /// Per pixel, irradiance, W/m², and view depth, metres; 0 where the camera saw nothing.
    pub irradiance: Vec<Vec4>,
    /// Per pixel, unit normal, and frames that its irradiance is the mean of.
    pub normals: Vec<Vec4>,
}

/// Irradiance per pixel with view depth, and normals with the number of frames, in the form of a [`History`].
///
/// `gathered` is the irradiance of each pixel's part, and a number that is not read; `before`, where a pixel's surface was in the frame before, metres, or its present
/// place where that is empty: nothing moved.
#[must_use]
pub fn merge(
    gathered: &[Vec4],
    (view, camera): (&View, &GBuffer),
    interleave: u32,
    params: &Params,
    past: Option<&History>,
    before: &[Vec3],
) -> History {
    let past = past.filter(|h| h.irradiance.len() == h.size[0] as usize * h.size[1] as usize);
    let pixel = |i: usize| {
        if !camera.is_surface(i) {
            return (Vec4::ZERO, Vec4::ZERO);
        }
        let now = filter(gathered, camera, i as u32, interleave, params);
        let p = before.get(i).copied().unwrap_or(camera.position[i]);
        let here =
            Vec2::new((i as u32 % camera.size[0]) as f32 + 0.5, (i as u32 / camera.size[0]) as f32 + 0.5)
                / Vec2::new(camera.size[0] as f32, camera.size[1] as f32);
        let (e, frames) = match past {
            Some(past) => blend(&now, (here, p, camera.normal[i], camera.depth[i]), past, params),
            None => (now.mean, 1.0),
        };
        (e.extend(camera.depth[i]), camera.normal[i].extend(frames))
    };
    let pixels: Vec<_> = (0..camera.len()).into_par_iter().with_min_len(256).map(pixel).collect();
    let (irradiance, normals) = pixels.into_iter().unzip();
    History { view: *view, size: camera.size, irradiance, normals }
}

/// What the box filter finds.
struct Filtered {
    mean: Vec3,
    /// Standard error of the mean's luminance.
    error: f32,
}

fn filter(gathered: &[Vec4], camera: &GBuffer, i: u32, n: u32, params: &Params) -> Filtered {
    let [width, height] = camera.size;
    let (x, y) = (i % width, i / width);
    let (p, normal) = (camera.position[i as usize], camera.normal[i as usize]);
    let out = params.depth * camera.depth[i as usize];
    let (mut sum, mut squares, mut count) = (Vec3::ZERO, 0.0, 0.0);
    for dy in 0..n {
        for dx in 0..n {
            // Wraps around below 0, and is beyond the image then.
            let (qx, qy) = ((x + dx).wrapping_sub(n / 2), (y + dy).wrapping_sub(n / 2));
            if qx >= width || qy >= height {
                continue;
            }
            let q = (qy * width + qx) as usize;
            let same = camera.is_surface(q)
                && normal.dot(camera.position[q] - p).abs() <= out
                && normal.dot(camera.normal[q]) >= params.normal;
            if same {
                let e = gathered[q].truncate();
                sum += e;
                let l = luminance(e);
                squares += l * l;
                count += 1.0;
            }
        }
    }
    // β above 1, or a normal that is not quite unit: the pixel alone.
    if count == 0.0 {
        return Filtered { mean: gathered[i as usize].truncate(), error: f32::MAX };
    }
    let mean = sum * (1.0 / count);
    let l = luminance(mean);
    let variance = (squares / count - l * l).max(0.0) / (count - 1.0).max(1.0);
    // A single pixel has no spread, and says nothing against the past.
    Filtered { mean, error: if count > 1.0 { variance.sqrt() } else { f32::MAX } }
}

fn blend(
    now: &Filtered,
    (here, p, n, depth): (Vec2, Vec3, Vec3, f32),
    past: &History,
    params: &Params,
) -> (Vec3, f32) {
    let alone = (now.mean, 1.0);
    let History { view, size: [width, height], irradiance, normals } = past;
    let Some(at) = view.image_point(p) else { return alone };
    let expected = view.forward.dot(p - view.origin);
    let (x, y) = (at.x * *width as f32 - 0.5, at.y * *height as f32 - 0.5);
    let (x0, y0) = (x.floor(), y.floor());
    let (tx, ty) = (x - x0, y - y0);
    let (mut sum, mut before, mut total) = (Vec4::ZERO, Vec4::ZERO, 0.0);
    for corner in 0..4_u32 {
        let (right, below) = ((corner & 1) as f32, (corner >> 1) as f32);
        let (a, b) = (x0 + right, y0 + below);
        if !(a >= 0.0 && b >= 0.0 && a < *width as f32 && b < *height as f32) {
            continue;
        }
        let k = b as usize * *width as usize + a as usize;
        let seen = irradiance[k];
        if (seen.w - expected).abs() <= DEPTH_TOLERANCE * expected.abs()
            && seen.is_finite()
            && normals[k].truncate().dot(n) >= params.normal
        {
            let weight = (1.0 - (tx - right).abs()) * (1.0 - (ty - below).abs());
            sum += seen * weight;
            before += normals[k] * weight;
            total += weight;
        }
    }
    if total <= 0.0 {
        return alone;
    }
    let (mut earlier, before) = (sum * (1.0 / total), before * (1.0 / total));
    let (new, old) = (luminance(now.mean), luminance(earlier.truncate()));
    // Back to what the present pixels' spread allows.
    let most = params.outliers * now.error;
    if params.outliers > 0.0 && (old - new).abs() > most {
        let share = most / (old - new).abs();
        earlier = (now.mean + (earlier.truncate() - now.mean) * share).extend(earlier.w);
    }
    // Equations 3.1 to 3.4, the light's change relative to the light.
    let way = Vec3::new(here.x - at.x, here.y - at.y, (depth - earlier.w) / depth.max(f32::MIN_POSITIVE));
    let moved = way.length() * params.moved;
    let turned = (1.0 - n.dot(before.truncate())) * params.turned;
    let change = (new - old).abs() / new.max(old).max(f32::MIN_POSITIVE);
    let changed = (change * change * change).min(1.0) * params.changed;
    let confidence = params.confidence * (1.0 - moved.max(turned).max(changed)).clamp(0.0, 1.0);
    let share = confidence.min(before.w / (before.w + 1.0)) * total;
    (now.mean + (earlier.truncate() - now.mean) * share, 1.0 / (1.0 - share).max(1e-3))
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    #[test]
    fn the_tolerance_is_that_of_the_shader() {
        use indirect_gpu::shaders::INSTANT_RADIOSITY_MERGE;
        testkit::layout::check_constant(&INSTANT_RADIOSITY_MERGE, "DEPTH_TOLERANCE", super::DEPTH_TOLERANCE)
            .unwrap();
    }
}
