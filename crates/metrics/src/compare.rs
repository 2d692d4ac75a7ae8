use glam::Vec3;
use indirect_core::{Image, math::luminance};

use crate::{MetricsError, flip};

/// What an image is compared with.
#[derive(Debug, Clone, Copy)]
pub struct Reference<'a> {
    /// Linear radiance.
    pub image: &'a Image,
    /// One entry per pixel: whether the reference sees a surface there. Other pixels do not count.
    pub surface: &'a [bool],
    /// Standard error of each pixel and channel of `image`; `None` where the reference is exact.
    pub standard_error: Option<&'a Image>,
    /// Standard error of the mean luminance of `image`, divided by that mean, `≥ 0`: the noise floor of the bias. Give it where
    /// pixels share random numbers, which makes their errors rise and fall together: `error / value` of
    /// `reference_pathtracer::Estimate::mean`. `None` takes pixels for independent.
    pub relative_mean_error: Option<f64>,
}

impl<'a> Reference<'a> {
    /// A reference without noise.
    #[must_use]
    pub const fn exact(image: &'a Image, surface: &'a [bool]) -> Self {
        Self { image, surface, standard_error: None, relative_mean_error: None }
    }
}

/// The error measures of one channel, or their noise floor.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Measures {
    /// `mean(x)/mean(r) − 1`, signed.
    pub bias: f64,
    /// `√mean((x−r)²)/mean(r)`.
    pub rel_rmse: f64,
    /// `mean((x−r)²/(r² + 0.01·mean(r)²))`.
    pub rel_mse: f64,
    /// Median of `|x−r|/mean(r)`.
    pub p50: f64,
    /// 95th percentile of `|x−r|/mean(r)`.
    pub p95: f64,
    /// 99th percentile of `|x−r|/mean(r)`.
    pub p99: f64,
}

/// Which measures the reference's noise hides; see [`Measures::below_floor`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BelowFloor {
    /// For [`Measures::bias`].
    pub bias: bool,
    /// For [`Measures::rel_rmse`].
    pub rel_rmse: bool,
    /// For [`Measures::rel_mse`].
    pub rel_mse: bool,
    /// For [`Measures::p50`].
    pub p50: bool,
    /// For [`Measures::p95`].
    pub p95: bool,
    /// For [`Measures::p99`].
    pub p99: bool,
}

impl Measures {
    /// Which differences are below the noise floor.
    ///
    /// Errors add in squares, so an image with an error of its own as large as the floor scores √2 times the floor in
    /// `rel_rmse` and the percentiles, and twice the floor in `rel_mse`; anything less is the reference's doing more than
    /// the image's. A bias counts from two standard errors on.
    #[must_use]
    pub fn below_floor(&self, floor: &Self) -> BelowFloor {
        let root = core::f64::consts::SQRT_2;
        BelowFloor {
            bias: self.bias.abs() < 2.0 * floor.bias,
            rel_rmse: self.rel_rmse < root * floor.rel_rmse,
            rel_mse: self.rel_mse < 2.0 * floor.rel_mse,
            p50: self.p50 < root * floor.p50,
            p95: self.p95 < root * floor.p95,
            p99: self.p99 < root * floor.p99,
        }
    }
}

/// Everything [`compare`] measures.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Comparison {
    /// Of the BT.709 luminance.
    pub luminance: Measures,
    /// Of red, green and blue. A channel in which the reference is black everywhere has no relative error: `None`.
    pub rgb: [Option<Measures>; 3],
    /// Mean FLIP, `[0, 1]`.
    pub flip: f64,
    /// The reference's own standard error by the measures of the luminance; 0 for an exact reference. The luminance's
    /// standard error is the weighted sum of the channels', which is exact for grey noise and an upper bound otherwise. That of
    /// the bias is [`Reference::relative_mean_error`] where it is given.
    pub noise_floor: Measures,
    /// Number of pixels averaged over.
    pub pixels: usize,
}

/// Exposure that maps the mean luminance of the reference's surface pixels to 0.18, middle grey: the one exposure at which
/// every image of a comparison is shown and FLIP is measured. 1 for a black reference.
#[must_use]
pub fn exposure(reference: &Image, surface: &[bool]) -> f32 {
    let (sum, n) = reference
        .pixels
        .iter()
        .zip(surface)
        .filter(|(_, seen)| **seen)
        .fold((0.0_f64, 0_usize), |(sum, n), (p, _)| (sum + f64::from(luminance(*p)), n + 1));
    let exposure = (0.18 * n as f64 / sum) as f32;
    if exposure.is_finite() && exposure > 0.0 { exposure } else { 1.0 }
}

/// Measures `image` against `reference`, in linear radiance.
///
/// # Errors
/// Sizes that differ, no pixels, no surface, a value that is not finite, a black reference, or a
/// [`Reference::relative_mean_error`] that is negative or not finite.
pub fn compare(image: &Image, reference: &Reference<'_>) -> Result<Comparison, MetricsError> {
    check(image, reference)?;
    let seen = |source: &Image| -> Vec<Vec3> {
        source.pixels.iter().zip(reference.surface).filter(|(_, seen)| **seen).map(|(p, _)| *p).collect()
    };
    let (x, r) = (seen(image), seen(reference.image));
    if r.is_empty() {
        return Err(MetricsError::NoSurface);
    }
    let y = |p: &Vec3| luminance_f64(*p);
    let difference = |(x, r): (f64, f64)| (x - r, r);
    let measured =
        measure(x.iter().map(y).zip(r.iter().map(y)).map(difference)).ok_or(MetricsError::BlackReference)?;
    let channel = |c: usize| {
        let value = move |p: &Vec3| f64::from(p[c]);
        measure(x.iter().map(value).zip(r.iter().map(value)).map(difference))
    };
    let mut noise_floor = reference.standard_error.map_or_else(Measures::default, |error| {
        let error = seen(error);
        let m = measure(error.iter().map(y).zip(r.iter().map(y))).unwrap_or_default();
        // Independent errors of n pixels leave a mean with the standard error √Σe²/n.
        Measures { bias: m.rel_rmse / (r.len() as f64).sqrt(), ..m }
    });
    if let Some(error) = reference.relative_mean_error {
        noise_floor.bias = error;
    }
    let map = flip::map(image, reference.image, exposure(reference.image, reference.surface))?;
    Ok(Comparison {
        luminance: measured,
        rgb: core::array::from_fn(channel),
        flip: map.mean(reference.surface),
        noise_floor,
        pixels: r.len(),
    })
}

/// How far `image` is from `other`, in the luminance and relative to the reference's mean: what one of several causes adds
/// to the error. The biases of a chain of images from the reference to the last add up to the last one's bias.
///
/// # Errors
/// As [`compare`].
pub fn difference(image: &Image, other: &Image, reference: &Reference<'_>) -> Result<Measures, MetricsError> {
    check(image, reference)?;
    check(other, reference)?;
    let y = |i: usize, image: &Image| luminance_f64(image.pixels[i]);
    let seen: Vec<usize> = (0..reference.surface.len()).filter(|i| reference.surface[*i]).collect();
    if seen.is_empty() {
        return Err(MetricsError::NoSurface);
    }
    measure(seen.iter().map(|&i| (y(i, image) - y(i, other), y(i, reference.image))))
        .ok_or(MetricsError::BlackReference)
}

fn check(image: &Image, reference: &Reference<'_>) -> Result<(), MetricsError> {
    let size = reference.image.size;
    let expected = size[0] as usize * size[1] as usize;
    if expected == 0 {
        return Err(MetricsError::Empty);
    }
    let mismatch = |what, found, size: [u32; 2]| MetricsError::SizeMismatch {
        what,
        found,
        width: size[0],
        height: size[1],
        expected,
    };
    let images = [("the reference", Some(reference.image)), ("the image", Some(image))];
    for (what, i) in images.into_iter().chain([("the standard error", reference.standard_error)]) {
        let Some(i) = i else { continue };
        if i.size != size || i.pixels.len() != expected {
            return Err(mismatch(what, i.pixels.len(), i.size));
        }
        if let Some(at) = i.pixels.iter().position(|p| !p.is_finite()) {
            let (x, y) = ((at % size[0] as usize) as u32, (at / size[0] as usize) as u32);
            return Err(MetricsError::NonFinite { what, x, y });
        }
    }
    if let Some(error) = reference.relative_mean_error
        && !(error >= 0.0 && error.is_finite())
    {
        return Err(MetricsError::Parameter {
            parameter: "the relative error of the reference's mean",
            value: error.to_string(),
            requirement: "finite and not negative",
        });
    }
    if reference.surface.len() != expected {
        return Err(mismatch("the surface mask", reference.surface.len(), size));
    }
    Ok(())
}

/// BT.709 luminance without f32 rounding, which would swamp small differences.
fn luminance_f64(rgb: Vec3) -> f64 {
    rgb.as_dvec3().dot(glam::DVec3::new(0.2126, 0.7152, 0.0722))
}

/// The measures of one channel from its differences and reference values; `None` where the reference's mean is not
/// positive.
fn measure(pairs: impl Iterator<Item = (f64, f64)> + Clone) -> Option<Measures> {
    let (n, sum) = pairs.clone().fold((0.0, 0.0), |(n, sum), (_, r)| (n + 1.0, sum + r));
    let mean: f64 = sum / n;
    if mean.is_nan() || mean <= 0.0 {
        return None;
    }
    let (mut sum, mut squares, mut weighted) = (0.0, 0.0, 0.0);
    let mut relative = Vec::with_capacity(n as usize);
    for (d, r) in pairs {
        sum += d;
        squares += d * d;
        weighted += d * d / (r * r + 1e-2 * mean * mean);
        relative.push(d.abs() / mean);
    }
    let [p50, p95, p99] = percentiles(&mut relative);
    Some(Measures {
        bias: sum / n / mean,
        rel_rmse: (squares / n).sqrt() / mean,
        rel_mse: weighted / n,
        p50,
        p95,
        p99,
    })
}

/// The 50th, 95th and 99th percentile by the nearest-rank definition: the smallest value that at least that share of all
/// values does not exceed.
fn percentiles(values: &mut [f64]) -> [f64; 3] {
    values.sort_unstable_by(f64::total_cmp);
    [0.50, 0.95, 0.99].map(|q: f64| {
        let rank = (q * values.len() as f64).ceil() as usize;
        values[rank.clamp(1, values.len()) - 1]
    })
}
