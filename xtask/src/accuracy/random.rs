//! Random inputs, the same at every run.

use std::f64::consts::TAU;

use glam::{DMat3, DQuat, DVec3};
use sh_math::Sh;

/// Numbers in `[0, 1)` from a 64-bit linear congruential generator.
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 * 2.0_f64.powi(-53)
    }

    pub(super) fn signed(&mut self) -> f64 {
        2.0 * self.next() - 1.0
    }

    pub(super) fn direction(&mut self) -> DVec3 {
        let (z, phi) = (self.signed(), TAU * self.next());
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * phi.cos(), r * phi.sin(), z)
    }

    pub(super) fn sh<const N: usize>(&mut self) -> Sh<N, f64> {
        // What f32 can hold, so that only the operation rounds.
        Sh(core::array::from_fn(|_| f64::from(self.signed() as f32)))
    }

    pub(super) fn rotation(&mut self) -> DMat3 {
        let q =
            DQuat::from_xyzw(self.signed(), self.signed(), self.signed(), self.signed() + 1.5).normalize();
        DMat3::from_quat(q)
    }
}
