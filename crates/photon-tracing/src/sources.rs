use core::f64::consts::PI;
use std::sync::Arc;

use glam::Vec3;
use indirect_core::{Aabb, Light, Scene, math};

use crate::emitters::Emitters;
use crate::layout::{Emitter, PhotonSettings, PunctualLight};

/// How photons are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Params {
    /// Photons to emit. More: less noise; powers of two spread most evenly.
    pub photons: u32,
    /// Chooses places, directions and ends.
    pub seed: u32,
}

impl Default for Params {
    fn default() -> Self {
        Self { photons: 65_536, seed: 0 }
    }
}

/// All that a scene's light starts from: punctual lights and emissive triangles, each with its share of the flux.
///
/// Exact fluxes, for a radiant intensity `I`, an irradiance `E` and a radiance `L`: of a point `4πI`; of a spot what
/// [`indirect_core::spot_attenuation`] lets through; of a directional light `E` times the rectangle across it that holds the bounds of all
/// triangles; of an emissive triangle `πLA`, from both sides where its material is double-sided. `range` takes its part on the way.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sources {
    emitters: Arc<Emitters>,
    lights: Vec<PunctualLight>,
    bounds: Option<Aabb>,
    flux: Vec3,
    luminance: f32,
    lights_share: f32,
}

impl Sources {
    /// Looks at a scene. Its triangles are gone through once; where only the lights change, [`Self::set_lights`] suffices.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let emitters = Arc::new(Emitters::new(scene));
        let mut sources = Self { emitters, bounds: bounds(scene), ..Self::default() };
        sources.set_lights(&scene.lights);
        sources
    }

    /// Exchanges the punctual lights. Costs nothing but these.
    pub fn set_lights(&mut self, lights: &[Light]) {
        self.lights.clear();
        let (mut upto, mut sum, mut all) = (Vec::new(), 0.0, self.emitters.flux.as_dvec3());
        for light in lights {
            let (light, factor) = source(PunctualLight::new(light), self.bounds);
            let flux = f64::from(math::luminance(light.power)) * factor;
            // Neither NaN nor more than an f32 holds.
            if !(flux > 0.0 && flux < f64::from(f32::MAX)) {
                continue;
            }
            sum += flux;
            all += light.power.as_dvec3() * factor;
            upto.push(sum);
            self.lights.push(light);
        }
        for (light, upto) in self.lights.iter_mut().zip(upto) {
            light.upto = (upto / sum) as f32;
        }
        let total = sum + f64::from(self.emitters.luminance);
        self.flux = all.as_vec3();
        self.luminance = total as f32;
        self.lights_share = if total > 0.0 { (sum / total) as f32 } else { 0.0 };
    }

    /// Emissive triangles whose flux is not 0.
    #[must_use]
    pub fn emitters(&self) -> &[Emitter] {
        &self.emitters.triangles
    }

    /// Punctual lights whose flux is not 0.
    #[must_use]
    pub fn lights(&self) -> &[PunctualLight] {
        &self.lights
    }

    /// Flux of all sources, W.
    #[must_use]
    pub fn flux(&self) -> Vec3 {
        self.flux
    }

    /// What `emit` and `trace` read.
    #[must_use]
    pub fn settings(&self, params: &Params) -> PhotonSettings {
        let share = self.luminance / params.photons.max(1) as f32;
        PhotonSettings {
            photons: params.photons,
            seed: params.seed,
            emitters: self.emitters.triangles.len() as u32,
            lights: self.lights.len() as u32,
            share: if share.is_finite() { share } else { 0.0 },
            lights_share: self.lights_share,
            unit: self.bounds.map_or(0.0, |b| b.diagonal()),
            pad0: 0,
        }
    }
}

/// Bounds of all triangles that a ray can meet.
fn bounds(scene: &Scene) -> Option<Aabb> {
    let mesh = &scene.mesh;
    let sound = |&[a, b, c]: &[Vec3; 3]| {
        a.is_finite() && b.is_finite() && c.is_finite() && a != b && b != c && c != a
    };
    Aabb::of((0..mesh.triangles.len() as u32).map(|t| mesh.corners(t)).filter(sound).flatten())
}

/// A light ready to emit, and its flux per unit of power: sr, or m².
fn source(light: PunctualLight, bounds: Option<Aabb>) -> (PunctualLight, f64) {
    if light.directional == 1 {
        let Some(bounds) = bounds else { return (light, 0.0) };
        return rectangle(light, &bounds);
    }
    if light.cos_outer < -1.0 {
        return (light, 4.0 * PI);
    }
    let axis = math::normalize_or(light.axis, Vec3::Z);
    let (outer, scale) = (f64::from(light.cos_outer), f64::from(light.spot_scale));
    // Full intensity is reached here, unless even the axis is short of it.
    let edge = (outer + 1.0 / scale).min(1.0);
    let falloff = (edge - outer).powi(3) * scale * scale / 3.0;
    (PunctualLight { axis, ..light }, 2.0 * PI * (1.0 - edge + falloff))
}

/// The rectangle in front of the bounds, across a directional light, and its area.
fn rectangle(light: PunctualLight, bounds: &Aabb) -> (PunctualLight, f64) {
    let place = math::normalize_or(light.place, Vec3::NEG_Y);
    let (t, b) = math::orthonormal_basis(place);
    // Grown by what middle and start round; its area grows with it, and the irradiance stays.
    let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
    let slack = 4.0 * f32::EPSILON * largest;
    let half = |axis: Vec3| axis.abs().dot(bounds.extent()) * 0.5 + slack;
    let (half_width, half_height) = (half(t), half(b));
    let back = half(place) + bounds.diagonal() * (1.0 / 1024.0);
    let light =
        PunctualLight { place, axis: bounds.centre() - place * back, half_width, half_height, ..light };
    (light, 4.0 * f64::from(half_width) * f64::from(half_height))
}

#[cfg(test)]
mod tests {
    use super::*;
    use indirect_core::{LightKind, spot_attenuation};

    #[test]
    fn the_flux_of_a_spot_is_the_integral_of_its_falloff() {
        let mut worst = [0.0_f64; 2];
        let right = core::f32::consts::FRAC_PI_2;
        for (inner, outer) in
            [(0.0, 0.5), (0.3, 0.6), (0.5, 0.5), (0.2, 1.5), (0.0, 0.03), (0.0, right), (1.2, right)]
        {
            let kind = LightKind::Spot {
                position: Vec3::ZERO,
                direction: Vec3::Z,
                inner_angle: inner,
                outer_angle: outer,
            };
            let light = Light { name: String::new(), kind, power: Vec3::ONE, range: None };
            let found = source(PunctualLight::new(&light), None).1;
            // Midpoints in the cosine, over the cone alone: 2·10⁵ of them; the integrand has a kink and no jump.
            let low = f64::from(outer.cos());
            let n = 200_000;
            let step = (1.0 - low) / f64::from(n);
            let at = |i: i32| {
                let c = low + (f64::from(i) + 0.5) * step;
                // spot_attenuation in f64, from the same f32 cosines.
                let span = f64::from((inner.cos() - outer.cos()).max(0.001));
                ((c - low) / span).clamp(0.0, 1.0).powi(2)
            };
            let exact = 2.0 * PI * step * (0..n).map(at).sum::<f64>();
            worst[0] = worst[0].max((found / exact - 1.0).abs());
            // A fault: the formula for cones whose axis reaches full intensity.
            let edge = low + f64::from((inner.cos() - outer.cos()).max(0.001));
            let plain = 2.0 * PI * (1.0 - edge + (edge - low) / 3.0);
            worst[1] = worst[1].max((plain / exact - 1.0).abs());
            // And this is the falloff that everyone else evaluates, to its f32 rounding.
            let c = f64::midpoint(low, 1.0);
            let single = f64::from(spot_attenuation(c as f32, inner, outer));
            assert!((single - at(n / 2)).abs() < 1e-3, "{inner} {outer}: {single}");
        }
        // The scale is one f32 division: 6·10⁻⁸, twice; midpoints 10⁻⁹ or so.
        assert!(worst[0] < 1e-6, "{worst:?}");
        assert!(worst[1] > 0.1, "{worst:?} passed");
    }

    #[test]
    fn the_rectangle_holds_the_bounds_and_lies_before_them() {
        for offset in [0.0, 1e5_f32] {
            let min = Vec3::new(-1.0, 0.5, 2.0) + offset;
            let bounds = Aabb { min, max: min + Vec3::new(3.0, 0.0, 1.5) };
            for direction in [Vec3::NEG_Y, Vec3::Z, Vec3::new(0.3, -0.7, 0.5).normalize()] {
                let kind = LightKind::Directional { direction };
                let light = Light { name: String::new(), kind, power: Vec3::ONE, range: None };
                let (light, _) = source(PunctualLight::new(&light), Some(bounds));
                let (t, b) = math::orthonormal_basis(light.place);
                for corner in bounds.corners() {
                    let d = corner.as_dvec3() - light.axis.as_dvec3();
                    assert!(d.dot(light.place.as_dvec3()) > 0.0);
                    assert!(d.dot(t.as_dvec3()).abs() <= f64::from(light.half_width));
                    assert!(d.dot(b.as_dvec3()).abs() <= f64::from(light.half_height));
                }
            }
        }
    }

    #[test]
    fn what_does_not_emit_has_no_share() {
        let mut sources = Sources::new(&Scene::default());
        assert_eq!((sources.flux(), sources.settings(&Params::default()).share), (Vec3::ZERO, 0.0));
        let light = |kind, power| Light { name: String::new(), kind, power, range: None };
        let point = LightKind::Point { position: Vec3::ZERO };
        let sun = LightKind::Directional { direction: Vec3::NEG_Y };
        // A distant light has nothing to shine on here, and what is infinite is left out.
        sources.set_lights(&[
            light(point, Vec3::ZERO),
            light(sun, Vec3::ONE),
            light(point, Vec3::splat(f32::INFINITY)),
            light(point, Vec3::splat(f32::MAX)),
            light(point, Vec3::new(1.0, 2.0, 3.0)),
        ]);
        assert_eq!(sources.lights().len(), 1);
        assert_eq!(sources.lights()[0].upto, 1.0);
        assert!((sources.flux() / (4.0 * core::f32::consts::PI) - Vec3::new(1.0, 2.0, 3.0)).length() < 1e-6);
        assert_eq!(sources.settings(&Params::default()).lights_share, 1.0);
    }
}
