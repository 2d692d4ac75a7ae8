//! `emit`: virtual lights on emissive triangles, where the light of emitters starts (Keller 1997, "Instant Radiosity").

use core::f32::consts::PI;

use glam::Vec2;
use indirect_core::math::luminance;
use photon_tracing::Emitter;
use photon_tracing::cpu::{emitter_point, pick};
use rsm::Vpl;

/// One virtual light for each of `points` in `[0, 1)²`: a triangle in proportion to the luminance of its flux, a point on it evenly.
/// `emitted` is the luminance of the flux of all, W. All carry the same luminance, and together the emitters' flux.
#[must_use]
pub fn emit(emitters: &[Emitter], emitted: f32, points: &[Vec2]) -> Vec<Vpl> {
    points.iter().map(|&u| emit_at(emitters, emitted, u, points.len())).collect()
}

fn emit_at(emitters: &[Emitter], emitted: f32, u: Vec2, count: usize) -> Vpl {
    if emitters.is_empty() {
        return Vpl::default();
    }
    let (i, x) = pick(emitters.len(), |i| emitters[i].upto, u.x);
    let e = &emitters[i];
    // What is left of u.x within the triangle's share chooses the side, then the point.
    let (position, normal) = emitter_point(e, Vec2::new(x, u.y));
    let share = emitted / count as f32;
    let flux = e.radiance * (share / luminance(e.radiance));
    // A point of the triangle stands for the area whose flux is the light's.
    let area = share / (PI * luminance(e.radiance));
    Vpl::new(position, normal, flux, area)
}
