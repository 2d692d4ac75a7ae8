use core::sync::atomic::{AtomicU64, Ordering};

use glam::{DVec3, Vec2, Vec3};
use indirect_accel::Accel;
use indirect_core::{View, math};
use indirect_sampling::rng::{hash_combine, unit_f32};
use rayon::prelude::*;

use crate::{
    Error, Estimate, PixelFilter, Settings,
    estimate::{self, Batch, Pixel},
    key,
    path::{Found, Tracer},
    pool::{Draw, Pool},
    sampler::Sampler,
    surfaces::Vertex,
};

/// Pixels per work item: small enough to balance, large enough to amortize.
pub(crate) const CHUNK: usize = 32;

/// Batches before the noise is looked at for the first time.
const FIRST_LOOK: u32 = 4;

/// Dimension of the point in the pixel.
const PIXEL_PAIR: u32 = u32::MAX;

/// Tell the uses of one seed apart.
const PATHS: u32 = 0x7061_7468;
const LIGHT_PATHS: u32 = 0x6c69_6768;

/// [`render_with`] without a progress report.
///
/// # Errors
/// As there.
pub fn render(
    accel: &Accel<'_>,
    view: &View,
    size: [u32; 2],
    settings: &Settings,
) -> Result<Estimate, Error> {
    render_with(accel, view, size, settings, &|_| ())
}

/// Estimates the radiance that `view` sees through `size` pixels.
///
/// Runs on the current rayon pool. The result has the same bits for the same input on any number of threads. `progress`
/// is told the share of the work that is done, `[0, 1]`, from any thread, now and then.
///
/// # Errors
/// [`Error::Size`] for an image without pixels or with too many, [`Error::Settings`] for settings that contradict themselves.
pub fn render_with(
    accel: &Accel<'_>,
    view: &View,
    size: [u32; 2],
    settings: &Settings,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Estimate, Error> {
    settings.validate()?;
    let count = u64::from(size[0]) * u64::from(size[1]);
    if count == 0 || count > 1 << 28 {
        return Err(Error::Size { size });
    }
    let count = count as usize;
    let tracer = Tracer::new(accel, *settings);
    let rays = AtomicU64::new(0);
    let image = Raster::new(&tracer, view, size, &rays);
    let plan = image.plan(&rays);
    let mut pixels: Vec<Pixel> = vec![Pixel::default(); count];
    for (pixel, seen) in pixels.iter_mut().zip(&image.seen) {
        pixel.surface = seen.is_some();
    }
    let samples = settings.samples;
    let (done, work) = (AtomicU64::new(0), count as u64 * u64::from(samples.batches));
    let mut batches = Vec::new();
    let mut look = FIRST_LOOK;
    for index in samples.first..samples.first + samples.batches {
        let pool = plan.map(|plan| {
            let seed = hash_combine(hash_combine(settings.seed, LIGHT_PATHS), index);
            tracer.pool(plan, image.light_paths(), seed, &rays)
        });
        // Sums per chunk, added up in order: the same bits on any number of threads.
        let sums: Vec<[f64; 2]> = pixels
            .par_chunks_mut(CHUNK)
            .enumerate()
            .map(|(chunk, pixels)| {
                let (mut sum, mut traced) = ([0.0; 2], 0);
                for (i, pixel) in pixels.iter_mut().enumerate() {
                    let (direct, indirect) = image.batch(
                        chunk * CHUNK + i,
                        index,
                        samples.batch,
                        pool.as_ref(),
                        &mut pixel.surface,
                        &mut traced,
                    );
                    pixel.direct.add(direct);
                    pixel.indirect.add(indirect);
                    sum[0] += f64::from(math::luminance(direct.as_vec3()));
                    sum[1] += f64::from(math::luminance(indirect.as_vec3()));
                }
                rays.fetch_add(traced, Ordering::Relaxed);
                let units = pixels.len() as u64;
                progress((done.fetch_add(units, Ordering::Relaxed) + units) as f64 / work as f64);
                sum
            })
            .collect();
        let [direct, indirect] = sums.iter().fold([0.0; 2], |s, c| [s[0] + c[0], s[1] + c[1]]);
        batches.push(Batch { index, direct: direct / count as f64, indirect: indirect / count as f64 });
        if let Some(target) = settings.noise_target
            && batches.len() as u32 == look
        {
            look += look.div_ceil(2);
            if estimate::noise(&pixels, batches.len()).iter().all(|noise| *noise <= target) {
                break;
            }
        }
    }
    progress(1.0);
    // The images that follow need its memory.
    drop(image);
    let key = key::key(accel.scene(), view, size, settings);
    Ok(Estimate::new(size, pixels, samples.batch, batches, rays.into_inner(), key))
}

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
    fn new(tracer: &'a Tracer<'a>, view: &'a View, size: [u32; 2], rays: &AtomicU64) -> Self {
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
