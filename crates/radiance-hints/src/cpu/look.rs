//! Which samples a hint reads, and the point in its cell from which each is seen.

use glam::{UVec3, Vec3};
use indirect_sampling::rng::{hash_combine, unit_f32};

use crate::{
    layout::{Near, Sample, Window},
    settings::Sampling,
    setup::{Draw, INTERLEAVE},
    volume::Lattice,
};

/// Steps of an additive recurrence in three dimensions, as 32-bit fractions: `φ⁻¹, φ⁻², φ⁻³` of `φ⁴ = φ + 1` (Roberts
/// 2018, "The Unreasonable Effectiveness of Quasirandom Sequences").
const STEP: [u32; 3] = [3_518_319_155, 2_882_110_345, 2_360_945_575];

/// The number of the list of samples that a hint reads.
pub(super) fn list_of(lattice: &Lattice, hint: u32, sampling: Sampling) -> u32 {
    match sampling {
        Sampling::Importance | Sampling::Nearby => {
            // Morton order: each 2³ block of hints has consecutive lists.
            let place = lattice.place(hint).1 % INTERLEAVE;
            spread(place.x) | spread(place.y) << 1 | spread(place.z) << 2
        }
        Sampling::Disc => hint,
    }
}

/// The samples of all hints: the lists that they share, and the samples in their windows.
#[derive(Debug, Clone, Copy)]
pub struct Samples<'a> {
    /// How they were drawn.
    pub draw: Draw,
    /// [`Draw::samples`] samples for each of [`Draw::lists`] lists.
    pub lists: &'a [Sample],
    /// The windows and their samples.
    pub near: &'a Near,
}

/// The samples of one hint.
pub(super) struct Looked<'a> {
    list: &'a [Sample],
    near: &'a [Sample],
    window: Window,
    resolution: u32,
}

impl<'a> Looked<'a> {
    /// Those of `hint`.
    pub(super) fn new(samples: &Samples<'a>, lattice: &Lattice, hint: u32) -> Self {
        let draw = &samples.draw;
        let (count, near) = (draw.samples as usize, draw.near() as usize);
        let list = &samples.lists[list_of(lattice, hint, draw.sampling) as usize * count..][..count];
        let window = samples.near.windows.get(hint as usize).copied().unwrap_or_default();
        let near = if window.end == window.first {
            &[]
        } else {
            &samples.near.samples[hint as usize * near..][..near]
        };
        Self { list, near, window, resolution: samples.near.resolution }
    }

    /// Sample `k` of [`Draw::samples`], and the factor of its flux and area. A hint with a window takes that much fewer from
    /// its list, each of which stands for more; the factor is 0 for those that lie within the window, which the window's own
    /// samples stand for.
    pub(super) fn sample(&self, k: u32) -> (&'a Sample, f32) {
        if self.near.is_empty() {
            return (&self.list[k as usize], 1.0);
        }
        let far = self.list.len() - self.near.len();
        if let Some(near) = (k as usize).checked_sub(far) {
            return (&self.near[near], 1.0);
        }
        let s = &self.list[k as usize];
        let Window { first, end, map, .. } = self.window;
        let (x, y) = (s.texel % self.resolution, s.texel / self.resolution);
        let within = s.map == map && x >= first[0] && x < end[0] && y >= first[1] && y < end[1];
        (s, if within { 0.0 } else { self.list.len() as f32 / far as f32 })
    }
}

/// The two lowest bits, spread three apart.
const fn spread(x: u32) -> u32 {
    (x & 1) | (x & 2) << 2
}

/// The offset of a hint in the recurrence.
pub(super) fn shift_of(seed: u32, hint: u32) -> UVec3 {
    let h = hash_combine(seed, hint);
    UVec3::new(h, hash_combine(h, 1), hash_combine(h, 2))
}

/// The point in its cell from which a hint at `position` sees its sample `k`.
pub(super) fn place_of(position: Vec3, cell: Vec3, jitter: f32, shift: UVec3, k: u32) -> Vec3 {
    let at = |axis: usize| unit_f32(shift[axis].wrapping_add(k.wrapping_mul(STEP[axis])));
    let offset = Vec3::new(at(0), at(1), at(2)) - 0.5;
    position + cell * offset * jitter
}
