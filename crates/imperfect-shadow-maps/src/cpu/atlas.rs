//! The maps and the question that they answer.
//!
//! A map is the paraboloid projection of the hemisphere around a VPL's normal (Brabec, Annen & Seidel 2002): the unit direction
//! `(x, y, z)` along the axes of the VPL's frame lies at `q = (x, y) / (1 + z)` in the unit disc. A texel holds
//!
//! ```text
//! u = 1 / (d + h)          d distance from the VPL, h height above its plane
//! ```
//!
//! which falls with the distance along each direction, is at hand from the projection, is 0 where nothing is in the way, and is
//! a polynomial on a plane: with the normal `n`, a point `p` of the plane and both relative to the VPL and along its axes,
//!
//! ```text
//! u(q) = (2 n_x q_x + 2 n_y q_y + n_z (1 − |q|²)) / (2 n·p)
//! ```
//!
//! so that a splat and a receiver have their own depth at the middle of every texel, for no more than a few products.

use glam::Vec3;
use rayon::prelude::*;
use rsm::Vpl;

use super::frame::Frame;
use crate::layout::{EMPTY, Ism};

/// One depth map per VPL over the hemisphere around its normal.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Atlas {
    /// Sizes and factors.
    pub ism: Ism,
    /// One per map.
    pub frames: Vec<Frame>,
    /// `1 / (distance + height)`, 1/m, of what lies in the way, or [`EMPTY`]: map after map, each row-major.
    pub depths: Vec<f32>,
    /// The coarser levels of `pull`: map after map, the finest level first.
    pub coarse: Vec<f32>,
}

impl Atlas {
    /// Empty maps.
    #[must_use]
    pub fn new(ism: Ism, vpls: &[Vpl]) -> Self {
        Self {
            ism,
            frames: vpls.iter().map(Frame::new).collect(),
            depths: vec![EMPTY; vpls.len() * ism.texels()],
            coarse: vec![EMPTY; vpls.len() * ism.coarse as usize],
        }
    }

    /// Whether light of VPL `index` reaches a receiver of unknown slope, metres. `false` behind the VPL, or where there is no
    /// such VPL.
    ///
    /// Where the receiver's normal is known, [`Self::visible_surface`] errs about half as often.
    #[must_use]
    #[inline]
    pub fn visible(&self, index: usize, receiver: Vec3) -> bool {
        let Some(frame) = self.frames.get(index) else { return false };
        let v = receiver - frame.position;
        let local = frame.local(v);
        if local.z <= 0.0 {
            return false;
        }
        let c = 1.0 / (v.length() + local.z);
        let (texel, _) = self.texel(index, local.x * c, local.y * c);
        texel <= c * self.ism.point_bias
    }

    /// Whether light of VPL `index` reaches a receiver, metres, with this unit normal. `false` where either side faces away from
    /// the other, or where there is no such VPL.
    #[must_use]
    #[inline]
    pub fn visible_surface(&self, index: usize, receiver: Vec3, normal: Vec3) -> bool {
        let Some(frame) = self.frames.get(index) else { return false };
        let v = receiver - frame.position;
        let local = frame.local(v);
        let k = -2.0 * normal.dot(v);
        if local.z <= 0.0 || k <= 0.0 {
            return false;
        }
        let c = 1.0 / (v.length() + local.z);
        let (texel, [x, y]) = self.texel(index, local.x * c, local.y * c);
        // The receiver's plane at the middle of the texel, times k.
        let n = frame.local(normal);
        let plane = -(2.0 * (n.x * x + n.y * y) + n.z * (1.0 - (x * x + y * y)));
        let (near, far) = (k * c * self.ism.reach, k * c / self.ism.reach);
        let plane = if plane > near {
            near
        } else if plane < far {
            far
        } else {
            plane
        };
        texel * k <= plane * self.ism.bias
    }

    /// What the map holds at a place of the unit disc, and where the middle of that texel is.
    #[inline]
    fn texel(&self, index: usize, x: f32, y: f32) -> (f32, [f32; 2]) {
        let half = 0.5 * self.ism.tile as f32;
        // Rounding may reach the side.
        let last = self.ism.tile - 1;
        let [x, y] = [x, y].map(|q| ((q * half + half) as u32).min(last));
        let texel = self.depths[index * self.ism.texels() + (y * self.ism.tile + x) as usize];
        (texel, [x, y].map(|i| (i as f32 + 0.5) / half - 1.0))
    }

    /// Memory of the maps, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&self.depths[..]) + size_of_val(&self.coarse[..]) + size_of_val(&self.frames[..])
    }

    /// Every map with its coarser levels, of which there must be some, in parallel.
    pub(super) fn par_maps(&mut self) -> impl IndexedParallelIterator<Item = (&mut [f32], &mut [f32])> {
        let (texels, coarse) = (self.ism.texels(), self.ism.coarse.max(1) as usize);
        self.depths.par_chunks_mut(texels).zip(self.coarse.par_chunks_mut(coarse))
    }
}
