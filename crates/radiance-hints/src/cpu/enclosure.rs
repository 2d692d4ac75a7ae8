//! The mean albedo and distance of the surfaces that surround a box, measured with rays once per scene.

use glam::Vec3;
use indirect_accel::Accel;
use indirect_core::{
    Aabb, Ray,
    math::{offset_ray_origin_scaled, orthonormal_basis},
};
use indirect_sampling::{mapping, sobol};
use rsm::Rsm;

use super::directions::exit_of_box;
use crate::setup::Enclosure;

/// Rays in all.
const RAYS: u32 = 2048;

/// Rays that a face needs for a mean of its own; with fewer it takes the mean of all faces.
const LEAST_RAYS: f32 = 24.0;

/// Mean albedo and distance of the surfaces that lit points see in the direction of each face of `bounds`: 2048 rays.
///
/// A ray that misses counts as black, so that an open side reflects nothing. `rsm` may be of a low resolution: it only supplies
/// lit points.
#[must_use]
pub fn enclosure(accel: &Accel<'_>, bounds: &Aabb, rsm: &Rsm) -> Enclosure {
    let lit: Vec<_> = rsm
        .maps
        .iter()
        .flat_map(|m| (0..m.texels.len()).map(move |i| (m, i)))
        .filter(|(m, i)| m.texels[*i].incident.max_element() > 0.0)
        .collect();
    if lit.is_empty() {
        return Enclosure::default();
    }
    let mut sums = [(Vec3::ZERO, 0.0_f32, 0.0_f32, 0.0_f32); 6];
    for i in 0..RAYS {
        let (map, texel) = lit[(u64::from(i) * lit.len() as u64 / u64::from(RAYS)) as usize];
        let n = map.surface.normal[texel];
        let (t, b) = orthonormal_basis(n);
        let d = mapping::hemisphere_cosine(sobol::sample_2d(i, 1));
        let w = t * d.x + b * d.y + n * d.z;
        let from = offset_ray_origin_scaled(map.surface.position[texel], n, accel.unit());
        let (border, face) = exit_of_box(bounds.min, bounds.max, from, w);
        let (albedo, depth, hits, rays) = &mut sums[face];
        *rays += 1.0;
        if let Some(hit) = accel.closest_hit(&Ray::new(from, w)) {
            *albedo += accel.scene().albedo(hit.triangle, hit.u, hit.v);
            *depth += if border > 0.0 { (hit.t / border).min(1.0) } else { 1.0 };
            *hits += 1.0;
        }
    }
    let all =
        sums.iter().fold((Vec3::ZERO, 0.0, 0.0, 0.0), |a, s| (a.0 + s.0, a.1 + s.1, a.2 + s.2, a.3 + s.3));
    let faces = sums.map(|s| {
        let (albedo, depth, hits, rays) = if s.3 >= LEAST_RAYS { s } else { all };
        (albedo / rays, if hits > 0.0 { depth / hits } else { 1.0 })
    });
    Enclosure { albedo: faces.map(|f| f.0), depth: faces.map(|f| f.1) }
}
