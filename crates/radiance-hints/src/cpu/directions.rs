//! Along which directions hints gather later bounces, and where each ends.

use glam::Vec3;
use indirect_sampling::{mapping, rng::hash_combine, sobol};

use crate::{
    layout::Volume,
    setup::{Enclosure, Setup},
    volume::Lattice,
};

/// The quantised hit distance of a direction without a hit.
pub(crate) const OPEN: u32 = 255;

/// The seed of bounce `number`, 2 for the first after the estimate, of [`Transport::Sphere`](crate::Transport::Sphere).
#[must_use]
pub fn bounce_seed(seed: u32, number: u32) -> u32 {
    hash_combine(seed, number)
}

/// The directions along which each hint gathers light of later bounces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Directions {
    /// How many there are.
    pub count: u32,
    /// Scrambles the sequences.
    pub seed: u32,
    /// How far they reach at most, as a share of the box's diagonal; see [`Params::range`](crate::Params::range).
    pub range: f32,
    /// What surrounds the box, where it is known; see [`Setup::enclosure`].
    pub enclosure: Option<Enclosure>,
}

impl Directions {
    /// Those of a setup.
    #[must_use]
    pub const fn new(setup: &Setup) -> Self {
        let Setup { options, params, enclosure, .. } = setup;
        Self { count: options.bounce_samples, seed: params.seed, range: params.range, enclosure: *enclosure }
    }

    /// Direction `j` of [`Transport::Directions`](crate::Transport::Directions): the same for all bounces and all hints, so
    /// that what they miss is a smooth error, not noise.
    pub(super) fn direction(&self, j: u32) -> Vec3 {
        mapping::sphere_uniform(sobol::sample_2d(j, bounce_seed(self.seed, 0)))
    }

    /// The distance at which a direction `w` from a hint at `position` ends, metres, and the face of the box that lies there.
    pub(super) fn border(&self, lattice: &Lattice, hint: u32, position: Vec3, w: Vec3) -> (f32, usize) {
        let room = lattice.room(hint);
        let (border, face) = exit_of_box(room.origin, room.origin + room.extent(), position, w);
        let depth = self.enclosure.map_or(1.0, |e| e.depth[face]);
        ((border * depth).min(self.range * room.extent().length()), face)
    }
}

/// Half of a cell along `w`, metres: a hint that is this far in front of a surface lies on its front side.
pub(super) fn half_cell(room: &Volume, w: Vec3) -> f32 {
    0.5 * w.abs().dot(room.cell)
}

/// Where the ray from `p`, inside, along `w` leaves the box from `origin` to `end`: distance and face, `−x, +x, −y, +y, −z,
/// +z`.
pub(super) fn exit_of_box(origin: Vec3, end: Vec3, p: Vec3, w: Vec3) -> (f32, usize) {
    let (mut nearest, mut face) = (f32::MAX, 0);
    for axis in 0..3 {
        if w[axis] == 0.0 {
            continue;
        }
        let up = w[axis] > 0.0;
        let t = (if up { end[axis] } else { origin[axis] } - p[axis]) / w[axis];
        if t < nearest {
            (nearest, face) = (t, 2 * axis + usize::from(up));
        }
    }
    (nearest.max(0.0), face)
}
