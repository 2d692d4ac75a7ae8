//! `emit`: photons where light starts.
//!
//! Each carries the same luminance. One scrambled Sobol' point chooses the source by its share of the flux and, by what is left of the
//! choice, the place on a triangle, the direction of a punctual light or the place before a directional one, so that photons are evenly
//! spread over each source, however many there are; a second point chooses the direction from a triangle.

use glam::{Vec2, Vec3};
use indirect_core::math::{luminance, orthonormal_basis};
use indirect_sampling::mapping::{hemisphere_cosine, sphere_uniform};
use indirect_sampling::rng::hash_combine;
use indirect_sampling::sobol;
use rayon::prelude::*;

use super::draw::{BELOW_ONE, emitter_point, pick};
use super::spot::spot_direction;
use crate::layout::{Emitter, Photon, PhotonSettings, PunctualLight};
use crate::sources::{Params, Sources};

/// [`Params::photons`] photons, all alive; all [`Photon::default`], without flux, where nothing emits.
#[must_use]
pub fn emit(sources: &Sources, params: &Params) -> Vec<Photon> {
    let settings = sources.settings(params);
    (0..settings.photons)
        .into_par_iter()
        .with_min_len(256)
        .map(|i| photon(i, &settings, sources.lights(), sources.emitters()))
        .collect()
}

fn photon(i: u32, settings: &PhotonSettings, lights: &[PunctualLight], emitters: &[Emitter]) -> Photon {
    if settings.share <= 0.0 {
        return Photon::default();
    }
    let u = sobol::sample_2d(i, hash_combine(settings.seed, 0));
    if !lights.is_empty() && u.x < settings.lights_share {
        let x = (u.x / settings.lights_share).min(BELOW_ONE);
        let (k, x) = pick(lights.len(), |k| lights[k].upto, x);
        return of_light(&lights[k], Vec2::new(x, u.y), settings.share);
    }
    if emitters.is_empty() {
        return Photon::default();
    }
    let x = (u.x - settings.lights_share) / (1.0 - settings.lights_share).max(f32::MIN_POSITIVE);
    let (k, x) = pick(emitters.len(), |k| emitters[k].upto, x.clamp(0.0, BELOW_ONE));
    let w = hemisphere_cosine(sobol::sample_2d(i, hash_combine(settings.seed, 1)));
    of_emitter(&emitters[k], Vec2::new(x, u.y), w, settings.share)
}

fn of_light(light: &PunctualLight, u: Vec2, share: f32) -> Photon {
    let flux = light.power * (share / luminance(light.power));
    let photon =
        Photon { state: Photon::ALIVE, flux, inverse_range: light.inverse_range, ..Photon::default() };
    if light.directional == 1 {
        let (t, b) = orthonormal_basis(light.place);
        let across = t * (light.half_width * (2.0 * u.x - 1.0)) + b * (light.half_height * (2.0 * u.y - 1.0));
        // A range means nothing without a distance.
        return Photon {
            position: light.axis + across,
            direction: light.place,
            inverse_range: 0.0,
            ..photon
        };
    }
    let direction = if light.cos_outer < -1.0 {
        sphere_uniform(u)
    } else {
        to_world(spot_direction(light, u), light.axis)
    };
    Photon { position: light.place, direction, ..photon }
}

fn of_emitter(emitter: &Emitter, u: Vec2, w: Vec3, share: f32) -> Photon {
    let (position, normal) = emitter_point(emitter, u);
    let flux = emitter.radiance * (share / luminance(emitter.radiance));
    let direction = to_world(w, normal);
    Photon { position, state: Photon::ALIVE, direction, flux, normal, ..Photon::default() }
}

/// The vector whose coordinates about the unit vector `n` are `l`.
pub(super) fn to_world(l: Vec3, n: Vec3) -> Vec3 {
    let (t, b) = orthonormal_basis(n);
    t * l.x + b * l.y + n * l.z
}
