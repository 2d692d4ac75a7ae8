//! Images into linear, filtered-down textures.

use std::collections::HashMap;
use std::io::Cursor;

use glam::{Vec3, Vec4};
use gltf::json::texture::WrappingMode;
use gltf::json::validation::Checked;
use image::{DynamicImage, ImageFormat, ImageReader, Limits};
use indirect_core::{Texture, Wrap};

use super::file::{File, label, short_name};
use crate::SceneLoadError;
use crate::png::linear_from_srgb;

/// Largest external image file that is read, bytes.
const MAX_FILE: u64 = 1 << 28;

/// What a texture holds, which decides how it is decoded and filtered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Content {
    /// sRGB colour; alpha is unused.
    Color,
    /// sRGB colour under an alpha test: colours are averaged in proportion to their alpha, so that the colour that an
    /// image hides under transparent texels does not bleed into solid ones.
    ColorAlpha,
    /// Linear numbers.
    Linear,
}

/// A texture of the file and how to read it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Request {
    pub(super) texture: usize,
    pub(super) content: Content,
}

/// Where an encoded image lies in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Source<'f> {
    View(usize, u64, u64),
    Uri(&'f str),
    /// Nowhere: reading it says why.
    Texture(usize),
}

/// Replaces requests for the same bytes, read and repeated in the same way, by the first of them, and bounds how much is left to
/// decode.
#[derive(Default)]
pub(super) struct Sharing<'f> {
    first: HashMap<(Source<'f>, Content, [Wrap; 2]), Request>,
    /// Encoded bytes of all first requests that lie in buffers.
    bytes: u64,
}

impl<'f> Sharing<'f> {
    /// The request that stands for this one; the error says how the file multiplies its images.
    pub(super) fn first(&mut self, file: &'f File<'_>, request: Request) -> Result<Request, SceneLoadError> {
        let texture = file.root.textures.get(request.texture);
        let image = texture.and_then(|t| file.root.images.get(t.source.value()));
        let source = match image.map(|i| (i.buffer_view.and_then(|v| file.extent(v)), i.uri.as_deref())) {
            Some((Some((buffer, offset, length)), _)) => Source::View(buffer, offset, length),
            Some((None, Some(uri))) => Source::Uri(uri),
            _ => Source::Texture(request.texture),
        };
        let key = (source, request.content, texture.map_or([Wrap::Repeat; 2], |t| wraps(file, t)));
        if let Some(first) = self.first.get(&key) {
            return Ok(*first);
        }
        self.first.insert(key, request);
        let all = file.buffer_bytes() as u64;
        if let Source::View(_, _, length) = source {
            // One that ends beyond its buffer is refused where it is read.
            self.bytes = self.bytes.saturating_add(length.min(all));
        }
        // Views of a sound file do not overlap, and one image is read in at most 3 ways and repeated in 9.
        if self.bytes > all.saturating_mul(27) {
            return Err(file.fault("its images", "share bytes of their buffers: the file is damaged"));
        }
        Ok(request)
    }
}

fn wraps(file: &File<'_>, texture: &gltf::json::Texture) -> [Wrap; 2] {
    let sampler = texture.sampler.and_then(|s| file.root.samplers.get(s.value()));
    sampler.map_or([Wrap::Repeat; 2], |s| [s.wrap_s, s.wrap_t].map(wrap_mode))
}

/// Reads a texture; the error is a clause that names the image and says why it cannot be used.
pub(super) fn read(file: &File<'_>, request: Request, max_size: u32) -> Result<Texture, String> {
    let json = file.root.textures.get(request.texture).ok_or("it does not exist")?;
    let index = json.source.value();
    let Some(image) = file.root.images.get(index) else {
        return Err("it has no PNG or JPEG image".into());
    };
    let name = image.name.as_deref().or(image.uri.as_deref().filter(|u| !u.starts_with("data:")));
    let element = label("image", index, name);
    let bytes = match (&image.buffer_view, &image.uri) {
        (Some(view), _) => {
            file.view(*view, &element).map(|(bytes, _)| bytes.to_vec()).map_err(|e| e.to_string())?
        }
        (None, Some(uri)) => file.read_uri(uri, MAX_FILE, &element).map_err(|e| e.to_string())?,
        (None, None) => return Err(format!("{element} has no data")),
    };
    let pixels = decode(&bytes).map_err(|problem| format!("{element} {problem}"))?;
    drop(bytes);
    let (size, texels) = shrink(&pixels, max_size.max(1), request.content);
    Ok(Texture { name: name.map(short_name).unwrap_or_default(), size, texels, wrap: wraps(file, json) })
}

fn wrap_mode(mode: Checked<WrappingMode>) -> Wrap {
    match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
    }
}

/// Decodes a PNG or JPEG whose size is in proportion to its bytes.
fn decode(bytes: &[u8]) -> Result<DynamicImage, String> {
    let format = image::guess_format(bytes).map_err(|_| "is in no known image format".to_owned())?;
    if !matches!(format, ImageFormat::Png | ImageFormat::Jpeg) {
        return Err(format!("is {format:?}, and only PNG and JPEG are read"));
    }
    let (width, height) = ImageReader::with_format(Cursor::new(bytes), format)
        .into_dimensions()
        .map_err(|e| format!("cannot be decoded: {e}"))?;
    // Deflate expands by at most 1032 and JPEG by less: more than that is a header that lies.
    let limit = (bytes.len() as u64).saturating_mul(1100).saturating_add(1 << 16);
    if u64::from(width) * u64::from(height) > limit {
        return Err(format!("states {width}×{height} pixels, more than its {} bytes can hold", bytes.len()));
    }
    let mut limits = Limits::default();
    limits.max_alloc = Some(limit.saturating_mul(8).min(1 << 30));
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(limits);
    reader.decode().map_err(|e| format!("cannot be decoded: {e}"))
}

/// Mean colour of a texture.
pub(super) fn mean(texture: &Texture) -> Vec3 {
    let sum = texture.texels.iter().fold(glam::DVec3::ZERO, |sum, t| {
        sum + glam::DVec3::new(f64::from(t[0]), f64::from(t[1]), f64::from(t[2]))
    });
    (sum / (65535.0 * texture.texels.len().max(1) as f64)).as_vec3()
}

/// For each of `from` source cells, the first of `to` cells that it overlaps, and the share of that cell and of the next
/// which it covers: an exact area filter, `to ≤ from`.
fn spans(from: u32, to: u32) -> Vec<(usize, [f32; 2])> {
    let scale = f64::from(to) / f64::from(from);
    (0..from)
        .map(|i| {
            let (start, end) = (f64::from(i) * scale, f64::from(i + 1) * scale);
            let first = (start.floor() as usize).min(to as usize - 1);
            let border = ((first + 1) as f64).min(end);
            (
                first,
                [(border - start) as f32, if first + 1 < to as usize { (end - border) as f32 } else { 0.0 }],
            )
        })
        .collect()
}

/// Decodes to linear light and averages down so that neither side exceeds `max`.
fn shrink(image: &DynamicImage, max: u32, content: Content) -> ([u32; 2], Vec<[u16; 4]>) {
    let (width, height) = (image.width(), image.height());
    let scale = (f64::from(max) / f64::from(width.max(height))).min(1.0);
    let side = |n: u32| ((f64::from(n) * scale).round() as u32).clamp(1, max);
    let size = [side(width), side(height)];
    let color = |encoded: f32| if content == Content::Linear { encoded } else { linear_from_srgb(encoded) };
    let deep = matches!(image.color().bytes_per_pixel() / image.color().channel_count(), 2..);
    let table: Vec<f32> = (0..256_u16).map(|i| color(f32::from(i) / 255.0)).collect();
    // Converted row by row: as a whole, a grey image would take four times its memory.
    let texels = |y: u32| -> Vec<Vec4> {
        let row = image.crop_imm(0, y, width, 1);
        if deep {
            let texel = |p: &image::Rgba<u16>| {
                let [r, g, b, a] = p.0.map(|c| f32::from(c) / 65535.0);
                Vec4::new(color(r), color(g), color(b), a)
            };
            return row.to_rgba16().pixels().map(texel).collect();
        }
        let texel = |p: &image::Rgba<u8>| {
            let [r, g, b, a] = p.0;
            let [r, g, b] = [r, g, b].map(|c| table[usize::from(c)]);
            Vec4::new(r, g, b, f32::from(a) / 255.0)
        };
        row.to_rgba8().pixels().map(texel).collect()
    };
    let (columns, rows) = (spans(width, size[0]), spans(height, size[1]));
    let n = size[0] as usize;
    // Per target texel: weighted colour and the sum of its weights; alpha.
    let mut sums = vec![(Vec4::ZERO, 0.0_f32); n * size[1] as usize];
    let mut line = vec![(Vec4::ZERO, 0.0_f32); n];
    for (y, &(row, weights)) in rows.iter().enumerate() {
        line.fill((Vec4::ZERO, 0.0));
        for (t, &(column, weights)) in texels(y as u32).into_iter().zip(&columns) {
            // The small constant keeps the plain mean where everything is transparent.
            let w = if content == Content::ColorAlpha { t.w + 1e-5 } else { 1.0 };
            let colour = (t.truncate() * w).extend(w);
            for (target, weight) in line[column..].iter_mut().zip(weights) {
                target.0 += colour * weight;
                target.1 += t.w * weight;
            }
        }
        for (k, weight) in weights.into_iter().enumerate().filter(|(_, weight)| *weight > 0.0) {
            for (target, source) in sums[(row + k) * n..].iter_mut().zip(&line) {
                target.0 += source.0 * weight;
                target.1 += source.1 * weight;
            }
        }
    }
    let quantize = |c: f32| (c.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16;
    let texels = sums
        .iter()
        .map(|(colour, alpha)| {
            let c = colour.truncate() / colour.w;
            [c.x, c.y, c.z, *alpha].map(quantize)
        })
        .collect();
    (size, texels)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Rgba, RgbaImage};

    fn picture(width: u32, height: u32, f: impl Fn(u32, u32) -> [u8; 4]) -> DynamicImage {
        DynamicImage::ImageRgba8(RgbaImage::from_fn(width, height, |x, y| Rgba(f(x, y))))
    }

    #[test]
    fn every_source_cell_is_shared_out_completely() {
        for (from, to) in [(1, 1), (7, 7), (7, 3), (300, 256), (256, 256), (1000, 1), (5, 2)] {
            let mut covered = vec![0.0; to as usize + 1];
            for (first, weights) in spans(from, to) {
                covered[first] += weights[0];
                covered[first + 1] += weights[1];
                let share = f64::from(to) / f64::from(from);
                // Rounding of the last border only: a few ulp of f32.
                assert!((f64::from(weights[0] + weights[1]) - share).abs() < 1e-6 * share.max(1.0));
            }
            // `from` additions, each rounded to f32.
            assert!(
                covered[..to as usize].iter().all(|c| (c - 1.0).abs() < 1e-7 * from.max(10) as f32),
                "{covered:?}"
            );
            assert_eq!(covered[to as usize], 0.0);
        }
    }

    #[test]
    fn colours_are_averaged_in_linear_light() {
        let black_and_white = picture(64, 32, |x, _| if x % 2 == 0 { [0, 0, 0, 255] } else { [255; 4] });
        let (size, texels) = shrink(&black_and_white, 8, Content::Color);
        assert_eq!(size, [8, 4]);
        // The mean of 0 and 1 is 0.5; averaged as bytes it would be 0.214. Sums of 64 terms: 64 ulp of 2^-16 at most.
        assert!(texels.iter().all(|t| t[0].abs_diff(32768) <= 1), "{texels:?}");
        let (_, texels) = shrink(&picture(1, 1, |_, _| [188, 188, 188, 255]), 8, Content::Linear);
        assert_eq!(texels[0], [188 * 257, 188 * 257, 188 * 257, 65535]);
    }

    #[test]
    fn hidden_colour_does_not_bleed() {
        // Green leaves on transparent red.
        let leaf = picture(32, 32, |x, _| if x % 2 == 0 { [0, 255, 0, 255] } else { [255, 0, 0, 0] });
        let (_, masked) = shrink(&leaf, 4, Content::ColorAlpha);
        assert!(masked.iter().all(|t| t[0] <= 2 && t[1] >= 65533 && t[3].abs_diff(32768) <= 1), "{masked:?}");
        let (_, opaque) = shrink(&leaf, 4, Content::Color);
        assert!(opaque.iter().all(|t| t[0].abs_diff(32768) <= 1), "{opaque:?}");
        let (_, clear) = shrink(&picture(2, 2, |_, _| [255, 0, 0, 0]), 1, Content::ColorAlpha);
        assert_eq!(clear[0], [65535, 0, 0, 0]);
    }

    #[test]
    fn a_header_that_lies_is_refused() {
        let mut png = Vec::new();
        picture(3, 3, |_, _| [9; 4]).write_to(&mut Cursor::new(&mut png), ImageFormat::Png).unwrap();
        assert_eq!(decode(&png).unwrap().width(), 3);
        // IHDR: width at 16, height at 20, its checksum at 29.
        png[16..24].copy_from_slice(&[0, 0, 0xff, 0xff, 0, 0, 0xff, 0xff]);
        let crc = crc32(&png[12..29]);
        png[29..33].copy_from_slice(&crc.to_be_bytes());
        let error = decode(&png).unwrap_err();
        assert!(error.contains("65535×65535"), "{error}");
        assert!(decode(b"RIFF\x10\0\0\0WEBPVP8 ").unwrap_err().contains("WebP"));
        assert!(decode(b"nothing").is_err());
    }

    fn crc32(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(!0_u32, |crc, &b| {
            (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { c >> 1 ^ 0xedb8_8320 } else { c >> 1 })
        })
    }
}
