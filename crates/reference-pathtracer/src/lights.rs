use core::f32::consts::PI;

use glam::Vec3;
use indirect_core::{Light, LightKind, LightSample, Scene, math};

use crate::{
    sampler::Sampler,
    surfaces::{Lobe, Vertex},
};

/// Up to so many lights are all looked at before one is drawn; of more, so many candidates.
const CANDIDATES: usize = 16;

/// Uniform numbers are multiples of 2⁻²⁴.
const GRID: f64 = 16_777_216.0;

/// The punctual lights that have power.
#[derive(Debug)]
pub(crate) struct Lights {
    lights: Vec<Light>,
    /// Running probability of drawing a light as a candidate, ends at 1.
    cumulative: Vec<f32>,
    flux: f64,
}

/// What one light does at a vertex, before visibility.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contribution {
    /// Unit direction to the light.
    pub(crate) direction: Vec3,
    /// Metres, infinite for a directional light.
    pub(crate) distance: f32,
    /// Irradiance times the lobe's density times the weight of the draw: to be multiplied by the albedo.
    pub(crate) radiance: Vec3,
}

impl Lights {
    pub(crate) fn new(scene: &Scene) -> Self {
        let lights: Vec<Light> =
            scene.lights.iter().filter(|l| l.power.max_element() > 0.0).cloned().collect();
        // Flux into the scene, roughly; half of the probability is spread evenly, so that a poor guess is bounded.
        let area = scene.bounds().map_or(1.0, |b| 0.25 * PI * b.diagonal() * b.diagonal());
        let flux = |l: &Light| {
            math::luminance(l.power)
                * match l.kind {
                    LightKind::Directional { .. } => area,
                    LightKind::Point { .. } => 4.0 * PI,
                    LightKind::Spot { outer_angle, .. } => 2.0 * PI * (1.0 - outer_angle.cos()),
                }
        };
        let total: f64 = lights.iter().map(|l| f64::from(flux(l))).sum();
        let mut sum = 0.0;
        let cumulative = lights
            .iter()
            .map(|l| {
                let even = 1.0 / lights.len() as f64;
                let share = if total > 0.0 { f64::from(flux(l)) / total } else { even };
                sum += 0.5 * share + 0.5 * even;
                // On the grid of the uniform numbers, so that a difference is exactly the probability.
                ((sum * GRID).round() / GRID) as f32
            })
            .collect();
        Self { lights, cumulative, flux: total }
    }

    pub(crate) fn len(&self) -> usize {
        self.lights.len()
    }

    pub(crate) fn get(&self, i: usize) -> &Light {
        &self.lights[i]
    }

    /// A light drawn by its flux from a uniform `u`, with the probability of the draw; `None` without lights.
    #[inline]
    pub(crate) fn candidate(&self, u: f32) -> Option<(usize, f32)> {
        let last = self.lights.len().checked_sub(1)?;
        let i = self.cumulative.partition_point(|&c| c <= u).min(last);
        let lo = if i == 0 { 0.0 } else { self.cumulative[i - 1] };
        Some((i, self.cumulative[i] - lo))
    }

    /// Luminance of the flux of all lights into the scene, W, roughly.
    pub(crate) fn flux(&self) -> f64 {
        self.flux
    }

    /// Light `i` at a vertex; `None` where it adds nothing.
    #[inline]
    pub(crate) fn contribution(&self, i: usize, vertex: &Vertex, lobe: &Lobe) -> Option<Contribution> {
        let LightSample { direction, distance, irradiance } = self.lights[i].sample(vertex.position);
        // Not finite: nearer than √f32::MIN_POSITIVE, the light sits in the point.
        if irradiance == Vec3::ZERO || !irradiance.is_finite() {
            return None;
        }
        let density = lobe.density(direction);
        (density > 0.0).then(|| Contribution { direction, distance, radiance: irradiance * density })
    }

    /// One light, drawn in proportion to what it would add without occlusion, and divided by the probability of the draw.
    /// With more than [`CANDIDATES`] lights the draw is among as many candidates (resampled importance sampling, Talbot et al. 2005),
    /// which keeps it unbiased at a bounded cost.
    #[inline]
    pub(crate) fn draw(&self, vertex: &Vertex, lobe: &Lobe, sampler: &mut Sampler) -> Option<Contribution> {
        let n = self.lights.len();
        if n == 1 {
            return self.contribution(0, vertex, lobe);
        }
        // A weighted reservoir of one: the chosen candidate times (sum of weights / its own weight).
        let (mut sum, mut chosen) = (0.0, None);
        let mut offer = |candidate: Option<Contribution>, scale: f32, u: f32| {
            if let Some(c) = candidate {
                let value = math::luminance(c.radiance);
                let weight = value * scale;
                if weight > 0.0 {
                    sum += weight;
                    if u * sum < weight {
                        chosen = Some((c, value));
                    }
                }
            }
        };
        if n <= CANDIDATES {
            for i in 0..n {
                offer(self.contribution(i, vertex, lobe), 1.0, sampler.next());
            }
        } else {
            for _ in 0..CANDIDATES {
                let Some((i, probability)) = self.candidate(sampler.next()) else { break };
                let scale = 1.0 / (probability * CANDIDATES as f32);
                offer(self.contribution(i, vertex, lobe), scale, sampler.next());
            }
        }
        chosen.map(|(c, value)| Contribution { radiance: c.radiance * (sum / value), ..c })
    }
}
