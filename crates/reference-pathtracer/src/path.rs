//! Paths from the camera.

use glam::Vec3;
use indirect_core::{Hit, math};

use crate::{
    EmitterSampling, Settings,
    sampler::Sampler,
    surfaces::{Lobe, Vertex},
    tracer::Tracer,
    vpls::Draw,
};

/// Vertices whose decisions come from low-discrepancy points; later ones matter too little to be worth their cost.
const STRATIFIED: u32 = 3;

/// The most surfaces that one unoccluded ray pierces: only so that no input can hang it.
const PIERCED: usize = 1 << 14;

/// Radiance found by one path.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Found {
    pub(crate) direct: Vec3,
    pub(crate) indirect: Vec3,
}

impl Tracer<'_> {
    /// Follows one path from a visible surface. `punctual_lit`: punctual lights on that surface are already known; `draw`: the virtual
    /// lights to use.
    pub(crate) fn path(
        &self,
        seen: &Vertex,
        punctual_lit: bool,
        draw: Option<Draw<'_>>,
        sampler: &mut Sampler,
        rays: &mut u64,
    ) -> Found {
        let Settings { components, unoccluded, roulette, emitters: strategy, .. } = self.settings;
        let mut found = Found::default();
        let mut vertex = *seen;
        // Albedos so far over survival probabilities.
        let mut throughput = Vec3::ONE;
        // Light that is reflected at `vertex` has made so many indirect bounces.
        let mut order = 0;
        loop {
            let wanted = order > 0 || components.direct();
            let lobe = Lobe::new(&vertex);
            throughput *= vertex.albedo;
            if throughput == Vec3::ZERO {
                return found;
            }
            if wanted {
                let mut light = self.emitted(&vertex, &lobe, order, sampler, rays);
                if order > 0 || !punctual_lit {
                    light += self.punctual(&vertex, &lobe, sampler, rays);
                }
                found.add(order, throughput * light);
            }
            if order == 0
                && let Some(draw) = &draw
            {
                found.indirect += throughput * draw.light(self, &vertex, &lobe, rays);
            }
            // Beyond the last bounce only a direction that meets an emitter still adds something.
            let last = order >= self.limit;
            if last && (!wanted || self.emitters.is_empty() || strategy == EmitterSampling::Light) {
                return found;
            }
            if roulette && order > 0 {
                let survival = (throughput.max_element() * ROULETTE).min(MAX_SURVIVAL);
                let u = if order < STRATIFIED { sampler.single(order) } else { sampler.next() };
                if u >= survival {
                    return found;
                }
                throughput /= survival;
            }
            let u = if order < STRATIFIED { sampler.pair(2 * order) } else { sampler.next_pair() };
            let Some(w) = lobe.sample(u, || sampler.next_pair()) else { return found };
            let Some(hit) = self.leave(&vertex, w, rays) else { return found };
            let next = self.surfaces.vertex(&hit, w);
            if wanted && next.emission != Vec3::ZERO {
                let weight = self.surface_weight(&vertex, &lobe, w, &hit, &next);
                found.add(order, throughput * next.emission * weight);
            }
            if last {
                return found;
            }
            if unoccluded {
                let kept = |far: &Vertex| match &draw {
                    Some(draw) if order == 0 => draw.kept(&vertex, &lobe, w, far),
                    _ => 1.0,
                };
                found.indirect += throughput * self.behind(&next, w, kept, sampler, rays);
            }
            if order == 0
                && let Some(draw) = &draw
                && sampler.single(SPLIT) >= draw.kept(&vertex, &lobe, w, &next)
            {
                // The virtual lights' share.
                return found;
            }
            vertex = next;
            order += 1;
        }
    }

    /// Light from emissive triangles that `vertex` reflects per albedo, from one point drawn on them.
    fn emitted(
        &self,
        vertex: &Vertex,
        lobe: &Lobe,
        order: u32,
        sampler: &mut Sampler,
        rays: &mut u64,
    ) -> Vec3 {
        if self.emitters.is_empty() || self.settings.emitters == EmitterSampling::Surface {
            return Vec3::ZERO;
        }
        let u = if order < STRATIFIED { sampler.pair(2 * order + 1) } else { sampler.next_pair() };
        let point = self.emitters.sample(self.surfaces.scene(), u, || sampler.next());
        let to = point.position - vertex.position;
        let d2 = to.length_squared();
        if d2 < f32::MIN_POSITIVE {
            return Vec3::ZERO;
        }
        let w = to * d2.sqrt().recip();
        let density = lobe.density(w);
        let front = -point.normal.dot(w);
        let cos = if point.two_sided { front.abs() } else { front };
        if density <= 0.0 || cos <= 0.0 || point.radiance == Vec3::ZERO {
            return Vec3::ZERO;
        }
        // 1 / density per steradian of drawing this point.
        let inverse = point.inverse_density * cos / d2;
        let weight = match self.settings.emitters {
            EmitterSampling::Mis => power_heuristic(density * inverse),
            EmitterSampling::Light | EmitterSampling::Surface => 1.0,
        };
        let value = density * inverse * weight;
        if !value.is_finite() {
            return Vec3::ZERO;
        }
        let facing = if front < 0.0 { -point.normal } else { point.normal };
        let target = math::offset_ray_origin_scaled(point.position, facing, self.unit);
        if self.blocked(vertex, target, rays) { Vec3::ZERO } else { point.radiance * value }
    }

    /// The share of emission met by a direction drawn from the lobe that is not left to [`Tracer::emitted`].
    fn surface_weight(&self, vertex: &Vertex, lobe: &Lobe, w: Vec3, hit: &Hit, next: &Vertex) -> f32 {
        match self.settings.emitters {
            EmitterSampling::Surface => 1.0,
            EmitterSampling::Light => 0.0,
            EmitterSampling::Mis => {
                let density = self.emitters.density(self.surfaces.scene(), hit.triangle);
                let cos = -next.geometric.dot(w);
                let d2 = next.position.distance_squared(vertex.position);
                // Density per steradian of drawing the point against that of the direction.
                let ratio = density * d2 / (cos * lobe.density(w));
                if ratio.is_finite() { power_heuristic(ratio) } else { 0.0 }
            }
        }
    }

    /// Light from one punctual light that `vertex` reflects per albedo.
    #[inline]
    fn punctual(&self, vertex: &Vertex, lobe: &Lobe, sampler: &mut Sampler, rays: &mut u64) -> Vec3 {
        if self.lights.len() == 0 {
            return Vec3::ZERO;
        }
        self.lights.draw(vertex, lobe, sampler).map_or(Vec3::ZERO, |c| self.unshadowed(vertex, &c, rays))
    }

    /// Directly lit radiance towards `−w` of every surface that the ray along `w` meets behind `front`, each with the share that
    /// paths carry.
    fn behind(
        &self,
        front: &Vertex,
        w: Vec3,
        kept: impl Fn(&Vertex) -> f32,
        sampler: &mut Sampler,
        rays: &mut u64,
    ) -> Vec3 {
        let mut sum = Vec3::ZERO;
        let mut vertex = *front;
        for _ in 0..PIERCED {
            // Go on from the far side.
            let far = Vertex { geometric: -vertex.geometric, ..vertex };
            let Some(hit) = self.leave(&far, w, rays) else { break };
            vertex = self.surfaces.vertex(&hit, w);
            let share = kept(&vertex);
            if share < 1.0 && sampler.next() >= share {
                continue;
            }
            let lobe = Lobe::new(&vertex);
            let mut light = self.emitted(&vertex, &lobe, STRATIFIED, sampler, rays)
                + self.punctual(&vertex, &lobe, sampler, rays);
            // The emitters' other share: a direction of its own, since the path does not go on from here.
            if !self.emitters.is_empty()
                && self.settings.emitters != EmitterSampling::Light
                && let Some(w) = lobe.sample(sampler.next_pair(), || sampler.next_pair())
                && let Some(hit) = self.leave(&vertex, w, rays)
            {
                let met = self.surfaces.vertex(&hit, w);
                if met.emission != Vec3::ZERO {
                    light += met.emission * self.surface_weight(&vertex, &lobe, w, &hit, &met);
                }
            }
            sum += light * vertex.albedo;
        }
        sum
    }
}

impl Found {
    #[inline]
    fn add(&mut self, order: u32, radiance: Vec3) {
        if order == 0 { self.direct += radiance } else { self.indirect += radiance }
    }
}

/// Weight of a sample whose density is `1/ratio` times that of the other technique: `p²/(p² + q²)`, `q = ratio·p`.
#[inline]
fn power_heuristic(ratio: f32) -> f32 {
    1.0 / (1.0 + ratio * ratio)
}

/// Survival probability per throughput: below 1/2 a path is worth less than its cost. Between 1.5 and 3 the efficiency is flat.
const ROULETTE: f32 = 2.0;

/// Dimension of the choice between virtual lights and going on.
const SPLIT: u32 = 0x100;

/// Paths in a closed scene of albedo 1 must end too.
const MAX_SURVIVAL: f32 = 0.999;
