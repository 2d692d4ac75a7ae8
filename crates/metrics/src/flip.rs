//! FLIP: the difference a viewer sees when two images are shown in turn at the same place.
//!
//! LDR-FLIP of Andersson et al. 2020, "FLIP: A Difference Evaluator for Alternating Images", HPG 2020. Both images are
//! scaled by one exposure, clamped to `[0, 1]` and encoded as sRGB first. Per pixel:
//!
//! ```text
//! colour    opponent space YCxCz → contrast sensitivity filter → linear RGB → L*a*b* with Hunt's effect
//!           → HyAB distance^0.7, remapped to [0, 1]                                            §4.1
//! feature   edges and points of the unfiltered luminance, width 0.082°, larger difference^½     §4.2
//! FLIP      colour^(1 − feature)                                                               §4.3
//! ```

use glam::Vec3;
use indirect_core::Image;

use crate::{MetricsError, mask};

/// Pixels per degree of visual angle of a 0.7 m wide screen of 3840 pixels seen from 0.7 m: the paper's default.
pub const PIXELS_PER_DEGREE: f32 = 0.7 * 3840.0 / 0.7 * (core::f32::consts::PI / 180.0);

/// FLIP per pixel, row-major, top row first.
#[derive(Debug, Clone, PartialEq)]
pub struct FlipMap {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// `[0, 1]`: 0 no visible difference.
    pub values: Vec<f32>,
}

impl FlipMap {
    /// Mean over the pixels whose `surface` entry is set; 0 without any.
    #[must_use]
    pub fn mean(&self, surface: &[bool]) -> f64 {
        mask::mean(&self.values, surface)
    }
}

/// FLIP between two linear images at one exposure and [`PIXELS_PER_DEGREE`].
///
/// # Errors
/// Sizes that differ, no pixels, values that are not finite, an exposure that is not positive.
pub fn map(image: &Image, reference: &Image, exposure: f32) -> Result<FlipMap, MetricsError> {
    if !(exposure > 0.0 && exposure.is_finite()) {
        let value = exposure.to_string();
        return Err(MetricsError::Parameter { parameter: "exposure", value, requirement: "positive" });
    }
    // A clamp would hide what is not a number.
    check_pixels(image, reference, |p| p.is_finite())?;
    let display = |i: &Image| Image {
        size: i.size,
        pixels: i.pixels.iter().map(|p| (*p * exposure).clamp(Vec3::ZERO, Vec3::ONE)).collect(),
    };
    linear_ldr(&display(image), &display(reference), PIXELS_PER_DEGREE)
}

/// FLIP between two display-referred images in *linear* RGB within `[0, 1]` (decode sRGB first), at a given number of
/// pixels per degree.
///
/// # Errors
/// Sizes that differ, no pixels, values outside `[0, 1]`, or a number of pixels per degree that is not positive.
pub fn linear_ldr(image: &Image, reference: &Image, ppd: f32) -> Result<FlipMap, MetricsError> {
    check_pixels(image, reference, |p| p.to_array().iter().all(|v| (0.0..=1.0).contains(v)))?;
    if !(ppd > 0.0 && ppd.is_finite()) {
        let value = ppd.to_string();
        return Err(MetricsError::Parameter {
            parameter: "pixels per degree",
            value,
            requirement: "positive",
        });
    }
    let size = reference.size;
    let opponent = |i: &Image| i.pixels.iter().map(|p| ycxcz_from_rgb(*p)).collect::<Vec<_>>();
    let (r, x) = (opponent(reference), opponent(image));
    let colour = {
        let csf = ContrastFilter::new(ppd);
        let (r, x) = (csf.apply(&r, size), csf.apply(&x, size));
        // The largest distance within the sRGB gamut: green against blue (§4.1).
        let largest = hyab(hunt_lab(Vec3::Y), hunt_lab(Vec3::Z)).powf(COLOUR_EXPONENT);
        r.iter()
            .zip(&x)
            .map(|(r, x)| {
                let lab = |p: &Vec3| hunt_lab(rgb_from_ycxcz(*p).clamp(Vec3::ZERO, Vec3::ONE));
                remap(hyab(lab(r), lab(x)).powf(COLOUR_EXPONENT), largest)
            })
            .collect::<Vec<_>>()
    };
    let detector = FeatureFilter::new(ppd);
    let (r, x) = (detector.apply(&r, size), detector.apply(&x, size));
    let values = colour
        .iter()
        .zip(r.iter().zip(&x))
        .map(|(colour, (r, x))| {
            let difference = (r[0] - x[0]).abs().max((r[1] - x[1]).abs());
            let feature = (difference * core::f32::consts::FRAC_1_SQRT_2).sqrt();
            colour.powf(1.0 - feature.min(1.0))
        })
        .collect();
    Ok(FlipMap { size, values })
}

/// Requires equal sizes, pixels at all, and pixels that are `valid`.
fn check_pixels(image: &Image, reference: &Image, valid: impl Fn(Vec3) -> bool) -> Result<(), MetricsError> {
    let expected = reference.size[0] as usize * reference.size[1] as usize;
    if expected == 0 {
        return Err(MetricsError::Empty);
    }
    for (what, i) in [("the reference", reference), ("the image", image)] {
        if i.size != reference.size || i.pixels.len() != expected {
            let ([width, height], found) = (i.size, i.pixels.len());
            return Err(MetricsError::SizeMismatch { what, found, width, height, expected });
        }
        let Some(at) = i.pixels.iter().position(|p| !valid(*p)) else { continue };
        let width = reference.size[0] as usize;
        let (x, y) = ((at % width) as u32, (at / width) as u32);
        if !i.pixels[at].is_finite() {
            return Err(MetricsError::NonFinite { what, x, y });
        }
        let value = format!("{} at ({x}, {y})", i.pixels[at]);
        return Err(MetricsError::Parameter { parameter: what, value, requirement: "in [0, 1]" });
    }
    Ok(())
}

// ---- colour -------------------------------------------------------------------------------------------------------

const COLOUR_EXPONENT: f32 = 0.7;

/// IEC 61966-2-1 primaries with the D65 white point, column by column, relative to that white: white maps to (1, 1, 1).
fn xyz_from_rgb(p: Vec3) -> Vec3 {
    let x = p.dot(Vec3::new(0.412_390_8, 0.357_584_3, 0.180_480_8)) / 0.950_455_9;
    let y = p.dot(Vec3::new(0.212_639, 0.715_168_7, 0.072_192_3));
    let z = p.dot(Vec3::new(0.019_330_8, 0.119_194_8, 0.950_532_2)) / 1.089_057_8;
    Vec3::new(x, y, z)
}

fn rgb_from_xyz(p: Vec3) -> Vec3 {
    let p = p * Vec3::new(0.950_455_9, 1.0, 1.089_057_8);
    Vec3::new(
        p.dot(Vec3::new(3.240_97, -1.537_383_2, -0.498_610_8)),
        p.dot(Vec3::new(-0.969_243_6, 1.875_967_5, 0.041_555_06)),
        p.dot(Vec3::new(0.055_630_08, -0.203_977, 1.056_971_5)),
    )
}

/// Linear opponent space (§4.1): achromatic, red–green, blue–yellow.
fn ycxcz_from_rgb(p: Vec3) -> Vec3 {
    let p = xyz_from_rgb(p);
    Vec3::new(116.0 * p.y - 16.0, 500.0 * (p.x - p.y), 200.0 * (p.y - p.z))
}

fn rgb_from_ycxcz(p: Vec3) -> Vec3 {
    let y = (p.x + 16.0) / 116.0;
    rgb_from_xyz(Vec3::new(y + p.y / 500.0, y, y - p.z / 200.0))
}

/// CIE L*a*b* with the chroma reduced in the dark (Hunt's effect, §4.1).
fn hunt_lab(rgb: Vec3) -> Vec3 {
    const DELTA: f32 = 6.0 / 29.0;
    let f = |t: f32| {
        if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    };
    let p = xyz_from_rgb(rgb);
    let (x, y, z) = (f(p.x), f(p.y), f(p.z));
    let l = 116.0 * y - 16.0;
    let hunt = 0.01 * l;
    Vec3::new(l, 500.0 * (x - y) * hunt, 200.0 * (y - z) * hunt)
}

/// City block in lightness, Euclidean in chroma.
fn hyab(a: Vec3, b: Vec3) -> f32 {
    let d = a - b;
    d.x.abs() + d.y.hypot(d.z)
}

/// Maps distances up to 0.4 of the largest onto `[0, 0.95]` and the rest onto `[0.95, 1]` (§4.1).
fn remap(distance: f32, largest: f32) -> f32 {
    const KNEE: f32 = 0.4;
    const VALUE_AT_KNEE: f32 = 0.95;
    let knee = KNEE * largest;
    if distance < knee {
        VALUE_AT_KNEE / knee * distance
    } else {
        VALUE_AT_KNEE + (distance - knee) / (largest - knee) * (1.0 - VALUE_AT_KNEE)
    }
}

// ---- filters ------------------------------------------------------------------------------------------------------

/// Weights of one axis of a separable filter over the offsets `[-radius, radius]`.
fn taps(radius: i32, weight: impl Fn(f32) -> f32) -> Vec<f32> {
    (-radius..=radius).map(|i| weight(i as f32)).collect()
}

/// Scales the positive weights to a sum of 1 and the negative ones to −1.
fn normalize(mut taps: Vec<f32>) -> Vec<f32> {
    let positive: f32 = taps.iter().filter(|w| **w > 0.0).sum();
    let negative: f32 = -taps.iter().filter(|w| **w < 0.0).sum::<f32>();
    for w in &mut taps {
        *w /= if *w > 0.0 { positive } else { negative.max(f32::MIN_POSITIVE) };
    }
    taps
}

/// Filters a plane along x, then along y; pixels outside repeat the border.
fn separable(plane: &[f32], size: [u32; 2], along_x: &[f32], along_y: &[f32]) -> Vec<f32> {
    let (width, height) = (size[0] as usize, size[1] as usize);
    let pass = |source: &[f32], taps: &[f32], n: usize, step: usize, position: &dyn Fn(usize) -> usize| {
        let radius = taps.len() / 2;
        (0..source.len())
            .map(|i| {
                let at = position(i);
                let line = i - at * step;
                let clamped = |t: usize| (at + t).saturating_sub(radius).min(n - 1);
                taps.iter().enumerate().map(|(t, w)| w * source[line + clamped(t) * step]).sum()
            })
            .collect::<Vec<f32>>()
    };
    let rows = pass(plane, along_x, width, 1, &|i| i % width);
    pass(&rows, along_y, height, width, &|i| i / width)
}

/// The eye's contrast sensitivity per opponent channel: sums of Gaussians `a·√(π/b)·exp(−π²d²/b)`, `d` in degrees, of
/// total weight 1 (§4.1, table 1).
struct ContrastFilter {
    /// Per channel: separable Gaussians, their weights folded into `along_x`.
    channels: [Vec<[Vec<f32>; 2]>; 3],
}

impl ContrastFilter {
    fn new(ppd: f32) -> Self {
        const CHANNELS: [&[[f32; 2]]; 3] =
            [&[[1.0, 0.0047]], &[[1.0, 0.0053]], &[[34.1, 0.04], [13.5, 0.025]]];
        let pi = core::f32::consts::PI;
        // Three standard deviations of the widest Gaussian.
        let radius = (3.0 * (0.04 / (2.0 * pi * pi)).sqrt() * ppd).ceil() as i32;
        let channels = CHANNELS.map(|gaussians| {
            let parts: Vec<_> = gaussians
                .iter()
                .map(|&[a, b]| {
                    let g = taps(radius, |i| (-(pi * i / ppd).powi(2) / b).exp());
                    (a * (pi / b).sqrt(), g)
                })
                .collect();
            let total: f32 = parts.iter().map(|(a, g)| a * g.iter().sum::<f32>().powi(2)).sum();
            parts.into_iter().map(|(a, g)| [g.iter().map(|w| w * a / total).collect(), g]).collect()
        });
        Self { channels }
    }

    fn apply(&self, opponent: &[Vec3], size: [u32; 2]) -> Vec<Vec3> {
        let mut out = vec![Vec3::ZERO; opponent.len()];
        for (c, gaussians) in self.channels.iter().enumerate() {
            let plane: Vec<f32> = opponent.iter().map(|p| p[c]).collect();
            for [along_x, along_y] in gaussians {
                for (out, v) in out.iter_mut().zip(separable(&plane, size, along_x, along_y)) {
                    out[c] += v;
                }
            }
        }
        out
    }
}

/// Edge and point detectors: first and second derivative of a Gaussian (§4.2).
struct FeatureFilter {
    gaussian: Vec<f32>,
    edge: Vec<f32>,
    point: Vec<f32>,
}

impl FeatureFilter {
    fn new(ppd: f32) -> Self {
        /// Width of the features the eye separates, degrees.
        const WIDTH: f32 = 0.082;
        let deviation = 0.5 * WIDTH * ppd;
        let radius = (3.0 * deviation).ceil() as i32;
        let g = |i: f32| (-i * i / (2.0 * deviation * deviation)).exp();
        Self {
            gaussian: normalize(taps(radius, g)),
            edge: normalize(taps(radius, |i| -i * g(i))),
            point: normalize(taps(radius, |i| (i * i / (deviation * deviation) - 1.0) * g(i))),
        }
    }

    /// Strength of edges and of points per pixel.
    fn apply(&self, opponent: &[Vec3], size: [u32; 2]) -> Vec<[f32; 2]> {
        let luminance: Vec<f32> = opponent.iter().map(|p| (p.x + 16.0) / 116.0).collect();
        let strength = |derivative: &[f32]| {
            let x = separable(&luminance, size, derivative, &self.gaussian);
            let y = separable(&luminance, size, &self.gaussian, derivative);
            x.into_iter().zip(y).map(|(x, y)| x.hypot(y)).collect::<Vec<_>>()
        };
        strength(&self.edge).into_iter().zip(strength(&self.point)).map(|(e, p)| [e, p]).collect()
    }
}
