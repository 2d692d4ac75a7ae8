//! EXR: linear, scene-referred, float32 channels `R G B`, no tone mapping, no clamping.

use std::io::Cursor;
use std::path::Path;

use exr::image::read::read;
use exr::image::{Encoding, Layer, SpecificChannels};
use exr::prelude::{LayerAttributes, ReadChannels, ReadLayers, ReadSpecificChannel, WritableImage};
use glam::Vec3;
use indirect_core::Image;

use crate::ImageFileError;

/// Writes an image as float32 channels `R G B`, losslessly compressed, and returns how many channel values are NaN or
/// infinite. Those are written as they are: a picture that took an hour is worth keeping, and the caller reports the
/// count.
///
/// # Errors
/// An image without pixels, or a path that cannot be written.
pub fn write_rgb(path: &Path, image: &Image) -> Result<usize, ImageFileError> {
    let [width, height] = image.size.map(|n| n as usize);
    if width == 0 || height == 0 || image.pixels.len() != width * height {
        return Err(ImageFileError::Size { size: image.size });
    }
    let channels = SpecificChannels::rgb(|p: exr::math::Vec2<usize>| {
        let v = image.pixels[p.y() * width + p.x()];
        (v.x, v.y, v.z)
    });
    let layer = Layer::new((width, height), LayerAttributes::default(), Encoding::FAST_LOSSLESS, channels);
    // Encoded in memory first: a full disk or a wrong path then leaves no half file with a valid header.
    let mut bytes = Cursor::new(Vec::new());
    exr::image::Image::from_layer(layer)
        .write()
        .to_buffered(&mut bytes)
        .map_err(|e| ImageFileError::Codec { path: path.display().to_string(), problem: e.to_string() })?;
    std::fs::write(path, bytes.into_inner()).map_err(|source| ImageFileError::Io {
        path: path.display().to_string(),
        action: "written",
        source,
    })?;
    Ok(image.non_finite())
}

/// Reads the channels `R G B` of the first layer that has them, converted to float32.
///
/// # Errors
/// A file that cannot be read, is no EXR, or lacks a channel.
pub fn read_rgb(path: &Path) -> Result<Image, ImageFileError> {
    let name = || path.display().to_string();
    let bytes =
        std::fs::read(path).map_err(|source| ImageFileError::Io { path: name(), action: "read", source })?;
    let codec = |problem: String| ImageFileError::Codec { path: name(), problem };
    // The header states the size: what it asks for must be in proportion to the file before memory is set aside.
    // The strongest lossless compression of the format is deflate, at most 1032:1.
    let limit = bytes.len().saturating_mul(1100).saturating_add(1 << 20);
    let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(&bytes), true)
        .map_err(|e| codec(e.to_string()))?;
    for header in &meta.headers {
        let size = header.layer_size;
        let texels = size.x().checked_mul(size.y());
        if texels.and_then(|n| n.checked_mul(12)).is_none_or(|n| n > limit) {
            return Err(codec(format!(
                "its header asks for {}×{} pixels, more than it can hold",
                size.x(),
                size.y()
            )));
        }
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required("R")
        .required("G")
        .required("B")
        .collect_pixels(
            |size, _| Image::new([size.x() as u32, size.y() as u32]),
            |image: &mut Image, at, (r, g, b): (f32, f32, f32)| {
                image.pixels[at.y() * image.size[0] as usize + at.x()] = Vec3::new(r, g, b);
            },
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(&bytes))
        .map_err(|e| codec(format!("not an EXR image with channels R, G, B: {e}")))?;
    Ok(image.layer_data.channel_data.pixels)
}
