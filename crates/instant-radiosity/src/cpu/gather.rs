//! `gather`: the irradiance that a pixel's part of the virtual lights casts on it, interleaved (Keller & Heidrich 2001, "Interleaved
//! Sampling"; thesis §3.4.1).
//!
//! ```text
//! E_i = n² Σ_j Φ_j V_ij k/(1 + A k),   k = cosθ_i cosθ_j/(π d²),   j in the part of pixel i
//! ```
//!
//! A pixel of an n×n block takes one of n² parts, which is a run of each bounce's virtual lights: runs of a low-discrepancy sequence are
//! spread as evenly as the whole. The factor n² makes each part stand for all (`docs/errata.md`, thesis §3.4.1).

use core::f32::consts::FRAC_1_PI;
use core::ops::Range;

use glam::{Vec3, Vec4};
use indirect_core::{GBuffer, form_factor::bounded, math::luminance};
use indirect_sampling::rng::{hash_combine, unit_f32};
use rayon::prelude::*;
use rsm::Vpl;

use super::shadow::Shadow;
use crate::layout::Summary;

/// How virtual lights are shared out.
#[derive(Debug, Clone, Copy)]
pub struct Parts {
    /// Pixels along each side of a block.
    pub interleave: u32,
    /// Virtual lights of each bounce, a multiple of interleave².
    pub per_bounce: u32,
    /// Bounces.
    pub bounces: u32,
}

impl Parts {
    /// The part of a pixel.
    #[must_use]
    #[inline]
    pub const fn of_pixel(&self, pixel: u32, width: u32) -> u32 {
        let n = self.interleave;
        (pixel / width) % n * n + pixel % width % n
    }

    /// Lights of each part, counted through the bounces, in the ranges that one dispatch sums: software renderers end a shader's loops
    /// after 65 535 rounds, those of the rays that are traced in them included.
    /// `tests` as for [`gather`].
    pub fn ranges(&self, tests: u32) -> impl Iterator<Item = Range<u32>> + use<> {
        let many = tests == 0 || tests > 256;
        let (count, most) = (self.run() * self.bounces, if many { 256 } else { 1024 });
        (0..count.div_ceil(most)).map(move |i| i * most..(i * most + most).min(count))
    }

    /// Virtual lights of each part and bounce.
    #[must_use]
    #[inline]
    pub const fn run(&self) -> u32 {
        self.per_bounce / (self.interleave * self.interleave)
    }

    /// The slot of the `k`-th light of a part.
    #[must_use]
    #[inline]
    pub const fn slot(&self, part: u32, k: u32) -> u32 {
        let run = self.run();
        k / run * self.per_bounce + part * run + k % run
    }
}

/// The virtual lights of a frame as receivers see them.
#[derive(Debug, Clone, Copy)]
pub struct Lights<'a, S> {
    /// All of them.
    pub vpls: &'a [Vpl],
    /// How they are shared out.
    pub parts: Parts,
    /// What they have in common.
    pub summary: Summary,
    /// Whether paths carry what the bound removes, so that it is the same for all; else each is bounded by its own area.
    pub compensated: bool,
    /// What stands in between.
    pub shadow: &'a S,
}

/// Factor between flux and irradiance if nothing stood in between, for a light bounded by `area`, 1/m².
#[inline]
pub(super) fn unshadowed_factor(vpl: &Vpl, area: f32, p: Vec3, n: Vec3) -> f32 {
    let v = vpl.position - p;
    let d2 = v.dot(v);
    let cosines = n.dot(v).max(0.0) * (-vpl.normal.dot(v)).max(0.0);
    let kernel = cosines * FRAC_1_PI / (d2 * d2);
    // False for NaN too: a light that coincides with the receiver gives nothing.
    if !(kernel > 0.0 && kernel < f32::MAX) {
        return 0.0;
    }
    bounded(kernel, area)
}

impl<S: Shadow> Lights<'_, S> {
    /// What a light would give a receiver if nothing stood in between, W/m².
    #[inline]
    fn unshadowed(&self, slot: u32, p: Vec3, n: Vec3) -> Vec3 {
        let vpl = &self.vpls[slot as usize];
        let area = if self.compensated { self.summary.area } else { vpl.area };
        let last = slot >= self.parts.per_bounce * (self.parts.bounces - 1);
        let flux = if last { vpl.flux * self.summary.tail } else { vpl.flux };
        flux * unshadowed_factor(vpl, area, p, n)
    }

    #[inline]
    pub(super) fn asks(&self, slot: u32, p: Vec3, n: Vec3, choices: &mut Choices) -> bool {
        let visible = self.shadow.visible(slot, &self.vpls[slot as usize], p, n);
        choices.note(2 * slot + u32::from(visible));
        visible
    }

    /// Irradiance that the lights `range` of a part, each scaled to all parts, cast on a receiver, W/m²; `tests` of them are asked for
    /// what is in between, or all where that is 0. `u` in `[0, 1)` chooses which.
    #[inline]
    pub(super) fn at(
        &self,
        part: u32,
        range: Range<u32>,
        (p, n): (Vec3, Vec3),
        (tests, u): (u32, f32),
        choices: &mut Choices,
    ) -> Vec3 {
        let scale = (self.parts.interleave * self.parts.interleave) as f32;
        let mut sum = Vec3::ZERO;
        if tests == 0 {
            for k in range {
                let slot = self.parts.slot(part, k);
                let e = self.unshadowed(slot, p, n);
                if e != Vec3::ZERO && self.asks(slot, p, n, choices) {
                    sum += e;
                }
            }
            return sum * scale;
        }
        let mut total = 0.0;
        for k in range.clone() {
            total += luminance(self.unshadowed(self.parts.slot(part, k), p, n));
        }
        if total <= 0.0 {
            return Vec3::ZERO;
        }
        // Evenly spaced places on the running sum: a light is tested in proportion to what it gives, and once at most.
        let step = total / tests as f32;
        let (mut next, mut running) = (u * step, 0.0);
        for k in range {
            let slot = self.parts.slot(part, k);
            let e = self.unshadowed(slot, p, n);
            let weight = luminance(e);
            running += weight;
            if running > next {
                let times = ((running - next) / step).ceil();
                next += times * step;
                if self.asks(slot, p, n, choices) {
                    sum += e * (times * step / weight);
                }
            }
        }
        sum * scale
    }
}

/// What a pixel decided, in 24 bits that a float holds: which lights it asked, and what stood in between. Where two backends disagree
/// here, by a ray that grazes an edge, their light differs for a reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Choices(u32);

impl Choices {
    pub(super) const fn of(number: f32) -> Self {
        Self(number as u32)
    }

    #[inline]
    pub(super) const fn note(&mut self, choice: u32) {
        self.0 = self.0.wrapping_mul(31).wrapping_add(choice) & 0x00ff_ffff;
    }

    pub(super) const fn number(self) -> f32 {
        self.0 as f32
    }
}

/// A number in `[0, 1)` that belongs to a pixel, a seed of the frame and a use of it.
#[inline]
pub(super) fn pixel_number(pixel: u32, seed: u32, salt: u32) -> f32 {
    unit_f32(hash_combine(hash_combine(pixel, seed), salt))
}

/// Irradiance per pixel, W/m², of the pixel's part of the lights, and a number that differs where another light was asked or another
/// answer given; `tests` of each of the ranges of [`Parts::ranges`] are asked for what is in between, or all where that is 0.
#[must_use]
pub fn gather<S: Shadow>(lights: &Lights<'_, S>, camera: &GBuffer, tests: u32, seed: u32) -> Vec<Vec4> {
    let ([width, height], n) = (camera.size, lights.parts.interleave);
    let at = |i: usize, part: u32| {
        if !camera.is_surface(i) {
            return Vec4::ZERO;
        }
        let receiver = (camera.position[i], camera.normal[i]);
        let (mut sum, mut choices) = (Vec3::ZERO, Choices::default());
        for (number, range) in (0..).zip(lights.parts.ranges(tests)) {
            let u = pixel_number(i as u32, seed, number);
            sum += lights.at(part, range, receiver, (tests, u), &mut choices);
        }
        sum.extend(choices.number())
    };
    // Pixels of one part follow each other, as in a split G-buffer: its lights and their maps stay in the cache.
    let down = height.div_ceil(n);
    let rows = (0..n * n * down).into_par_iter().map(|task| {
        let (part, y) = (task / down, task % down * n + task / down / n);
        let columns = (part % n..width).step_by(n as usize);
        let row = |x| at((y * width + x) as usize, part);
        (part, y, if y < height { columns.map(row).collect() } else { Vec::new() })
    });
    let mut gathered = vec![Vec4::ZERO; camera.len()];
    for (part, y, row) in rows.collect::<Vec<_>>() {
        let first = (y * width + part % n) as usize;
        for (k, e) in row.into_iter().enumerate() {
            gathered[first + k * n as usize] = e;
        }
    }
    gathered
}
