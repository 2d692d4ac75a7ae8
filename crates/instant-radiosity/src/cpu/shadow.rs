//! Whether a virtual light sees a receiver.

use glam::Vec3;
use imperfect_shadow_maps::cpu::Atlas;
use indirect_accel::Accel;
use indirect_core::{Ray, math};
use rsm::Vpl;

/// What stands between virtual lights and receivers.
pub trait Shadow: Sync {
    /// Whether the light in `slot` sees the point `p` of a surface with the unit normal `n`.
    fn visible(&self, slot: u32, vpl: &Vpl, p: Vec3, n: Vec3) -> bool;
}

/// Nothing.
#[derive(Debug, Clone, Copy)]
pub struct Open;

impl Shadow for Open {
    #[inline]
    fn visible(&self, _: u32, _: &Vpl, _: Vec3, _: Vec3) -> bool {
        true
    }
}

/// The scene itself.
#[derive(Debug, Clone, Copy)]
pub struct Rays<'a>(pub &'a Accel<'a>);

impl Shadow for Rays<'_> {
    #[inline]
    fn visible(&self, _: u32, vpl: &Vpl, p: Vec3, n: Vec3) -> bool {
        let unit = self.0.unit();
        let from = math::offset_ray_origin_scaled(p, n, unit);
        let to = math::offset_ray_origin_scaled(vpl.position, vpl.normal, unit);
        !self.0.any_hit(&Ray { origin: from, direction: to - from, t_max: 1.0 })
    }
}

/// Imperfect shadow maps, one per slot.
#[derive(Debug, Clone, Copy)]
pub struct Maps<'a>(pub &'a Atlas);

impl Shadow for Maps<'_> {
    #[inline]
    fn visible(&self, slot: u32, _: &Vpl, p: Vec3, n: Vec3) -> bool {
        self.0.visible_surface(slot as usize, p, n)
    }
}
