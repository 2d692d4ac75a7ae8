//! `trace`: one flight of every photon that is alive, and its reflection.
//!
//! Russian roulette (Arvo & Kirk 1990, "Particle Transport and Image Synthesis"): a photon survives with probability `p` and then carries
//! `ρ/p` of its flux, so the flux is right in the mean, and most photons carry what they began with.

use glam::{Vec2, Vec3};
use indirect_accel::Accel;
use indirect_core::{Ray, math};
use indirect_sampling::mapping::hemisphere_cosine;
use indirect_sampling::rng::{philox4x32, unit_f32};
use rayon::prelude::*;

use super::emit::to_world;
use crate::layout::Photon;

/// Largest probability of surviving a reflection. It bounds the photons that `N` leave in all their reflections: `N·¾/(1 − ¾) = 3N` in the
/// mean, whatever the albedo.
pub const MOST_KEPT: f32 = 0.75;

/// Surfaces of no larger albedo are black: the step of the numbers that decide, 2⁻²⁴.
pub const LEAST_KEPT: f32 = 1.0 / 16_777_216.0;

/// Casts the ray of every photon that is alive, and reflects or ends it there. `seed` is that of [`Params`](crate::Params).
///
/// The result is the same on any number of threads.
pub fn trace(accel: &Accel<'_>, seed: u32, photons: &mut [Photon]) {
    photons.par_iter_mut().enumerate().with_min_len(64).for_each(|(i, photon)| {
        if photon.is_alive() {
            *photon = next(accel, seed, i as u32, *photon);
        }
    });
}

fn next(accel: &Accel<'_>, seed: u32, index: u32, photon: Photon) -> Photon {
    let origin = math::offset_ray_origin_scaled(photon.position, photon.normal, accel.unit());
    let Some(hit) = accel.closest_hit(&Ray::new(origin, photon.direction)) else {
        return Photon { state: Photon::ESCAPED, ..photon };
    };
    let scene = accel.scene();
    let [a, b, c] = scene.mesh.corners(hit.triangle);
    // From the corners: that is on the triangle's plane to rounding, however far the ray came.
    let position = a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v;
    let geometric = math::normalize_or((b - a).cross(c - a), Vec3::ZERO);
    let normal = if geometric.dot(photon.direction) > 0.0 { -geometric } else { geometric };
    let s = (position - photon.position).length() * photon.inverse_range;
    let flux = photon.flux * (1.0 - s * s * s * s).clamp(0.0, 1.0);
    let absorbed = Photon { position, state: Photon::ABSORBED, flux, inverse_range: 0.0, normal, ..photon };

    let albedo = scene.albedo(hit.triangle, hit.u, hit.v);
    let kept = albedo.max_element().min(MOST_KEPT);
    let [number, x, y, _] = philox4x32([index, photon.reflections, 0, 0], [seed, 0]).map(unit_f32);
    if flux == Vec3::ZERO || normal == Vec3::ZERO || number.max(LEAST_KEPT) >= kept {
        return absorbed;
    }
    Photon {
        state: Photon::ALIVE,
        direction: to_world(hemisphere_cosine(Vec2::new(x, y)), normal),
        reflections: photon.reflections + 1,
        flux: flux * (albedo / kept),
        ..absorbed
    }
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use indirect_gpu::shaders::PHOTONS_TRACE;
    use testkit::layout::check_constant;

    #[test]
    fn constants_are_those_of_the_shader() {
        check_constant(&PHOTONS_TRACE, "PHOTON_MOST_KEPT", super::MOST_KEPT).unwrap();
        check_constant(&PHOTONS_TRACE, "PHOTON_LEAST_KEPT", super::LEAST_KEPT).unwrap();
    }
}
