//! `cast`: the same maps by one ray per texel, what a rasterized shadow map of each VPL would hold.

use glam::Vec2;
use indirect_accel::Accel;
use indirect_core::Ray;
use indirect_core::math::offset_ray_origin_scaled;
use rayon::prelude::*;
use rsm::Vpl;

use super::atlas::Atlas;
use super::frame::direction;
use crate::layout::Ism;
use crate::settings::Options;

/// The maps of `vpls`, exact at the centre of each texel. Uses the side and the bias of `options`.
#[must_use]
pub fn cast(accel: &Accel<'_>, vpls: &[Vpl], options: &Options) -> Atlas {
    let ism = Ism::new(&Options { pull_push: 0, ..*options }, 0, vpls.len() as u32);
    let mut atlas = Atlas::new(ism, vpls);
    let frames = &atlas.frames;
    let side = ism.tile as usize;
    atlas.depths.par_chunks_mut(ism.texels()).zip(frames).for_each(|(map, frame)| {
        let origin = offset_ray_origin_scaled(frame.position, frame.normal, accel.unit());
        for (i, texel) in map.iter_mut().enumerate() {
            let q = Vec2::new((i % side) as f32 + 0.5, (i / side) as f32 + 0.5) * (2.0 / side as f32) - 1.0;
            let local = direction(q);
            let ray = Ray::new(origin, frame.world(local));
            if let Some(hit) = accel.closest_hit(&ray) {
                *texel = 1.0 / (hit.t * (1.0 + local.z)).max(f32::MIN_POSITIVE);
            }
        }
    });
    atlas
}
