use glam::{DVec3, Vec3};
use indirect_core::{Image, math};

use crate::{Error, Samples};

/// Sums over batch means of one component of one pixel: linear RGB and, for the squares, luminance too.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Moments {
    pub(crate) sum: DVec3,
    pub(crate) squares: DVec3,
    pub(crate) luminance_squares: f64,
}

impl Moments {
    /// Adds the mean of one batch.
    pub(crate) fn add(&mut self, mean: DVec3) {
        let mean = mean.as_vec3();
        let luminance = f64::from(math::luminance(mean));
        // Summed as rounded to f32: the sums of a whole and of its parts then agree to the last bit of f64.
        let mean = mean.as_dvec3();
        self.sum += mean;
        self.squares += mean * mean;
        self.luminance_squares += luminance * luminance;
    }

    fn merge(&mut self, other: &Self) {
        self.sum += other.sum;
        self.squares += other.squares;
        self.luminance_squares += other.luminance_squares;
    }
}

/// Both components of one pixel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Pixel {
    pub(crate) direct: Moments,
    pub(crate) indirect: Moments,
    pub(crate) surface: bool,
}

/// Mean luminance of the whole image in one batch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Batch {
    pub(crate) index: u32,
    pub(crate) direct: f64,
    pub(crate) indirect: f64,
}

/// A mean with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mean {
    /// The mean.
    pub value: f64,
    /// Its standard error, from the scatter of the batches; infinite for a single batch.
    pub error: f64,
}

/// A rendered image: direct and indirect radiance apart, with the variance of each pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Emission seen plus light reflected once, W/(sr·m²).
    pub direct: Image,
    /// Everything after, W/(sr·m²).
    pub indirect: Image,
    /// Variance of the mean in `direct`, per channel, from the scatter of the batches; infinite for a single batch.
    pub direct_variance: Image,
    /// Variance of the mean in `indirect`.
    pub indirect_variance: Image,
    /// Whether any camera ray of the pixel met a surface; row-major, top row first.
    pub surface: Vec<bool>,
    /// Samples per pixel that were taken.
    pub spp: u64,
    /// Rays traced: closest-hit and shadow rays together.
    pub rays: u64,
    pub(crate) pixels: Vec<Pixel>,
    /// Samples per pixel in a batch.
    pub(crate) batch: u32,
    /// Batches taken, each once, in order.
    pub(crate) batches: Vec<Batch>,
    /// Hash of scene, view, size and every setting but the sample range.
    pub(crate) key: u128,
}

impl Estimate {
    pub(crate) fn new(
        size: [u32; 2],
        pixels: Vec<Pixel>,
        batch: u32,
        batches: Vec<Batch>,
        rays: u64,
        key: u128,
    ) -> Self {
        let n = batches.len() as f64;
        let image = |of: &dyn Fn(&Pixel) -> Vec3| Image { size, pixels: pixels.iter().map(of).collect() };
        let mean = |m: &Moments| (m.sum / n).as_vec3();
        let variance = |m: &Moments| {
            if batches.len() < 2 {
                return Vec3::INFINITY;
            }
            // Rounding may leave a tiny negative difference where all batches agree.
            ((m.squares - m.sum * m.sum / n) / (n * (n - 1.0))).max(DVec3::ZERO).as_vec3()
        };
        Self {
            direct: image(&|p| mean(&p.direct)),
            indirect: image(&|p| mean(&p.indirect)),
            direct_variance: image(&|p| variance(&p.direct)),
            indirect_variance: image(&|p| variance(&p.indirect)),
            surface: pixels.iter().map(|p| p.surface).collect(),
            spp: batches.len() as u64 * u64::from(batch),
            rays,
            pixels,
            batch,
            batches,
            key,
        }
    }

    /// Direct plus indirect radiance.
    #[must_use]
    pub fn full(&self) -> Image {
        self.direct.sum(&self.indirect)
    }

    /// Standard errors of the `[direct, indirect]` image as a whole: √(mean variance)/mean of the luminance over the pixels
    /// that see a surface, the quantity that `rel_rmse` has for a perfect technique. 0 for a black image, infinite for a
    /// single batch.
    #[must_use]
    pub fn noise(&self) -> [f64; 2] {
        noise(&self.pixels, self.batches.len())
    }

    /// Mean luminance of the `[direct, indirect]` image, W/(sr·m²), over all pixels. Pixels share random numbers, so its error
    /// does not follow from their variances.
    #[must_use]
    pub fn mean(&self) -> [Mean; 2] {
        let n = self.batches.len() as f64;
        let of = |component: fn(&Batch) -> f64| {
            let value = self.batches.iter().map(component).sum::<f64>() / n;
            let scatter: f64 = self.batches.iter().map(|b| (component(b) - value).powi(2)).sum();
            let error =
                if self.batches.len() < 2 { f64::INFINITY } else { (scatter / (n * (n - 1.0))).sqrt() };
            Mean { value, error }
        };
        [of(|b| b.direct), of(|b| b.indirect)]
    }

    /// Joins two estimates of the same scene, view and settings whose sample ranges do not overlap: the moments add, so
    /// the result is that of one run over both ranges, up to f64 rounding.
    ///
    /// # Errors
    /// [`Error::Merge`] where they were made from different input, differ in batch size or share a batch.
    pub fn merge(&self, other: &Self) -> Result<Self, Error> {
        let fail = |message| Err(Error::Merge { message });
        if self.key != other.key || self.direct.size != other.direct.size {
            return fail("scene, view, size or settings differ");
        }
        if self.batch != other.batch {
            return fail("batch sizes differ");
        }
        let mut batches = [self.batches.as_slice(), &other.batches].concat();
        batches.sort_by_key(|b| b.index);
        if batches.windows(2).any(|pair| pair[0].index == pair[1].index) {
            return fail("sample ranges overlap");
        }
        let mut pixels = self.pixels.clone();
        for (p, q) in pixels.iter_mut().zip(&other.pixels) {
            p.direct.merge(&q.direct);
            p.indirect.merge(&q.indirect);
            p.surface |= q.surface;
        }
        Ok(Self::new(
            self.direct.size,
            pixels,
            self.batch,
            batches,
            self.rays.saturating_add(other.rays),
            self.key,
        ))
    }

    /// The sample ranges taken, disjoint and in order.
    #[must_use]
    pub fn samples(&self) -> Vec<Samples> {
        let mut ranges: Vec<Samples> = Vec::new();
        for b in &self.batches {
            match ranges.last_mut() {
                Some(last) if last.first + last.batches == b.index => last.batches += 1,
                _ => ranges.push(Samples { batch: self.batch, first: b.index, batches: 1 }),
            }
        }
        ranges
    }
}

pub(crate) fn noise(pixels: &[Pixel], batches: usize) -> [f64; 2] {
    let n = batches as f64;
    let of = |component: fn(&Pixel) -> &Moments| {
        let (mut count, mut mean, mut variance) = (0.0, 0.0, 0.0);
        for p in pixels.iter().filter(|p| p.surface) {
            let m = component(p);
            let luminance = m.sum.dot(DVec3::new(0.2126, 0.7152, 0.0722));
            count += 1.0;
            mean += luminance / n;
            variance += (m.luminance_squares - luminance * luminance / n).max(0.0) / (n * (n - 1.0));
        }
        if mean <= 0.0 {
            0.0
        } else if batches < 2 {
            f64::INFINITY
        } else {
            (variance * count).sqrt() / mean
        }
    };
    [of(|p| &p.direct), of(|p| &p.indirect)]
}
