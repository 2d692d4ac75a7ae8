//! The scene as paths from the camera and from the lights see it: its surfaces and lights, and rays between them.

use glam::Vec3;
use indirect_accel::Accel;
use indirect_core::{Aabb, Hit, Ray, math};

use crate::{
    Settings,
    emitters::Emitters,
    lights::{Contribution, Lights},
    surfaces::{Lobe, Surfaces, Vertex},
};

/// A shadow ray towards a punctual light ends this share of the way before it, so that a light that sits on a surface is
/// not shadowed by it.
const SHADOW_END: f32 = 1.0 - 1.0 / 65536.0;

/// Everything a path needs to know about the scene.
#[derive(Debug)]
pub(crate) struct Tracer<'a> {
    pub(crate) accel: &'a Accel<'a>,
    pub(crate) surfaces: Surfaces<'a>,
    pub(crate) emitters: Emitters,
    pub(crate) lights: Lights,
    /// Scale of ray offsets.
    pub(crate) unit: f32,
    pub(crate) bounds: Option<Aabb>,
    /// Most indirect bounces.
    pub(crate) limit: u32,
    pub(crate) settings: Settings,
}

impl<'a> Tracer<'a> {
    pub(crate) fn new(accel: &'a Accel<'a>, settings: Settings) -> Self {
        let scene = accel.scene();
        Self {
            accel,
            surfaces: Surfaces::new(scene),
            emitters: Emitters::new(scene),
            lights: Lights::new(scene),
            unit: accel.unit(),
            bounds: scene.bounds(),
            limit: if settings.components.indirect() { settings.bounces.limit() } else { 0 },
            settings,
        }
    }

    /// Whether paths add anything to what [`Tracer::seen`] and [`Tracer::lit`] know of a vertex.
    pub(crate) fn needs_paths(&self) -> bool {
        let indirect = self.limit > 0 && !(self.emitters.is_empty() && self.lights.len() == 0);
        indirect || (self.settings.components.direct() && !self.emitters.is_empty())
    }

    /// The surface that a camera ray sees.
    pub(crate) fn seen(&self, ray: &Ray, rays: &mut u64) -> Option<Vertex> {
        *rays += 1;
        self.accel.closest_hit(ray).map(|hit| self.surfaces.vertex(&hit, ray.direction))
    }

    /// Radiance reflected at a vertex from all punctual lights, exactly.
    pub(crate) fn lit(&self, vertex: &Vertex, rays: &mut u64) -> Vec3 {
        let lobe = Lobe::new(vertex);
        let lights = (0..self.lights.len()).filter_map(|i| self.lights.contribution(i, vertex, &lobe));
        let mut sum = Vec3::ZERO;
        for c in lights {
            sum += self.unshadowed(vertex, &c, rays);
        }
        sum * vertex.albedo
    }

    /// What a punctual light adds, unless something stands before it.
    pub(crate) fn unshadowed(&self, vertex: &Vertex, c: &Contribution, rays: &mut u64) -> Vec3 {
        let origin = self.leaving(vertex);
        let ray = if c.distance.is_finite() {
            // From the offset origin, so that the ray still ends at the light.
            let light = vertex.position + c.direction * c.distance;
            Ray { origin, direction: light - origin, t_max: SHADOW_END }
        } else {
            Ray::new(origin, c.direction)
        };
        *rays += 1;
        if self.accel.any_hit(&ray) { Vec3::ZERO } else { c.radiance }
    }

    /// Where rays that leave `vertex` start.
    #[inline]
    pub(crate) fn leaving(&self, vertex: &Vertex) -> Vec3 {
        math::offset_ray_origin_scaled(vertex.position, vertex.geometric, self.unit)
    }

    /// Whether anything stands between `vertex` and `target`, a point off its surface.
    #[inline]
    pub(crate) fn blocked(&self, vertex: &Vertex, target: Vec3, rays: &mut u64) -> bool {
        let origin = self.leaving(vertex);
        *rays += 1;
        self.accel.any_hit(&Ray { origin, direction: target - origin, t_max: 1.0 })
    }

    /// What a ray from `vertex` along `w` meets first.
    #[inline]
    pub(crate) fn leave(&self, vertex: &Vertex, w: Vec3, rays: &mut u64) -> Option<Hit> {
        *rays += 1;
        self.accel.closest_hit(&Ray::new(self.leaving(vertex), w))
    }
}
