//! `bounce`: the virtual lights of the next bounce.
//!
//! With [`Bounce::Rays`](crate::Bounce::Rays) a virtual light of flux `Φ` sends one ray with the density of its light, `cosθ/π`, so what
//! the ray meets receives `Φ` and reflects `ρΦ`: the flux of all is right in the mean, whatever the scene.

use core::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};
use indirect_accel::Accel;
use indirect_core::{Ray, form_factor::bounded, math};
use indirect_sampling::mapping::hemisphere_cosine;
use rayon::prelude::*;
use rsm::Vpl;

use crate::setup::Fitted;

/// The next bounce of `sources`, one for each; [`Vpl::default`], whose flux is 0, where the ray leaves the scene.
///
/// `points` in `[0, 1)²`, one per source, choose the directions.
#[must_use]
pub fn bounce_rays(accel: &Accel<'_>, fitted: &Fitted, sources: &[Vpl], points: &[Vec2]) -> Vec<Vpl> {
    sources
        .par_iter()
        .zip(points)
        .with_min_len(32)
        .map(|(s, u)| along_ray(accel, fitted, sources, s, *u))
        .collect()
}

fn along_ray(accel: &Accel<'_>, fitted: &Fitted, sources: &[Vpl], source: &Vpl, u: Vec2) -> Vpl {
    if source.flux == Vec3::ZERO {
        return Vpl::default();
    }
    let (t, b) = math::orthonormal_basis(source.normal);
    let w = hemisphere_cosine(u);
    let direction = t * w.x + b * w.y + source.normal * w.z;
    let origin = math::offset_ray_origin_scaled(source.position, source.normal, accel.unit());
    let Some(hit) = accel.closest_hit(&Ray::new(origin, direction)) else { return Vpl::default() };
    let Some(surface) = fitted.surfaces.get(hit.triangle as usize) else { return Vpl::default() };
    let normal = surface.facing(direction);
    let position = origin + direction * hit.t;
    Vpl::new(
        position,
        normal,
        source.flux * surface.albedo,
        footprint(sources, position, normal, fitted.area),
    )
}

/// Sources that a footprint asks.
const ASKED: u32 = 256;

/// The area that a virtual light stands for: one over the density of all lights of its bounce there, whose rays arrive with the density
/// `cosθ cosθ'/(π d²)` from each source. Bounded by the sources' own areas, and at most `area`.
pub(super) fn footprint(sources: &[Vpl], position: Vec3, normal: Vec3, area: f32) -> f32 {
    let step = sources.len().div_ceil(ASKED as usize);
    let mut density = 0.0;
    for s in sources.iter().step_by(step) {
        let v = s.position - position;
        let d2 = v.length_squared();
        if s.flux != Vec3::ZERO && d2 > 0.0 {
            let w = v * d2.sqrt().recip();
            let (cr, cs) = (normal.dot(w), -s.normal.dot(w));
            if cr > 0.0 && cs > 0.0 {
                density += bounded(cr * cs * FRAC_1_PI / d2, s.area);
            }
        }
    }
    1.0 / (density * step as f32).max(1.0 / area)
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    #[test]
    fn as_many_sources_are_asked_as_by_the_shader() {
        use indirect_gpu::shaders::INSTANT_RADIOSITY_BOUNCE;
        testkit::layout::check_constant(&INSTANT_RADIOSITY_BOUNCE, "ASKED", super::ASKED).unwrap();
    }
}
