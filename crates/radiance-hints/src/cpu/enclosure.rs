//! What surrounds a box, looked at once with rays: for callers that have their geometry at hand.

use glam::Vec3;
use indirect_accel::Accel;
use indirect_core::{Aabb, Ray};
use indirect_sampling::sobol;

use crate::Enclosure;

/// Rays towards each face.
const RAYS: u32 = 256;

/// The mean albedo of what is seen from inside of `bounds` through each of its faces; what is not there counts as black, so
/// that an open side returns nothing. 1536 rays, once per scene.
#[must_use]
pub fn enclosure(accel: &Accel<'_>, bounds: &Aabb) -> Enclosure {
    let extent = bounds.extent();
    let albedo = core::array::from_fn(|face| {
        let axis = face / 2;
        let side = if face % 2 == 1 { bounds.max[axis] } else { bounds.min[axis] };
        let mut sum = Vec3::ZERO;
        for i in 0..RAYS {
            let u = sobol::sample_2d(i, 2 * face as u32).extend(sobol::sample_1d(i, 100 + face as u32));
            let v = sobol::sample_2d(i, 2 * face as u32 + 1);
            let from = bounds.min + extent * u;
            let mut to = bounds.min + extent * Vec3::new(v.x, v.y, v.x);
            to[(axis + 1) % 3] = bounds.min[(axis + 1) % 3] + extent[(axis + 1) % 3] * v.x;
            to[(axis + 2) % 3] = bounds.min[(axis + 2) % 3] + extent[(axis + 2) % 3] * v.y;
            to[axis] = side;
            let ray = Ray { t_max: 2.0, ..Ray::new(from, to - from) };
            if let Some(hit) = accel.closest_hit(&ray) {
                sum += accel.scene().albedo(hit.triangle, hit.u, hit.v);
            }
        }
        sum / RAYS as f32
    });
    Enclosure { albedo }
}
