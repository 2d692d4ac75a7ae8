//! Light paths that all pixels of a batch share, and the split of transport between them and camera paths.
//!
//! Indirect light `ρ ∫ L(y) k(x, y) dA` arrives through the kernel `k = p(ω)·cosθ_y/(π d²)`, `p` being the receiver's lobe. Points `y` of
//! light paths, as virtual point lights, sample it well where it is small and even; where it is large (corners), single
//! points stand out. So it is split without bias, `k = k·b/(b + k) + k·k/(b + k)`: virtual lights carry the first part,
//! which is bounded by `b = 1/A`, and camera paths the second, by going on from the next surface with probability `k/(b + k)` (after Kollig
//! & Keller 2004, "Illumination in the Presence of Weak Singularities", with a smooth bound).

use core::{
    f32::consts::{FRAC_1_PI, PI},
    sync::atomic::{AtomicU64, Ordering},
};

use glam::{Vec2, Vec3};
use indirect_core::form_factor::{bounded, unbounded_share};
use indirect_core::{Aabb, LightKind, Ray, math};
use indirect_sampling::mapping;
use rayon::prelude::*;

use crate::{
    sampler::Sampler,
    surfaces::{Lobe, Vertex},
    tracer::Tracer,
};

/// Light paths per work item.
const CHUNK: u32 = 32;

/// How light is split between virtual lights and paths.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plan {
    /// One over the kernel of which virtual lights carry half, m².
    pub(crate) area: f32,
    /// Virtual lights per sample.
    pub(crate) connections: u32,
}

/// A point of a path from a light.
#[derive(Debug, Clone, Copy)]
struct Vpl {
    position: Vec3,
    /// Unit normal of the plane, on the side that was lit.
    normal: Vec3,
    /// Reflected flux, W, divided by the number of light paths.
    flux: Vec3,
}

/// The virtual lights of one batch.
#[derive(Debug)]
pub(crate) struct Pool {
    pub(crate) plan: Plan,
    /// Along a space-filling curve, so that every n-th is a stratified choice.
    vpls: Vec<Vpl>,
}

/// The virtual lights that one sample of a pixel uses.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Draw<'a> {
    pool: &'a Pool,
    at: f64,
    step: f64,
}

impl<'a> Draw<'a> {
    /// For one of the `samples` of a pixel in a batch, which together step evenly through the pool from a random `offset`
    /// in `[0, 1)` of a step: every virtual light is as likely as any other.
    pub(crate) fn new(pool: &'a Pool, sample: u32, samples: u32, offset: f32) -> Self {
        let connections = pool.plan.connections;
        let step = 1.0 / (f64::from(samples) * f64::from(connections));
        Self { pool, at: (f64::from(sample) * f64::from(connections) + f64::from(offset)) * step, step }
    }

    /// Radiance that `vertex` reflects per albedo from some virtual lights, scaled to all of them.
    #[inline]
    pub(crate) fn light(&self, tracer: &Tracer<'_>, vertex: &Vertex, lobe: &Lobe, rays: &mut u64) -> Vec3 {
        let Pool { plan, vpls } = self.pool;
        let Some(last) = vpls.len().checked_sub(1) else { return Vec3::ZERO };
        let n = vpls.len() as f64;
        let mut sum = Vec3::ZERO;
        for k in 0..plan.connections {
            let i = ((self.at + self.step * f64::from(k)) * n) as usize;
            sum += connect(tracer, vertex, lobe, &vpls[i.min(last)], plan.area, rays);
        }
        sum * (n as f32 / plan.connections as f32)
    }

    /// The share of the light from `next`, met along `w`, to `vertex` that paths carry.
    #[inline]
    pub(crate) fn kept(&self, vertex: &Vertex, lobe: &Lobe, w: Vec3, next: &Vertex) -> f32 {
        let d2 = next.position.distance_squared(vertex.position);
        let kernel = lobe.density(w) * -next.geometric.dot(w) * FRAC_1_PI / d2;
        unbounded_share(kernel, self.pool.plan.area)
    }
}

impl Pool {
    /// Follows `paths` paths from the lights.
    pub(crate) fn trace(tracer: &Tracer<'_>, plan: Plan, paths: u32, seed: u32, rays: &AtomicU64) -> Self {
        let share = 1.0 / paths as f32;
        let parts: Vec<Vec<Vpl>> = (0..paths.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let (mut vpls, mut traced) = (Vec::new(), 0);
                let first = chunk * CHUNK;
                for i in first..(first + CHUNK).min(paths) {
                    light_path(tracer, &mut Sampler::new(seed, i), share, &mut vpls, &mut traced);
                }
                rays.fetch_add(traced, Ordering::Relaxed);
                vpls
            })
            .collect();
        let mut vpls = parts.concat();
        if let Some(bounds) = Aabb::of(vpls.iter().map(|v| v.position)) {
            let scale = 1023.0 / bounds.extent().max_element().max(f32::MIN_POSITIVE);
            vpls.sort_by_cached_key(|v| morton((v.position - bounds.min) * scale));
        }
        Self { plan, vpls }
    }
}

/// Adds the vertices of one path from a light; `share`: 1 / number of paths.
fn light_path(tracer: &Tracer<'_>, sampler: &mut Sampler, share: f32, vpls: &mut Vec<Vpl>, rays: &mut u64) {
    let Some((mut ray, mut flux, light)) = emit(tracer, sampler) else { return };
    if flux == Vec3::ZERO {
        return;
    }
    flux *= share;
    let start = flux.max_element();
    for order in 0..tracer.limit {
        *rays += 1;
        let Some(hit) = tracer.accel.closest_hit(&ray) else { return };
        let vertex = tracer.surfaces.vertex(&hit, ray.direction);
        if order == 0
            && let Some(light) = light
        {
            flux *= tracer.lights.get(light).range_window(hit.t);
        }
        let back = -ray.direction;
        let cos = vertex.geometric.dot(back);
        // The adjoint of a path from the eye: what arrived is reflected by the lobe, and leaves by the plane's normal.
        flux *= vertex.albedo * (Lobe::new(&vertex).density(back) * PI / cos);
        if cos <= 0.0 || flux == Vec3::ZERO || !flux.is_finite() {
            return;
        }
        vpls.push(Vpl { position: vertex.position, normal: vertex.geometric, flux });
        let survival = (flux.max_element() / start).min(MAX_SURVIVAL);
        if sampler.next() >= survival {
            return;
        }
        flux /= survival;
        let flat = Vertex { shading: vertex.geometric, ..vertex };
        let u = if order < 2 { sampler.pair(order + 2) } else { sampler.next_pair() };
        let Some(w) = Lobe::new(&flat).sample(u, || Vec2::ZERO) else { return };
        ray = Ray::new(tracer.leaving(&vertex), w);
    }
}

/// A ray of light with its flux, W, and the point or spot light that it comes from, whose range may end it.
fn emit(tracer: &Tracer<'_>, sampler: &mut Sampler) -> Option<(Ray, Vec3, Option<usize>)> {
    let (u, v) = (sampler.pair(0), sampler.pair(1));
    let to_world = |l: Vec3, axis: Vec3| {
        let (t, b) = math::orthonormal_basis(axis);
        t * l.x + b * l.y + axis * l.z
    };
    let share = (tracer.emitters.flux() / (tracer.emitters.flux() + tracer.lights.flux())) as f32;
    if sampler.next() < share {
        let point = tracer.emitters.sample(tracer.surfaces.scene(), u, || sampler.next());
        let back = point.two_sided && sampler.next() < 0.5;
        let normal = if back { -point.normal } else { point.normal };
        let sides = if point.two_sided { 2.0 } else { 1.0 };
        let flux = point.radiance * (sides * PI * point.inverse_density / share);
        let origin = math::offset_ray_origin_scaled(point.position, normal, tracer.unit);
        return Some((Ray::new(origin, to_world(mapping::hemisphere_cosine(v), normal)), flux, None));
    }
    let (i, probability) = tracer.lights.candidate(sampler.next())?;
    let light = tracer.lights.get(i);
    let (ray, flux) = match light.kind {
        LightKind::Point { position } => {
            (Ray::new(position, mapping::sphere_uniform(u)), light.power * (4.0 * PI))
        }
        LightKind::Spot { position, direction, outer_angle, .. } => {
            let one_minus_cos = 1.0 - outer_angle.cos();
            let w = to_world(mapping::cone_uniform(u, one_minus_cos), direction);
            (Ray::new(position, w), light.intensity(w) * (2.0 * PI * one_minus_cos))
        }
        LightKind::Directional { direction } => {
            // A disc before the scene that covers its bounding sphere.
            let bounds = tracer.bounds?;
            let radius = 0.5 * bounds.diagonal();
            let at = to_world((mapping::disc_concentric(u) * radius).extend(-1.01 * radius), direction);
            (Ray::new(bounds.centre() + at, direction), light.power * (PI * radius * radius))
        }
    };
    let positional = light.position().map(|_| i);
    Some((ray, flux / (probability * (1.0 - share)), positional))
}

/// Radiance that `vertex` reflects per albedo from one virtual light: the part that virtual lights carry.
fn connect(tracer: &Tracer<'_>, vertex: &Vertex, lobe: &Lobe, vpl: &Vpl, area: f32, rays: &mut u64) -> Vec3 {
    let to = vpl.position - vertex.position;
    let d2 = to.length_squared();
    let w = to * d2.sqrt().recip();
    let kernel = lobe.density(w) * -vpl.normal.dot(w) * FRAC_1_PI / d2;
    // False for NaN too. A coincident point has no kernel; paths carry all of it.
    if !(kernel > 0.0 && kernel.is_finite()) {
        return Vec3::ZERO;
    }
    let carried = bounded(kernel, area);
    let target = math::offset_ray_origin_scaled(vpl.position, vpl.normal, tracer.unit);
    let blocked = !tracer.settings.unoccluded && tracer.blocked(vertex, target, rays);
    if blocked { Vec3::ZERO } else { vpl.flux * carried }
}

/// Light paths in a closed scene of albedo 1 must end, and a long one adds a virtual light at every step.
const MAX_SURVIVAL: f32 = 0.99;

/// Interleaves the low ten bits of three coordinates.
fn morton(p: Vec3) -> u32 {
    let spread = |v: f32| {
        let mut x = v as u32 & 0x3ff;
        x = (x | x << 16) & 0x0300_00ff;
        x = (x | x << 8) & 0x0300_f00f;
        x = (x | x << 4) & 0x030c_30c3;
        (x | x << 2) & 0x0924_9249
    };
    spread(p.x) | spread(p.y) << 1 | spread(p.z) << 2
}
