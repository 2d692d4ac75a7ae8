//! Light paths that all pixels of a batch share, and the split of transport between them and camera paths.
//!
//! Indirect light `ρ ∫ L(y) k(x, y) dA` arrives through the kernel `k = p(ω)·cosθ_y/(π d²)`, `p` being the receiver's lobe. Points `y` of
//! light paths, as virtual point lights, sample it well where it is small and even; where it is large (corners), single
//! points stand out. So it is split without bias, `k = k·b/(b + k) + k·k/(b + k)`: virtual lights carry the first part,
//! which is bounded by `b`, and camera paths the second, by going on from the next surface with probability `k/(b + k)` (after Kollig
//! & Keller 2004, "Illumination in the Presence of Weak Singularities", with a smooth bound).

use core::{
    f32::consts::{FRAC_1_PI, PI},
    sync::atomic::{AtomicU64, Ordering},
};

use glam::{DVec3, Vec2, Vec3};
use indirect_core::{Aabb, LightKind, Ray, math};
use indirect_sampling::{mapping, rng::hash_combine};
use rayon::prelude::*;

use crate::{
    EmitterSampling, VirtualLights,
    path::Tracer,
    render::{CHUNK, Raster},
    sampler::Sampler,
    surfaces::{Lobe, Vertex},
};

/// How light is split between virtual lights and paths.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plan {
    /// Kernel of which virtual lights carry half, m⁻².
    bound: f32,
    /// Virtual lights per sample.
    connections: u32,
}

/// Bound in units of `1/(π·area of the scene)`, the kernel's mean over a convex room, and virtual lights per sample.
const PLANS: [(f32, u32); 2] = [(40.0, 4), (100.0, 8)];

/// The trial that chooses: its batches, their most samples, its most pixels and its fewest. Bright spots that few pixels see
/// decide: many pixels tell more than many samples.
const TRIAL_BATCHES: u32 = 4;
const TRIAL_SAMPLES: u32 = 16;
const TRIAL_PIXELS: usize = 4096;
const TRIAL_LEAST: usize = 128;

/// The trial's pixels are this share of those that one batch has of as many samples, and its fewest may be that share: three plans of
/// four batches cost 5 %, at worst 19 %, of one batch, and an eighth of that where there are the usual eight. The number of
/// batches must not count: parts that are to be merged need the same plan.
const TRIAL_SHARE: usize = 256;
const TRIAL_LEAST_SHARE: usize = 64;

/// Time of a ray where virtual lights are used, in units of one where they are not: shadow rays end at the first hit.
const SHARED_RAY: f64 = 0.85;

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
    plan: Plan,
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
}

impl Raster<'_> {
    /// Whether to use virtual lights, and how: what has the least variance per ray in a short trial with samples of its own. The same
    /// for every range of batches.
    pub(crate) fn plan(&self, rays: &AtomicU64) -> Option<Plan> {
        let tracer = self.tracer;
        let settings = tracer.settings;
        let lit = tracer.lights.len() > 0 || !tracer.emitters.is_empty();
        // Without visibility, light of later bounces would reach virtual lights that no light path meets.
        let applies = settings.emitters == EmitterSampling::Mis
            && if settings.unoccluded { tracer.limit() == 1 } else { tracer.limit() > 0 };
        if !applies || !lit {
            return None;
        }
        let mesh = &tracer.surfaces.scene().mesh;
        let area: f64 = (0..mesh.triangles.len() as u32).map(|t| f64::from(mesh.area(t))).sum();
        let plan = |(scale, connections)| Plan { bound: scale / (PI * area as f32), connections };
        let count = self.count();
        let samples = settings.samples.batch.min(TRIAL_SAMPLES);
        let longer = (settings.samples.batch / samples) as usize;
        let batch = count.saturating_mul(longer);
        let pixels = (batch / TRIAL_SHARE).clamp(TRIAL_LEAST, TRIAL_PIXELS).min(count);
        match settings.virtual_lights {
            VirtualLights::Off => return None,
            VirtualLights::On => return Some(plan(PLANS[0])),
            VirtualLights::Auto if batch / TRIAL_LEAST_SHARE < TRIAL_LEAST => return None,
            VirtualLights::Auto => {}
        }
        let mut pools: Vec<Pool> = (0..TRIAL_BATCHES)
            .map(|batch| {
                tracer.pool(plan(PLANS[0]), self.light_paths(), hash_combine(settings.seed, !batch), rays)
            })
            .collect();
        // One at random in each equal share of the image: even steps would follow its columns.
        let pixel = |p: usize| {
            let offset = (u64::from(hash_combine(!settings.seed, p as u32)) * count as u64) >> 32;
            (p * count + offset as usize) / pixels
        };
        let mut cost = |plan: Option<Plan>| {
            if let Some(plan) = plan {
                pools.iter_mut().for_each(|pool| pool.plan = plan);
            }
            let chunks = pixels.div_ceil(CHUNK);
            let sums: Vec<(f64, u64)> = (0..chunks)
                .into_par_iter()
                .map(|chunk| {
                    let (mut variance, mut traced) = (0.0, 0);
                    for p in chunk * CHUNK..((chunk + 1) * CHUNK).min(pixels) {
                        let (mut sum, mut squares) = (0.0, 0.0);
                        for (batch, pool) in pools.iter().enumerate() {
                            let pool = plan.is_some().then_some(pool);
                            let (_, indirect): (_, DVec3) =
                                self.batch(pixel(p), !(batch as u32), samples, pool, &mut false, &mut traced);
                            let luminance = f64::from(math::luminance(indirect.as_vec3()));
                            sum += luminance;
                            squares += luminance * luminance;
                        }
                        variance += squares - sum * sum / f64::from(TRIAL_BATCHES);
                    }
                    (variance, traced)
                })
                .collect();
            let (variance, traced) = sums.iter().fold((0.0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
            rays.fetch_add(traced, Ordering::Relaxed);
            variance * traced as f64 * if plan.is_some() { SHARED_RAY } else { 1.0 }
        };
        let mut best = (None, cost(None));
        for candidate in PLANS.map(plan) {
            let cost = cost(Some(candidate));
            if cost < best.1 {
                best = (Some(candidate), cost);
            }
        }
        best.0
    }
}

impl Tracer<'_> {
    /// Follows `paths` paths from the lights.
    pub(crate) fn pool(&self, plan: Plan, paths: u32, seed: u32, rays: &AtomicU64) -> Pool {
        let parts: Vec<Vec<Vpl>> = (0..paths.div_ceil(CHUNK as u32))
            .into_par_iter()
            .map(|chunk| {
                let (mut vpls, mut traced) = (Vec::new(), 0);
                let first = chunk * CHUNK as u32;
                for i in first..(first + CHUNK as u32).min(paths) {
                    self.light_path(&mut Sampler::new(seed, i), 1.0 / paths as f32, &mut vpls, &mut traced);
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
        Pool { plan, vpls }
    }

    fn light_path(&self, sampler: &mut Sampler, share: f32, vpls: &mut Vec<Vpl>, rays: &mut u64) {
        let Some((mut ray, mut flux, light)) = self.emit(sampler) else { return };
        if flux == Vec3::ZERO {
            return;
        }
        flux *= share;
        let start = flux.max_element();
        for order in 0..self.limit() {
            *rays += 1;
            let Some(hit) = self.accel().closest_hit(&ray) else { return };
            let vertex = self.surfaces.vertex(&hit, ray.direction);
            if order == 0
                && let Some(light) = light
            {
                flux *= self.lights.get(light).range_window(hit.t);
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
            ray = Ray::new(self.leaving(&vertex), w);
        }
    }

    /// A ray of light with its flux, W, and the point or spot light that it comes from, whose range may end it.
    fn emit(&self, sampler: &mut Sampler) -> Option<(Ray, Vec3, Option<usize>)> {
        let (u, v) = (sampler.pair(0), sampler.pair(1));
        let to_world = |l: Vec3, axis: Vec3| {
            let (t, b) = math::orthonormal_basis(axis);
            t * l.x + b * l.y + axis * l.z
        };
        let share = (self.emitters.flux() / (self.emitters.flux() + self.lights.flux())) as f32;
        if sampler.next() < share {
            let point = self.emitters.sample(self.surfaces.scene(), u, || sampler.next());
            let back = point.two_sided && sampler.next() < 0.5;
            let normal = if back { -point.normal } else { point.normal };
            let sides = if point.two_sided { 2.0 } else { 1.0 };
            let flux = point.radiance * (sides * PI * point.inverse_density / share);
            let origin = math::offset_ray_origin_scaled(point.position, normal, self.unit());
            return Some((Ray::new(origin, to_world(mapping::hemisphere_cosine(v), normal)), flux, None));
        }
        let (i, probability) = self.lights.candidate(sampler.next())?;
        let light = self.lights.get(i);
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
                let bounds = self.bounds()?;
                let radius = 0.5 * bounds.diagonal();
                let at = to_world((mapping::disc_concentric(u) * radius).extend(-1.01 * radius), direction);
                (Ray::new(bounds.centre() + at, direction), light.power * (PI * radius * radius))
            }
        };
        let positional = light.position().map(|_| i);
        Some((ray, flux / (probability * (1.0 - share)), positional))
    }

    /// Radiance that `vertex` reflects per albedo from some virtual lights, scaled to all of them.
    #[inline]
    pub(crate) fn shared(&self, vertex: &Vertex, lobe: &Lobe, draw: &Draw<'_>, rays: &mut u64) -> Vec3 {
        let Pool { plan, vpls } = draw.pool;
        let Some(last) = vpls.len().checked_sub(1) else { return Vec3::ZERO };
        let n = vpls.len() as f64;
        let mut sum = Vec3::ZERO;
        for k in 0..plan.connections {
            let i = ((draw.at + draw.step * f64::from(k)) * n) as usize;
            sum += self.connect(vertex, lobe, &vpls[i.min(last)], plan.bound, rays);
        }
        sum * (n as f32 / plan.connections as f32)
    }

    fn connect(&self, vertex: &Vertex, lobe: &Lobe, vpl: &Vpl, bound: f32, rays: &mut u64) -> Vec3 {
        let to = vpl.position - vertex.position;
        let d2 = to.length_squared();
        let w = to * d2.sqrt().recip();
        let kernel = lobe.density(w) * -vpl.normal.dot(w) * FRAC_1_PI / d2;
        // False for NaN too. A coincident point has no kernel; paths carry all of it.
        if !(kernel > 0.0 && kernel.is_finite()) {
            return Vec3::ZERO;
        }
        let carried = kernel * bound / (bound + kernel);
        let target = math::offset_ray_origin_scaled(vpl.position, vpl.normal, self.unit());
        let blocked = !self.settings.unoccluded && self.blocked(vertex, target, rays);
        if blocked { Vec3::ZERO } else { vpl.flux * carried }
    }

    /// The share of the light from `next`, met along `w`, to `vertex` that paths carry.
    #[inline]
    pub(crate) fn kept(&self, vertex: &Vertex, lobe: &Lobe, w: Vec3, next: &Vertex, draw: &Draw<'_>) -> f32 {
        let d2 = next.position.distance_squared(vertex.position);
        let kernel = lobe.density(w) * -next.geometric.dot(w) * FRAC_1_PI / d2;
        let bound = draw.pool.plan.bound;
        if kernel.is_finite() { kernel.max(0.0) / (bound + kernel.max(0.0)) } else { 1.0 }
    }
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
