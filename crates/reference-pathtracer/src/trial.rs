//! The trial that decides how an image uses virtual lights.

use core::{
    f32::consts::PI,
    sync::atomic::{AtomicU64, Ordering},
};

use glam::DVec3;
use indirect_core::math;
use indirect_sampling::rng::hash_combine;
use rayon::prelude::*;

use crate::{
    EmitterSampling, VirtualLights,
    raster::{CHUNK, Raster},
    vpls::{Plan, Pool},
};

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

/// Whether to use virtual lights, and how: what has the least variance per ray in a short trial with samples of its own. The same
/// for every range of batches.
pub(crate) fn plan(image: &Raster<'_>, rays: &AtomicU64) -> Option<Plan> {
    let tracer = image.tracer;
    let settings = tracer.settings;
    let lit = tracer.lights.len() > 0 || !tracer.emitters.is_empty();
    // Without visibility, light of later bounces would reach virtual lights that no light path meets.
    let applies = settings.emitters == EmitterSampling::Mis
        && if settings.unoccluded { tracer.limit == 1 } else { tracer.limit > 0 };
    if !applies || !lit {
        return None;
    }
    let mesh = &tracer.surfaces.scene().mesh;
    let area: f64 = (0..mesh.triangles.len() as u32).map(|t| f64::from(mesh.area(t))).sum();
    let plan = |(scale, connections)| Plan { area: PI * area as f32 / scale, connections };
    let count = image.count();
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
            let seed = hash_combine(settings.seed, !batch);
            Pool::trace(tracer, plan(PLANS[0]), image.light_paths(), seed, rays)
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
                            image.batch(pixel(p), !(batch as u32), samples, pool, &mut false, &mut traced);
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
