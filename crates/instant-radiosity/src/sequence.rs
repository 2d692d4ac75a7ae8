//! The points at which virtual lights are drawn.

use glam::Vec2;
use indirect_sampling::halton::{Halton, Scrambling};
use indirect_sampling::rng::{hash_combine, unit_f32};
use indirect_sampling::sobol;

use crate::settings::Sequence;
use crate::setup::Setup;

/// Frames after which the points repeat.
pub const CYCLE: u32 = 64;

/// What a sequence is used for: each use has its own scrambling.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Use {
    /// Texels of the lights' maps.
    Maps,
    /// Points on emissive triangles.
    Emitters,
    /// Directions of the bounce of this number, from 0.
    Bounce(u32),
}

/// `count` points in `[0, 1)²` of a frame: a run of one long sequence, so that frames that follow each other add up to an even spread.
pub(crate) fn points(setup: &Setup, usage: Use, frame: u32, count: u32) -> Vec<Vec2> {
    let (sequence, params) = (setup.options.sequence, &setup.params);
    let salt = match usage {
        Use::Maps => 0,
        Use::Emitters => 1,
        Use::Bounce(number) => 2 + number,
    };
    let first = frame % CYCLE * count;
    if usage == Use::Maps && sequence == Sequence::Halton {
        let [x, y] = [0, 1].map(|d| Halton::dimension(d, Scrambling::None));
        let shift = Vec2::new(unit_f32(hash_combine(params.seed, 5)), unit_f32(hash_combine(params.seed, 7)));
        let at = |i: u64| {
            let p = Vec2::new(x.sample(i), y.sample(i)) + shift;
            (p - p.floor()).min(Vec2::splat(0.999_999_94))
        };
        return (0..count).map(|i| at(u64::from(first) + u64::from(i))).collect();
    }
    let seed = hash_combine(params.seed, salt);
    (0..count).map(|i| sobol::sample_2d(first + i, seed)).collect()
}
