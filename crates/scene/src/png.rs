//! PNG: 8 bit sRGB after one stated exposure; for looking, not for measuring.

use std::path::Path;

use glam::Vec3;
use indirect_core::Image;

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
