//! The pixels of an image and their samples.

use core::sync::atomic::{AtomicU64, Ordering};

use glam::{DVec3, Vec2, Vec3};
use indirect_core::View;
use indirect_sampling::rng::{hash_combine, unit_f32};
use rayon::prelude::*;

use crate::{
    PixelFilter,
    path::Found,
    sampler::{LIGHT_PATHS, PATHS, Sampler},
    surfaces::Vertex,
    tracer::Tracer,
    vpls::{Draw, Pool},
};

/// Pixels per work item: small enough to balance, large enough to amortize.
pub(crate) const CHUNK: usize = 32;

/// Dimension of the point in the pixel.
const PIXEL_PAIR: u32 = u32::MAX;

/// The pixels of one image, with what all samples of a pixel share.
pub(crate) struct Raster<'a> {
    pub(crate) tracer: &'a Tracer<'a>,
    view: &'a View,
    size: [u32; 2],
    /// Visible surfaces at pixel centres with the light that is known exactly; empty for the box filter.
    pub(crate) seen: Vec<Option<(Vertex, Vec3)>>,
    seed: u32,
}

impl<'a> Raster<'a> {
    pub(crate) fn new(tracer: &'a Tracer<'a>, view: &'a View, size: [u32; 2], rays: &AtomicU64) -> Self {
        let count = match tracer.settings.pixel_filter {
            PixelFilter::Center => size[0] as usize * size[1] as usize,
            PixelFilter::Box => 0,
        };
        let mut seen = vec![None; count];
        seen.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, seen)| {
            let mut traced = 0;
            for (i, seen) in seen.iter_mut().enumerate() {
                let pixel = corner(chunk * CHUNK + i, size) + 0.5;
                *seen = tracer.seen(&view.ray(pixel, size), &mut traced).map(|vertex| {
                    let exact = if tracer.settings.components.direct() {
                        vertex.emission + tracer.lit(&vertex, &mut traced)
                    } else {
                        Vec3::ZERO
                    };
                    (vertex, exact)
                });
            }
            rays.fetch_add(traced, Ordering::Relaxed);
        });
        let seed = hash_combine(tracer.settings.seed, PATHS);
        Self { tracer, view, size, seen, seed }
    }

    /// Number of pixels.
    pub(crate) fn count(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }

    /// Light paths per batch: a small share of the work, and few enough for the processor's cache.
    pub(crate) fn light_paths(&self) -> u32 {
        (self.count() as u64 * u64::from(self.tracer.settings.samples.batch) / 16).clamp(64, 1 << 14) as u32
    }

    /// Mean direct and indirect radiance of pixel `i` over a batch of `n` samples.
    pub(crate) fn batch(
        &self,
        i: usize,
        batch: u32,
        n: u32,
        pool: Option<&Pool>,
        surface: &mut bool,
        rays: &mut u64,
    ) -> (DVec3, DVec3) {
        let tracer = self.tracer;
        let seed = hash_combine(hash_combine(self.seed, i as u32), batch);
        let offset = unit_f32(hash_combine(seed, LIGHT_PATHS));
        let draw = |sample: u32| pool.map(|pool| Draw::new(pool, sample, n, offset));
        let (mut exact, mut direct, mut indirect) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        let mut add = |found: Found| {
            direct += found.direct.as_dvec3();
            indirect += found.indirect.as_dvec3();
        };
        match tracer.settings.pixel_filter {
            PixelFilter::Center => {
                if let Some((seen, known)) = &self.seen[i] {
                    exact = known.as_dvec3();
                    if tracer.needs_paths() {
                        for sample in 0..n {
                            add(tracer.path(seen, true, draw(sample), &mut Sampler::new(seed, sample), rays));
                        }
                    }
                }
            }
            PixelFilter::Box => {
                for sample in 0..n {
                    let mut sampler = Sampler::new(seed, sample);
                    let at = corner(i, self.size) + sampler.pair(PIXEL_PAIR);
                    let Some(seen) = tracer.seen(&self.view.ray(at, self.size), rays) else { continue };
                    *surface = true;
                    let mut found = tracer.path(&seen, false, draw(sample), &mut sampler, rays);
                    if tracer.settings.components.direct() {
                        found.direct += seen.emission;
                    }
                    add(found);
                }
            }
        }
        (exact + direct / f64::from(n), indirect / f64::from(n))
    }
}

/// Top left corner of pixel `i`.
fn corner(i: usize, size: [u32; 2]) -> Vec2 {
    let width = size[0] as usize;
    Vec2::new((i % width) as f32, (i / width) as f32)
}
