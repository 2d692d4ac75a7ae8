//! A light's own frame in one frame of the animation: from the world to the domain of its directions and back.

use core::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use indirect_accel::Accel;
use indirect_core::math::orthonormal_basis;
use indirect_core::{Light, LightKind, Ray};

use crate::pattern::Shape;
use crate::settings::Density;

/// What is nearer to a light than this share of the scene's diagonal is neither lit nor does it shade: as the maps of
/// `rsm` see it.
const NEAR: f32 = 1e-5;

/// Slack of a directional light's disc around the scene, relative to its radius.
const SLACK: f32 = 1e-3;

/// Least squared radius at which a spot's measures are told apart from their limit at the axis.
const AXIS: f64 = 1e-8;

/// A light with its frame.
pub(crate) struct Frame<'a> {
    pub(crate) light: &'a Light,
    kind: Kind,
    /// Position of the light; of a directional one the centre of the scene.
    origin: Vec3,
    /// Right, up and the light's axis.
    axes: [Vec3; 3],
    /// Least distance to the light, metres.
    near: f32,
}

enum Kind {
    Cone(Cone),
    Sphere,
    /// A disc of this radius, metres, across a directional light.
    Beam(f32),
}

impl<'a> Frame<'a> {
    /// `None` where the light can send nothing anywhere: no scene, not finite, a cone without opening.
    pub(crate) fn new(light: &'a Light, accel: &Accel<'_>, density: Density) -> Option<Self> {
        let bounds = accel.scene().bounds()?;
        let unit = accel.unit();
        let normalized = |v: Vec3| (v / v.abs().max_element()).try_normalize();
        let (kind, origin, axis) = match light.kind {
            LightKind::Point { position } => (Kind::Sphere, position, Vec3::Z),
            LightKind::Spot { position, direction, inner_angle, outer_angle } => {
                let cone = Cone::new(inner_angle.into(), outer_angle.into(), density)?;
                (Kind::Cone(cone), position, normalized(direction)?)
            }
            LightKind::Directional { direction } => {
                let radius = 0.5 * bounds.diagonal() * (1.0 + SLACK);
                (Kind::Beam(radius), bounds.centre(), normalized(direction)?)
            }
        };
        let usable = unit > 0.0 && unit.is_finite() && origin.is_finite() && light.power.is_finite();
        let (right, up) = orthonormal_basis(axis);
        usable.then_some(Self { light, kind, origin, axes: [right, up, axis], near: NEAR * unit })
    }

    pub(crate) const fn shape(&self) -> Shape {
        match self.kind {
            Kind::Cone(_) | Kind::Beam(_) => Shape::Disc,
            Kind::Sphere => Shape::Sphere,
        }
    }

    fn local(&self, v: Vec3) -> DVec3 {
        let v = v.as_dvec3();
        DVec3::from(self.axes.map(|a| a.as_dvec3().dot(v)))
    }

    /// The point of the domain in which the light sees the world position `p`; `None` outside of its domain.
    pub(crate) fn point_of(&self, p: Vec3) -> Option<DVec3> {
        match &self.kind {
            Kind::Beam(radius) => {
                let v = self.local(p - self.origin) / f64::from(*radius);
                self.shape().accept(v)
            }
            Kind::Cone(_) | Kind::Sphere => self.point_towards(p - self.origin),
        }
    }

    /// The same for a direction away from a spot or point light, of any length.
    fn point_towards(&self, v: Vec3) -> Option<DVec3> {
        let w = Shape::Sphere.accept(self.local(v))?;
        match &self.kind {
            Kind::Cone(cone) => cone.point(w),
            Kind::Sphere => Some(w),
            Kind::Beam(_) => None,
        }
    }

    /// What to remember of a point of the domain where the light meets nothing, so that [`Frame::point_of_empty`]
    /// finds it from wherever the light moves: a direction; for a directional light a position.
    pub(crate) fn empty_at(&self, point: DVec3) -> Vec3 {
        match self.kind {
            Kind::Beam(_) => self.ray(point).origin,
            Kind::Cone(_) | Kind::Sphere => self.ray(point).direction,
        }
    }

    pub(crate) fn point_of_empty(&self, v: Vec3) -> Option<DVec3> {
        match self.kind {
            Kind::Beam(_) => self.point_of(v),
            Kind::Cone(_) | Kind::Sphere => self.point_towards(v),
        }
    }

    /// The ray of light of a point of the domain; its direction is a unit vector.
    pub(crate) fn ray(&self, point: DVec3) -> Ray {
        let world = |v: DVec3| {
            let [r, u, a] = self.axes.map(Vec3::as_dvec3);
            (r * v.x + u * v.y + a * v.z).as_vec3()
        };
        match &self.kind {
            Kind::Beam(radius) => {
                let start = point.truncate().extend(-1.0) * f64::from(*radius);
                Ray::new(self.origin + world(start), self.axes[2])
            }
            Kind::Cone(cone) => self.ray_towards(world(cone.direction(point)).normalize()),
            Kind::Sphere => self.ray_towards(world(point).normalize()),
        }
    }

    fn ray_towards(&self, w: Vec3) -> Ray {
        Ray::new(self.origin + w * self.near, w)
    }

    /// Unit vector towards the light and distance to it, infinite for a directional light. `None` too near to it.
    pub(crate) fn towards(&self, p: Vec3) -> Option<(Vec3, f32)> {
        if let Kind::Beam(_) = self.kind {
            return Some((-self.axes[2], f32::INFINITY));
        }
        let v = self.origin - p;
        let distance = v.length();
        (distance > self.near && distance.is_finite()).then(|| (v / distance, distance))
    }

    /// The segment from `p` towards the light along which nothing may stand.
    pub(crate) fn shadow_ray(&self, p: Vec3, towards: Vec3, distance: f32) -> Ray {
        if distance.is_infinite() {
            return Ray::new(p, towards);
        }
        let v = self.origin - p;
        let length = v.length().max(f32::MIN_POSITIVE);
        Ray { t_max: (1.0 - self.near / length).max(0.0), ..Ray::new(p, v) }
    }

    /// What the Voronoi cells hold, for [`Pattern::cells`](crate::pattern::Pattern::cells): flux per unit of power,
    /// and solid angle (sr), or the area across a directional light (m²).
    pub(crate) fn held(&self, s: f64) -> [f64; 2] {
        match &self.kind {
            Kind::Cone(cone) => cone.held(s),
            // The sphere's cells are solid angles already.
            Kind::Sphere => [0.0; 2],
            Kind::Beam(radius) => [PI * f64::from(*radius).powi(2); 2],
        }
    }

    /// Area of the surface that a cell covers, m².
    pub(crate) fn footprint(&self, across: f64, distance: f32, cosine: f32) -> f32 {
        let spread = if distance.is_infinite() { 1.0 } else { distance * distance };
        across as f32 * spread / cosine.max(rsm::cpu::MIN_FOOTPRINT_COSINE)
    }
}

/// The directions of a spot light and the flux among them.
///
/// In `v = 1 − cosθ` the falloff of `KHR_lights_punctual` is `1` up to `flat` and `((rim − v)/soft)²` from there to
/// the rim. Everything is divided by 2π sr.
#[derive(Debug, Clone, Copy)]
struct Cone {
    rim: f64,
    soft: f64,
    flat: f64,
    flux: f64,
    density: Density,
}

impl Cone {
    fn new(inner: f64, outer: f64, density: Density) -> Option<Self> {
        let versine = |angle: f64| 2.0 * (0.5 * angle).sin().powi(2);
        if !(outer > 0.0 && outer <= PI && inner.is_finite()) {
            return None;
        }
        let rim = versine(outer);
        let soft = (rim - versine(inner.clamp(0.0, outer))).max(0.001);
        let flat = (rim - soft).max(0.0);
        let mut cone = Self { rim, soft, flat, flux: 0.0, density };
        cone.flux = cone.flux_within(rim);
        (cone.flux > 0.0).then_some(cone)
    }

    /// Flux up to `v` per unit of power.
    fn flux_within(&self, v: f64) -> f64 {
        if v <= self.flat {
            return v;
        }
        let (a, b) = (self.rim - self.flat, (self.rim - v).max(0.0));
        self.flat + (a.powi(3) - b.powi(3)) / (3.0 * self.soft * self.soft)
    }

    /// `v` at the squared radius `s` of the disc.
    fn versine(&self, s: f64) -> f64 {
        match self.density {
            // The inverse of `flux_within`, from the flux that is left where it fades out: exact at the rim.
            Density::Flux if s * self.flux <= self.flat => s * self.flux,
            Density::Flux => {
                let left = 3.0 * self.soft * self.soft * self.flux * (1.0 - s).max(0.0);
                self.rim - left.cbrt()
            }
            Density::SolidAngle => s * self.rim,
        }
    }

    /// The point of the disc of the unit direction `w` in the light's frame; `None` outside of the cone.
    fn point(&self, w: DVec3) -> Option<DVec3> {
        let across = w.truncate();
        let square = across.length_squared();
        // 1 − cosθ from the sine where that keeps its digits.
        let v = if w.z > 0.0 { square / (1.0 + w.z) } else { 1.0 - w.z };
        if v >= self.rim {
            return None;
        }
        let s = match self.density {
            Density::Flux => self.flux_within(v) / self.flux,
            Density::SolidAngle => v / self.rim,
        };
        let p = if square > 0.0 { across * (s / square).sqrt() } else { across };
        Shape::Disc.accept(p.extend(0.0))
    }

    /// The inverse of [`Cone::point`].
    fn direction(&self, p: DVec3) -> DVec3 {
        let s = p.truncate().length_squared();
        let v = self.versine(s.min(1.0));
        let sine = (v * (2.0 - v)).max(0.0).sqrt();
        let across = if s > 0.0 { p.truncate() * (sine / s.sqrt()) } else { p.truncate() };
        across.extend(1.0 - v)
    }

    /// Flux per unit of power and solid angle within the squared radius `s`, divided by `s`.
    fn held(&self, s: f64) -> [f64; 2] {
        let s = s.max(AXIS);
        match self.density {
            Density::Flux => [TAU * self.flux, TAU * self.versine(s) / s],
            Density::SolidAngle => [TAU * self.flux_within(s * self.rim) / s, TAU * self.rim],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cones_map_there_and_back_and_hold_their_flux() {
        for (inner, outer) in [
            (0.0, 0.5),
            (0.35, 0.7),
            (0.4, 0.4),
            (0.0, 0.02),
            (1.0, core::f64::consts::FRAC_PI_2),
            (0.3, 2.5),
        ] {
            for &density in Density::ALL {
                let cone = Cone::new(inner, outer, density).expect("a cone");
                for i in 0..200 {
                    let (r, phi) = (f64::from(i).sqrt() * 0.07, f64::from(i) * 2.4);
                    let p = DVec3::new(r * phi.cos(), r * phi.sin(), 0.0);
                    let w = cone.direction(p);
                    assert!((w.length() - 1.0).abs() < 1e-14);
                    // Near the rim the flux flattens: the cube root of f64's 1e-16.
                    let back = cone.point(w).expect("inside");
                    assert!(back.distance(p) < 1e-9, "{inner} {outer} {density:?}: {p} {back}");
                }
                // The rule of midpoints over the falloff itself, 1e5 steps: its kinks cost at most 1/steps² of the
                // whole.
                let steps = 100_000;
                let sum: f64 = (0..steps)
                    .map(|i| {
                        let v = (f64::from(i) + 0.5) / f64::from(steps) * cone.rim;
                        ((cone.rim - v) / cone.soft).clamp(0.0, 1.0).powi(2)
                    })
                    .sum();
                let flux = sum * cone.rim / f64::from(steps);
                let [held, angle] = cone.held(1.0);
                assert!((held / (TAU * flux) - 1.0).abs() < 1e-6, "{inner} {outer}: {held}");
                assert!((angle / (TAU * (1.0 - outer.cos())) - 1.0).abs() < 1e-6);
            }
        }
        assert!(
            Cone::new(0.0, 0.0, Density::Flux).is_none() && Cone::new(0.1, f64::NAN, Density::Flux).is_none()
        );
    }
}
