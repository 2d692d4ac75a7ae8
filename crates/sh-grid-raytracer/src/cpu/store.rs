//! `store`: photons that a surface has just reflected, with the cells they leave from (§3.2).

use glam::Vec3;
use indirect_accel::Accel;
use indirect_core::{Ray, math};
use photon_tracing::Photon;
use rayon::prelude::*;

use crate::layout::StoredPhoton;
use crate::voxels::Voxels;

/// What says which photons are stored, and how.
#[derive(Debug, Clone, Copy)]
pub struct Store<'a> {
    /// The scene.
    pub accel: &'a Accel<'a>,
    /// Its cells.
    pub voxels: &'a Voxels,
    /// How far a photon must get, metres; 0: all are stored.
    pub reach: f32,
    /// Whether faces share out flux by its direction instead of the normal.
    pub printed: bool,
}

impl Store<'_> {
    /// What is stored of each photon; `None` for those that are not alive, lie in no boundary cell, or shine on something within `reach`: what
    /// a gap keeps to itself does not light the scene.
    #[must_use]
    pub fn all(&self, photons: &[Photon]) -> Vec<Option<StoredPhoton>> {
        photons.par_iter().enumerate().with_min_len(256).map(|(i, p)| self.one(i as u32, p)).collect()
    }

    fn one(&self, number: u32, photon: &Photon) -> Option<StoredPhoton> {
        if !photon.is_alive() {
            return None;
        }
        let cell = self.voxels.boundary_at(self.voxels.grid.local(photon.position))?;
        if !gets_away(self.accel, (photon.position, photon.normal), photon.direction, self.reach) {
            return None;
        }
        let axis = if self.printed { photon.direction } else { photon.normal };
        Some(StoredPhoton { flux: photon.flux, cell, axis, photon: number })
    }
}

/// Whether what leaves a surface at the point `p` with the normal `n` along `direction` meets nothing within `reach`, metres.
pub(crate) fn gets_away(accel: &Accel<'_>, (p, n): (Vec3, Vec3), direction: Vec3, reach: f32) -> bool {
    let origin = math::offset_ray_origin_scaled(p, n, accel.unit());
    reach <= 0.0 || !accel.any_hit(&Ray { origin, direction, t_max: reach })
}
