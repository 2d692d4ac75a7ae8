//! EXR and PNG.

use std::path::Path;

use glam::Vec3;
use indirect_core::Image;
use indirect_scene::{ImageFileError, exr, png};

fn gradient(size: [u32; 2]) -> Image {
    let n = size[0] * size[1];
    let pixels = (0..n).map(|i| Vec3::new(i as f32 * 0.37, 1e-30 * i as f32, -(i as f32) * 1e20)).collect();
    Image { size, pixels }
}

#[test]
fn exr_keeps_every_bit() {
    let dir = tempfile::tempdir().unwrap();
    for size in [[1, 1], [7, 3], [64, 33]] {
        let path = dir.path().join("image.exr");
        let image = gradient(size);
        assert_eq!(exr::write_rgb(&path, &image).unwrap(), 0);
        assert_eq!(exr::read_rgb(&path).unwrap(), image);
    }
}

#[test]
fn exr_channels_are_float32_and_named_r_g_b() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("image.exr");
    exr::write_rgb(&path, &gradient([3, 2])).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    assert_eq!(bytes[..4], 20000630_u32.to_le_bytes());
    // The channel list: name, pixel type 2 (float32), in alphabetical order.
    let list: Vec<u8> = ["B", "G", "R"]
        .iter()
        .flat_map(|name| {
            let mut channel = name.as_bytes().to_vec();
            channel.push(0);
            channel.extend(2_i32.to_le_bytes());
            channel
        })
        .collect();
    for (k, channel) in list.chunks(6).enumerate() {
        let found = bytes.windows(6).position(|w| w == channel);
        assert!(found.is_some(), "channel {k} is missing");
    }
}

#[test]
fn what_is_not_finite_is_counted_and_kept() {
    let dir = tempfile::tempdir().unwrap();
    let mut image = gradient([4, 4]);
    image.pixels[5] = Vec3::new(f32::NAN, f32::INFINITY, 1.0);
    let path = dir.path().join("image.exr");
    assert_eq!(exr::write_rgb(&path, &image).unwrap(), 2);
    let back = exr::read_rgb(&path).unwrap();
    assert!(back.pixels[5].x.is_nan() && back.pixels[5].y.is_infinite() && back.pixels[4] == image.pixels[4]);
    let path = dir.path().join("image.png");
    assert_eq!(png::write_srgb(&path, &image, 1.0).unwrap(), 2);
    let decoded = image::load_from_memory(&std::fs::read(&path).unwrap()).unwrap().to_rgb8();
    assert_eq!(decoded.get_pixel(1, 1).0, [255, 0, 255]);
}

#[test]
fn png_encodes_srgb_after_the_exposure() {
    let image =
        Image { size: [2, 1], pixels: vec![Vec3::new(0.25, 0.0, 9.0), Vec3::new(-1.0, 0.001, 0.107_25)] };
    let bytes = png::encode_srgb(&image, 2.0).unwrap();
    let decoded = image::load_from_memory(&bytes).unwrap().to_rgb8();
    // By the standard's formula: 0.5 → 188, 0.002 → 12.92·0.002·255 = 6.6, 0.2145 → 128.0.
    assert_eq!(decoded.get_pixel(0, 0).0, [188, 0, 255]);
    assert_eq!(decoded.get_pixel(1, 0).0, [0, 7, 128]);
    for i in 0..=255_u16 {
        let c = f32::from(i) / 255.0;
        assert!((png::srgb_from_linear(png::linear_from_srgb(c)) - c).abs() < 1e-5);
    }
}

#[test]
fn failures_name_the_file() {
    let image = gradient([2, 2]);
    let nowhere = Path::new("/no/such/folder/image.exr");
    let error = exr::write_rgb(nowhere, &image).unwrap_err();
    assert!(matches!(error, ImageFileError::Io { action: "written", .. }), "{error}");
    assert!(error.to_string().starts_with("/no/such/folder/image.exr: cannot be written: "), "{error}");
    assert!(png::write_srgb(nowhere, &image, 1.0).unwrap_err().to_string().contains("cannot be written"));
    assert!(exr::read_rgb(nowhere).unwrap_err().to_string().contains("cannot be read"));
    let empty = Image::new([0, 5]);
    assert!(matches!(exr::write_rgb(nowhere, &empty), Err(ImageFileError::Size { size: [0, 5] })));
    assert!(matches!(png::encode_srgb(&empty, 1.0), Err(ImageFileError::Size { .. })));
}

#[test]
fn damaged_exr_files_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("image.exr");
    exr::write_rgb(&path, &gradient([16, 16])).unwrap();
    let sound = std::fs::read(&path).unwrap();
    for end in (0..sound.len()).step_by(29) {
        std::fs::write(&path, &sound[..end]).unwrap();
        assert!(exr::read_rgb(&path).is_err(), "{end} of {} bytes", sound.len());
    }
    // Flipped bits: a picture or an error.
    for i in 0..200 {
        let mut flipped = sound.clone();
        flipped[i * sound.len() / 200] ^= 1 << (i % 8);
        std::fs::write(&path, &flipped).unwrap();
        if let Ok(image) = exr::read_rgb(&path) {
            assert_eq!(image.pixels.len(), image.size[0] as usize * image.size[1] as usize);
        }
    }
    // A header that asks for 2^30 pixels: the data window's far corner, and the number of 64² tiles to go with it. The
    // fields of an attribute are its name, its type, both ended by 0, and its size.
    let mut huge = sound.clone();
    let field = |name: &[u8], kind: usize| {
        sound.windows(name.len()).position(|w| w == name).unwrap() + name.len() + kind + 6
    };
    for (at, value) in [
        (field(b"dataWindow", 5) + 8, 32767_i32),
        (field(b"dataWindow", 5) + 12, 32767),
        (field(b"chunkCount", 3), 512 * 512),
    ] {
        huge[at..at + 4].copy_from_slice(&value.to_le_bytes());
    }
    std::fs::write(&path, &huge).unwrap();
    let error = exr::read_rgb(&path).unwrap_err().to_string();
    assert!(error.contains("32768×32768"), "{error}");
    std::fs::write(&path, b"no image").unwrap();
    assert!(exr::read_rgb(&path).is_err());
}
