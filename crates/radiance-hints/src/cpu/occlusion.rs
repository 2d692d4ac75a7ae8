//! `occlusion`: how much stands between each hint and each of its samples, without geometry.
//!
//! Four bits per hint and sample, eight samples to a word: 0 for nothing, 15 for everything, and `n` for `n` points of the
//! segment that are hidden, each of which halves the light (Radiance Hints §8).

use glam::{Vec2, Vec3};
use indirect_core::{GBuffer, View};
use rayon::prelude::*;
use rsm::Rsm;

use super::look::{Looked, Samples, place_of, plane_project, shift_of};
use crate::{Lattice, Options, Params, Visibility};

/// Points of a segment that are looked at.
const STEPS: u32 = 16;
/// Halvings of the step in which a segment went behind a surface.
const REFINEMENTS: u32 = 5;

/// Words of four bits for so many samples.
#[must_use]
pub const fn words(samples: u32) -> u32 {
    samples.div_ceil(8)
}

/// The share of a sample's light that four bits let pass.
#[must_use]
pub fn share_of_blocked(blocked: u32) -> f32 {
    if blocked == 15 { 0.0 } else { 1.0 / (1_u32 << blocked) as f32 }
}

/// A depth image and the view that it belongs to.
struct Depths<'a> {
    view: &'a View,
    surface: &'a GBuffer,
}

/// What stands between; no words for [`Visibility::Off`]. `camera` is what [`Visibility::CameraDepth`] looks at.
#[must_use]
pub fn occlusion(
    rsm: &Rsm,
    camera: (&View, &GBuffer),
    lattice: &Lattice,
    samples: &Samples<'_>,
    options: &Options,
    params: &Params,
) -> Vec<u32> {
    let maps: Vec<_> = match options.visibility {
        Visibility::Off => return Vec::new(),
        Visibility::RsmDepth => {
            rsm.maps.iter().map(|m| Depths { view: &m.view, surface: &m.surface }).collect()
        }
        Visibility::CameraDepth => vec![Depths { view: camera.0, surface: camera.1 }],
    };
    let per_hint = words(options.samples);
    (0..lattice.hints() * per_hint)
        .into_par_iter()
        .map(|i| {
            let (hint, begin) = (i / per_hint, i % per_hint * 8);
            let (position, cell) = (lattice.position(hint), lattice.place(hint).0.cell);
            let looked = Looked::new(samples, lattice, options, hint);
            let shift = shift_of(params.seed, hint);
            let mut word = 0;
            for k in begin..(begin + 8).min(options.samples) {
                let (s, scale) = looked.sample(k);
                let y = place_of(position, cell, params.jitter, shift, k);
                if s.area * scale <= 0.0 || s.normal.dot(y - s.position) <= 0.0 {
                    continue;
                }
                let blocked = match options.visibility {
                    Visibility::CameraDepth => hidden(&maps[0], s.position, y),
                    _ => maps.iter().map(|m| crossed(m, s.position, y)).max().unwrap_or(0),
                };
                word |= blocked << (4 * (k - begin));
            }
            word
        })
        .collect()
}

/// How far `p` lies behind what the view sees there, metres; negative before it, `None` outside of the image. Also the depth
/// of `p`.
fn behind(depths: &Depths<'_>, p: Vec3) -> Option<f32> {
    let at = plane_project(depths.view, p)?;
    let [width, height] = depths.surface.size;
    let texel = at * Vec2::new(width as f32, height as f32);
    if !(texel.x >= 0.0 && texel.y >= 0.0 && texel.x < width as f32 && texel.y < height as f32) {
        return None;
    }
    let i = texel.y as usize * width as usize + texel.x as usize;
    let depth = depths.view.forward.dot(p - depths.view.origin);
    Some(if depths.surface.is_surface(i) { depth - depths.surface.depth[i] } else { -depth })
}

/// 15 where the segment from `a`, on a surface, to `b` goes through a surface that the view sees; 0 where not.
fn crossed(depths: &Depths<'_>, a: Vec3, b: Vec3) -> u32 {
    let at = |t: f32| behind(depths, a + (b - a) * t);
    let length = (b - a).length();
    let step = 1.0 / STEPS as f32;
    // The first point is near the surface that the sample lies on.
    let mut before = at(step);
    for i in 2..=STEPS {
        let t = i as f32 * step;
        let now = at(t);
        if let (Some(x), Some(y)) = (before, now)
            && (x < 0.0) != (y < 0.0)
        {
            // Where it changes sides, more finely.
            let (mut lo, mut hi, mut x, mut y) = (t - step, t, x, y);
            for _ in 0..REFINEMENTS {
                let middle = 0.5 * (lo + hi);
                let Some(m) = at(middle) else { break };
                if (m < 0.0) == (x < 0.0) {
                    (lo, x) = (middle, m);
                } else {
                    (hi, y) = (middle, m);
                }
            }
            // On a surface both depths are as near to it as the rest of the step is long; at a silhouette they jump.
            if (y - x).abs() < 4.0 * (hi - lo) * length {
                return 15;
            }
        }
        before = now;
    }
    0
}

/// How many points of the segment from `a` to `b` the view does not see.
fn hidden(depths: &Depths<'_>, a: Vec3, b: Vec3) -> u32 {
    /// Points that §8 looks at: 3 to 8.
    const POINTS: u32 = 8;
    let mut count = 0;
    for i in 0..POINTS {
        let t = (i as f32 + 0.5) / POINTS as f32;
        let p = a + (b - a) * t;
        // Rounding: a point on a surface is not behind it.
        let slack = 1e-3 * (p - depths.view.origin).length();
        if behind(depths, p).is_some_and(|d| d > slack) {
            count += 1;
        }
    }
    count
}
