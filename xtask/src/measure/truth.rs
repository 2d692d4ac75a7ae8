//! The path-traced truth of a scene, and the judgement of runs by it.

use indirect_core::{Image, math::luminance};
use indirect_metrics::{Reference as MetricsReference, compare, exposure};
use reference_pathtracer::{Bounces, Components, Estimate, PixelFilter};

use super::data::{Run, Truth, TruthImages};
use super::effort::{Effort, TRUTH_SEED};
use crate::failure::{Failure, Outcome};
use crate::stage::Stage;
use crate::technique::{Reference, ReferenceOptions};

/// A reference with as many samples as fit into the time for one, measured by a trial; a power of two, so that another run on
/// the same machine asks for the same and finds it stored.
pub(super) fn affordable(
    stage: &Stage<'_>,
    options: ReferenceOptions,
    effort: Effort,
    what: &str,
) -> Outcome<Estimate> {
    // Eight batches of four: the light paths that a batch shares are made once for each, as in the real run.
    const TRIAL: u32 = 32;
    const LEAST: u32 = 32;
    let trial =
        Reference::render(stage, &ReferenceOptions { spp: TRIAL, noise_target: None, ..options }, what)?;
    let affordable = effort.reference_seconds() * 1e3 / (trial.ms / f64::from(TRIAL)).max(1e-6);
    let spp = (affordable as u32).clamp(LEAST, effort.most_spp());
    Reference::cached(stage, &ReferenceOptions { spp: 1 << spp.ilog2(), ..options }, what)
}

pub(super) fn truth(stage: &Stage<'_>, effort: Effort) -> Outcome<Truth> {
    let options = ReferenceOptions {
        components: Components::Both,
        bounces: Bounces::Infinite,
        unoccluded: false,
        spp: 0,
        noise_target: Some(effort.noise_target()),
        seed: TRUTH_SEED,
        pixel_filter: PixelFilter::Center,
    };
    let estimate = affordable(stage, options, effort, "path-traced truth")?;
    let noise = estimate.noise()[1];
    let full = estimate.full();
    let brightness = |i: &Image| f64::from(luminance(i.mean()));
    let share = brightness(&estimate.indirect) / brightness(&full);
    Ok(Truth {
        spp: estimate.spp,
        noise,
        mean_indirect: estimate.indirect.mean().to_array(),
        indirect_share: if share.is_finite() { share } else { 0.0 },
        exposure: exposure(&estimate.indirect, &estimate.surface),
        images: TruthImages {
            full,
            standard_error: deviation(&estimate.indirect_variance),
            relative_mean_error: relative_mean_error(&estimate),
            variance: estimate.indirect_variance,
            indirect: estimate.indirect,
            surface: estimate.surface,
        },
    })
}

impl Truth {
    pub(crate) fn reference(&self) -> MetricsReference<'_> {
        MetricsReference {
            image: &self.images.indirect,
            surface: &self.images.surface,
            standard_error: Some(&self.images.standard_error),
            relative_mean_error: self.images.relative_mean_error,
        }
    }

    /// Mean over the surface of a variance in the luminance, relative to the squared mean of the truth. The channels' errors
    /// are taken to rise and fall together, as those of grey noise do.
    pub(super) fn mean_square_noise(&self, variance: &Image) -> f64 {
        let seen = |i: &Image| -> Vec<f64> {
            let pixels = i.pixels.iter().zip(&self.images.surface).filter(|(_, s)| **s);
            pixels.map(|(p, _)| f64::from(luminance(*p))).collect()
        };
        let (noise, truth) = (seen(&deviation(variance)), seen(&self.images.indirect));
        let n = truth.len().max(1) as f64;
        let mean = truth.iter().sum::<f64>() / n;
        if mean > 0.0 { noise.iter().map(|d| d * d).sum::<f64>() / n / (mean * mean) } else { 0.0 }
    }

    /// Fills in the errors of a run.
    pub(super) fn judge(&self, mut run: Run, file: &str) -> Outcome<Run> {
        use indirect_metrics::MetricsError;
        match compare(&run.indirect, &self.reference()) {
            Ok(error) => {
                run.below_floor = Some(error.luminance.below_floor(&error.noise_floor));
                run.error = Some(error);
                Ok(run)
            }
            Err(MetricsError::BlackReference | MetricsError::NoSurface) => Ok(run),
            Err(e) => Err(Failure::Check(format!("{file}: {}: {e}", run.technique))),
        }
    }
}

/// The standard error of the mean indirect light as a share of it: pixels share random numbers, so it does not follow from
/// theirs.
pub(super) fn relative_mean_error(estimate: &Estimate) -> Option<f64> {
    let m = estimate.mean()[1];
    (m.value > 0.0 && m.error.is_finite()).then(|| m.error / m.value)
}

/// Standard deviation from variance.
pub(super) fn deviation(variance: &Image) -> Image {
    Image { size: variance.size, pixels: variance.pixels.iter().map(|v| v.map(f32::sqrt)).collect() }
}
