//! `occlusion`: how much each sample is occluded from each hint, by depth images instead of geometry.
//!
//! Four bits per hint and sample, eight samples to a word: 0 for a visible sample, 15 for an occluded one, and `n` for `n`
//! points of the segment that are behind the depth image, each of which halves the light (Radiance Hints §8).

use glam::Vec3;
use indirect_core::{GBuffer, View};
use rayon::prelude::*;
use rsm::Rsm;

use super::{
    depths::{Depths, behind, crossing},
    look::{Looked, Samples, place_of, shift_of},
};
use crate::{
    settings::{Visibility, words_of_samples},
    volume::Lattice,
};

/// Points of a segment that are tested; §8 has 3 to 8.
pub(crate) const POINTS: u32 = 8;

/// The share of a sample's light that arrives, from its four bits.
#[must_use]
pub fn share_of_blocked(blocked: u32) -> f32 {
    if blocked == 15 { 0.0 } else { 1.0 / (1_u32 << blocked) as f32 }
}

/// The words of all hints; none for [`Visibility::Off`]. `camera` is the depth image of [`Visibility::CameraDepth`]; `jitter`
/// as in [`Params`](crate::Params).
#[must_use]
pub fn occlusion(
    rsm: &Rsm,
    camera: (&View, &GBuffer),
    lattice: &Lattice,
    samples: &Samples<'_>,
    visibility: Visibility,
    jitter: f32,
) -> Vec<u32> {
    let maps: Vec<_> = match visibility {
        Visibility::Off => return Vec::new(),
        Visibility::RsmDepth => Depths::of_maps(rsm),
        Visibility::CameraDepth => vec![Depths { view: camera.0, surface: camera.1 }],
    };
    let count = samples.draw.samples;
    let per_hint = words_of_samples(count);
    (0..lattice.hints() * per_hint)
        .into_par_iter()
        .map(|i| {
            let (hint, begin) = (i / per_hint, i % per_hint * 8);
            let (position, cell) = (lattice.position(hint), lattice.place(hint).0.cell);
            let looked = Looked::new(samples, lattice, hint);
            let shift = shift_of(samples.draw.seed, hint);
            let mut word = 0;
            for k in begin..(begin + 8).min(count) {
                let (s, scale) = looked.sample(k);
                let y = place_of(position, cell, jitter, shift, k);
                if s.area * scale <= 0.0 || s.normal.dot(y - s.position) <= 0.0 {
                    continue;
                }
                let blocked = match visibility {
                    Visibility::CameraDepth => hidden(&maps[0], s.position, y),
                    // The first point is near the surface that the sample lies on.
                    _ if maps.iter().any(|m| crossing(m, s.position, y, 1).is_some()) => 15,
                    _ => 0,
                };
                word |= blocked << (4 * (k - begin));
            }
            word
        })
        .collect()
}

/// How many points of the segment from `a` to `b` the view does not see.
fn hidden(depths: &Depths<'_>, a: Vec3, b: Vec3) -> u32 {
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
