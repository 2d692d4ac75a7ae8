use core::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;
use indirect_accel::Accel;
use indirect_core::{View, math};
use indirect_sampling::rng::hash_combine;
use rayon::prelude::*;

use crate::{
    Error, Estimate, Settings,
    estimate::{self, Batch, Pixel},
    key,
    raster::{CHUNK, Raster},
    sampler::LIGHT_PATHS,
    tracer::Tracer,
    trial,
    vpls::Pool,
};

/// Batches before the noise is looked at for the first time.
const FIRST_LOOK: u32 = 4;

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
    let plan = trial::plan(&image, &rays);
    let mut pixels: Vec<Pixel> = vec![Pixel::default(); count];
    for (pixel, seen) in pixels.iter_mut().zip(&image.seen) {
        pixel.surface = seen.is_some();
    }
    let light_paths = |index| {
        plan.map(|plan| {
            let seed = hash_combine(hash_combine(settings.seed, LIGHT_PATHS), index);
            Pool::trace(&tracer, plan, image.light_paths(), seed, &rays)
        })
    };
    let batch = settings.samples.batch;
    let sample = |i, index, pool: &Option<Pool>, surface: &mut bool, traced: &mut u64| {
        image.batch(i, index, batch, pool.as_ref(), surface, traced)
    };
    let batches = run(&mut pixels, settings, &rays, light_paths, sample, progress);
    progress(1.0);
    // The images that follow need its memory.
    drop(image);
    let key = key::key(accel.scene(), view, size, settings);
    Ok(Estimate::new(size, pixels, batch, batches, rays.into_inner(), key))
}

/// Batch after batch, until there are enough: `shared` makes what all pixels of a batch share, `sample` gives the mean direct and indirect
/// value of a pixel over a batch.
pub(crate) fn run<S: Sync>(
    pixels: &mut [Pixel],
    settings: &Settings,
    rays: &AtomicU64,
    shared: impl Fn(u32) -> S,
    sample: impl Fn(usize, u32, &S, &mut bool, &mut u64) -> (DVec3, DVec3) + Sync,
    progress: &(dyn Fn(f64) + Sync),
) -> Vec<Batch> {
    let count = pixels.len();
    let samples = settings.samples;
    let (done, work) = (AtomicU64::new(0), count as u64 * u64::from(samples.batches));
    let mut batches = Vec::new();
    let mut look = FIRST_LOOK;
    for index in samples.first..samples.first + samples.batches {
        let shared = shared(index);
        // Sums per chunk, added up in order: the same bits on any number of threads.
        let sums: Vec<[f64; 2]> = pixels
            .par_chunks_mut(CHUNK)
            .enumerate()
            .map(|(chunk, pixels)| {
                let (mut sum, mut traced) = ([0.0; 2], 0);
                for (i, pixel) in pixels.iter_mut().enumerate() {
                    let at = chunk * CHUNK + i;
                    let (direct, indirect) = sample(at, index, &shared, &mut pixel.surface, &mut traced);
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
            if estimate::noise(pixels, batches.len()).iter().all(|noise| *noise <= target) {
                break;
            }
        }
    }
    batches
}
