//! PNG: 8 bit sRGB after one stated exposure; for looking, not for measuring.

use std::path::Path;

use glam::Vec3;
use indirect_core::{Image, math::luminance};

use crate::ImageFileError;

/// The sRGB transfer function (IEC 61966-2-1) of a linear value, clamped to `[0, 1]`.
#[must_use]
pub fn srgb_from_linear(linear: f32) -> f32 {
    let c = linear.clamp(0.0, 1.0);
    if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }
}

/// The linear value of an sRGB-encoded one, both in `[0, 1]`.
#[must_use]
pub fn linear_from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// One pixel as 8 bit sRGB. What is not finite becomes magenta, so that nobody mistakes it for black.
fn encode(pixel: Vec3, exposure: f32) -> [u8; 3] {
    if !pixel.is_finite() {
        return [255, 0, 255];
    }
    (pixel * exposure).to_array().map(|c| (srgb_from_linear(c) * 255.0 + 0.5) as u8)
}

/// Encodes `image · exposure` as an 8 bit sRGB PNG. Values above 1 clip; pixels that are not finite become magenta.
///
/// # Errors
/// An image without pixels.
pub fn encode_srgb(image: &Image, exposure: f32) -> Result<Vec<u8>, ImageFileError> {
    let [width, height] = image.size;
    if width == 0 || height == 0 || image.pixels.len() != width as usize * height as usize {
        return Err(ImageFileError::Size { size: image.size });
    }
    let data: Vec<u8> = image.pixels.iter().flat_map(|&p| encode(p, exposure)).collect();
    let mut bytes = Vec::new();
    let codec = |e: png::EncodingError| ImageFileError::Codec { path: "PNG".into(), problem: e.to_string() };
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    let mut writer = encoder.write_header().map_err(codec)?;
    writer.write_image_data(&data).map_err(codec)?;
    writer.finish().map_err(codec)?;
    Ok(bytes)
}

/// An image whose range a screen can show, `[0, 1]` in luminance, by the global operator of Reinhard, Stark, Shirley & Ferwerda (2002,
/// "Photographic Tone Reproduction for Digital Images", equations 1, 2 and 4): the log-average luminance becomes the middle grey `key`, and
/// the brightest pixel white. For looking, not for measuring.
///
/// `key`: 0.18 for an ordinary scene, less for a dark one. Pixels that are black or not finite stay as they are and count for nothing.
#[must_use]
pub fn reinhard(image: &Image, key: f32) -> Image {
    let luminances = || image.pixels.iter().map(|p| luminance(*p)).filter(|l| l.is_finite() && *l > 0.0);
    let count = luminances().count().max(1) as f64;
    let average = (luminances().map(|l| f64::from(l).ln()).sum::<f64>() / count).exp();
    let scale = (f64::from(key) / average) as f32;
    let white = luminances().fold(0.0, f32::max) * scale;
    let map = |p: &Vec3| {
        let l = luminance(*p) * scale;
        if l.is_finite() && l > 0.0 { *p * (scale * (1.0 + l / (white * white)) / (1.0 + l)) } else { *p }
    };
    Image { size: image.size, pixels: image.pixels.iter().map(map).collect() }
}

/// Writes [`encode_srgb`]'s bytes to a file and returns how many channel values are NaN or infinite.
///
/// # Errors
/// An image without pixels, or a path that cannot be written.
pub fn write_srgb(path: &Path, image: &Image, exposure: f32) -> Result<usize, ImageFileError> {
    std::fs::write(path, encode_srgb(image, exposure)?).map_err(|source| ImageFileError::Io {
        path: path.display().to_string(),
        action: "written",
        source,
    })?;
    Ok(image.non_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reinhard_keeps_order_and_makes_the_brightest_white() {
        let pixels: Vec<Vec3> = (0..1000).map(|i| Vec3::splat(1e-3 * 1.02_f32.powi(i))).collect();
        let mapped = reinhard(&Image { size: [1000, 1], pixels }, 0.18);
        let l: Vec<f32> = mapped.pixels.iter().map(|p| luminance(*p)).collect();
        assert!(l.windows(2).all(|w| w[0] < w[1]) && (l[999] - 1.0).abs() < 1e-3, "{}", l[999]);
        // The middle of a geometric series is its log-average: key/(1 + key), before what white adds.
        assert!((l[500] - 0.18 / 1.18).abs() < 2e-3, "{}", l[500]);
        let odd = Image { size: [3, 1], pixels: vec![Vec3::ZERO, Vec3::NAN, Vec3::ONE] };
        let mapped = reinhard(&odd, 0.18);
        assert_eq!(mapped.pixels[0], Vec3::ZERO);
        assert!(mapped.pixels[1].is_nan() && mapped.pixels[2].is_finite());
    }
}
