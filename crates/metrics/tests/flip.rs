//! FLIP against the values that the authors' own implementation (`flip-evaluator` 1.7, LDR) gives for a synthetic pair.

use glam::Vec3;
use indirect_core::Image;
use indirect_metrics::{MetricsError, flip};

const SIZE: [u32; 2] = [48, 40];

/// A smooth colourful image with a disc, and a copy with bands, a green patch, one white pixel and a dark corner.
fn pair() -> (Image, Image) {
    let (mut reference, mut test) = (Image::new(SIZE), Image::new(SIZE));
    for y in 0..SIZE[1] {
        for x in 0..SIZE[0] {
            let i = (y * SIZE[0] + x) as usize;
            let (u, v) = ((f64::from(x) + 0.5) / 48.0, (f64::from(y) + 0.5) / 40.0);
            let mut r = glam::DVec3::new(u, v, 0.5 + 0.5 * (12.0 * u).sin() * (9.0 * v).cos());
            if (u - 0.3).powi(2) + (v - 0.6).powi(2) < 0.04 {
                r = glam::DVec3::new(0.9, 0.2, 0.1);
            }
            let mut t = r * (1.0 + 0.15 * (20.0 * v).sin());
            if (5..9).contains(&y) && (30..40).contains(&x) {
                t = glam::DVec3::new(0.1, 0.8, 0.1);
            }
            if (x, y) == (20, 20) {
                t = glam::DVec3::ONE;
            }
            if y >= 30 && x < 8 {
                t *= 0.5;
            }
            let unit = |p: glam::DVec3| p.clamp(glam::DVec3::ZERO, glam::DVec3::ONE).as_vec3();
            (reference.pixels[i], test.pixels[i]) = (unit(r), unit(t));
        }
    }
    (reference, test)
}

#[test]
fn agrees_with_the_authors_implementation() {
    let (reference, test) = pair();
    let map = flip::linear_ldr(&test, &reference, flip::PIXELS_PER_DEGREE).unwrap();
    // Both compute in f32. The map is steep where the difference is small (colour distances enter with the power 0.7, feature
    // differences with 0.5), which turns their 1e-6 rounding into at most about 1e-3 per pixel and leaves the mean within 1e-5.
    let expected = [
        ([0, 0], 0.131_875),
        ([35, 7], 0.979_277),
        ([20, 20], 0.377_246),
        ([22, 21], 0.273_501),
        ([4, 35], 0.894_008),
        ([14, 24], 0.152_105),
        ([47, 39], 0.245_668),
        ([30, 12], 0.261_609),
    ];
    for ([x, y], value) in expected {
        let found = map.values[y * 48 + x];
        assert!((found - value).abs() < 1e-3, "({x}, {y}): {found} instead of {value}");
    }
    let all = vec![true; 48 * 40];
    assert!((map.mean(&all) - 0.274_649_53).abs() < 1e-5, "{}", map.mean(&all));
    let coarse = flip::linear_ldr(&test, &reference, 30.0).unwrap().mean(&all);
    assert!((coarse - 0.268_476_78).abs() < 1e-5, "{coarse}");
}

#[test]
fn equal_images_do_not_differ_and_opposite_ones_do() {
    let (reference, _) = pair();
    let all = vec![true; reference.pixels.len()];
    let zero = flip::map(&reference, &reference, 0.7).unwrap();
    assert!(zero.values.iter().all(|v| *v == 0.0));
    let black = Image::filled([16, 16], Vec3::ZERO);
    let white = Image::filled([16, 16], Vec3::ONE);
    let one = flip::map(&white, &black, 1.0).unwrap();
    assert!(one.values.iter().all(|v| *v > 0.9 && *v <= 1.0), "{:?}", one.values[0]);
    assert_eq!(flip::map(&reference, &reference, 1.0).unwrap().mean(&all), 0.0);
}

#[test]
fn bad_input_is_named() {
    let a = Image::new([2, 2]);
    let call = |image: &Image, exposure| flip::map(image, &a, exposure).unwrap_err().to_string();
    assert_eq!(call(&Image::new([2, 3]), 1.0), "the image has 6 pixels (2×3), the reference has 4");
    assert_eq!(call(&a, 0.0), "exposure is 0, it must be positive");
    assert_eq!(call(&Image::filled([2, 2], Vec3::NAN), 1.0), "the image: pixel (0, 0) is not finite");
    let bright = Image::filled([2, 2], Vec3::splat(2.0));
    let e = flip::linear_ldr(&bright, &a, 60.0).unwrap_err();
    assert!(matches!(e, MetricsError::Parameter { parameter: "the image", .. }));
    assert!(flip::linear_ldr(&a, &a, f32::NAN).is_err());
    let empty = Image::new([0, 2]);
    assert_eq!(flip::map(&empty, &empty, 1.0), Err(MetricsError::Empty));
}
