//! The measures on images whose errors are known by hand.

use approx::assert_relative_eq;
use glam::Vec3;
use indirect_core::Image;
use indirect_metrics::{Measures, MetricsError, Reference, compare, difference, exposure};

fn grey(values: &[f32]) -> Image {
    Image { size: [values.len() as u32, 1], pixels: values.iter().map(|v| Vec3::splat(*v)).collect() }
}

#[test]
fn by_hand() {
    let truth = grey(&[1.0, 2.0, 3.0, 100.0]);
    // The last pixel shows no surface.
    let surface = [true, true, true, false];
    let reference = Reference::exact(&truth, &surface);
    let e = compare(&grey(&[1.0, 2.5, 2.0, 0.0]), &reference).unwrap();
    let m = e.luminance;
    // Differences 0, 0.5, −1; mean of the reference 2.
    assert_relative_eq!(m.bias, -0.5 / 3.0 / 2.0, max_relative = 1e-9);
    assert_relative_eq!(m.rel_rmse, (1.25_f64 / 3.0).sqrt() / 2.0, max_relative = 1e-9);
    assert_relative_eq!(m.rel_mse, (0.25 / 4.04 + 1.0 / 9.04) / 3.0, max_relative = 1e-9);
    assert_relative_eq!(m.p50, 0.25, max_relative = 1e-9);
    assert_relative_eq!(m.p95, 0.5, max_relative = 1e-9);
    assert_relative_eq!(m.p99, 0.5, max_relative = 1e-9);
    assert_eq!(e.pixels, 3);
    for c in e.rgb {
        assert_relative_eq!(c.unwrap().rel_rmse, m.rel_rmse, max_relative = 1e-6);
    }
    assert_eq!(e.noise_floor, Measures::default());
    assert_relative_eq!(exposure(&truth, &surface), 0.09, max_relative = 1e-6);
}

#[test]
fn channels_are_apart() {
    let truth = Image::filled([4, 4], Vec3::new(1.0, 2.0, 0.0));
    let image = Image::filled([4, 4], Vec3::new(1.1, 1.0, 0.0));
    let surface = [true; 16];
    let e = compare(&image, &Reference::exact(&truth, &surface)).unwrap();
    assert_relative_eq!(e.rgb[0].unwrap().bias, 0.1, max_relative = 1e-6);
    assert_relative_eq!(e.rgb[1].unwrap().bias, -0.5, max_relative = 1e-6);
    assert_eq!(e.rgb[2], None);
}

#[test]
fn noise_floor_is_the_score_of_pure_noise() {
    // A reference of mean 1 whose pixels carry a standard error of 0.1, and an image that equals the truth.
    let n = 10_000;
    let noise = |i: u32| if i.is_multiple_of(2) { 0.1 } else { -0.1 };
    let size = [100, 100];
    let noisy = Image { size, pixels: (0..n).map(|i| Vec3::splat(1.0 + noise(i))).collect() };
    let truth = Image::filled(size, Vec3::ONE);
    let (surface, error) = (vec![true; n as usize], Image::filled(size, Vec3::splat(0.1)));
    let reference = Reference {
        image: &noisy,
        surface: &surface,
        standard_error: Some(&error),
        relative_mean_error: None,
    };
    let e = compare(&truth, &reference).unwrap();
    assert_relative_eq!(e.noise_floor.rel_rmse, 0.1, max_relative = 1e-6);
    assert_relative_eq!(e.noise_floor.bias, 0.1 / 100.0, max_relative = 1e-6);
    assert_relative_eq!(e.luminance.rel_rmse, e.noise_floor.rel_rmse, max_relative = 1e-6);
    assert_relative_eq!(e.luminance.rel_mse, e.noise_floor.rel_mse, max_relative = 1e-6);
    let below = e.luminance.below_floor(&e.noise_floor);
    assert!(below.bias && below.rel_rmse && below.rel_mse && below.p50 && below.p95 && below.p99);
    // An error of its own of twice the floor stands out.
    let e = compare(&Image::filled(size, Vec3::splat(1.2)), &reference).unwrap();
    let below = e.luminance.below_floor(&e.noise_floor);
    assert!(!below.bias && !below.rel_rmse && !below.rel_mse);
}

/// Where all pixels of the reference are wrong together, their number does not lower the floor of the bias.
#[test]
fn a_mean_error_of_its_own_is_the_floor_of_the_bias() {
    // The truth is 1; every pixel is 2 % too bright, which is within a standard error of 3 % that all of them share.
    let size = [100, 100];
    let (noisy, truth) = (Image::filled(size, Vec3::splat(1.02)), Image::filled(size, Vec3::ONE));
    let (surface, error) = (vec![true; 10_000], Image::filled(size, Vec3::splat(0.03)));
    let reference = |relative_mean_error| Reference {
        image: &noisy,
        surface: &surface,
        standard_error: Some(&error),
        relative_mean_error,
    };
    let independent = compare(&truth, &reference(None)).unwrap();
    assert_relative_eq!(independent.noise_floor.bias, 0.03 / 1.02 / 100.0, max_relative = 1e-6);
    let shared = compare(&truth, &reference(Some(0.03))).unwrap();
    let others = Measures { bias: independent.noise_floor.bias, ..shared.noise_floor };
    assert_eq!((shared.noise_floor.bias, others), (0.03, independent.noise_floor));
    let hidden = |c: &indirect_metrics::Comparison| c.luminance.below_floor(&c.noise_floor).bias;
    assert!(hidden(&shared) && !hidden(&independent));
    // It stands alone too.
    let alone = Reference { relative_mean_error: Some(0.5), ..Reference::exact(&noisy, &surface) };
    assert_eq!(compare(&truth, &alone).unwrap().noise_floor, Measures { bias: 0.5, ..Measures::default() });
    for bad in [-0.1, f64::NAN, f64::INFINITY] {
        let error = compare(&truth, &reference(Some(bad))).unwrap_err();
        assert!(matches!(error, MetricsError::Parameter { .. }), "{error}");
    }
}

#[test]
fn biases_of_a_chain_add_up() {
    let (truth, middle, last) = (grey(&[1.0, 2.0, 4.0]), grey(&[0.5, 2.5, 3.0]), grey(&[0.75, 1.0, 3.5]));
    let surface = [true; 3];
    let reference = Reference::exact(&truth, &surface);
    let whole = compare(&last, &reference).unwrap().luminance;
    assert_eq!(difference(&last, &truth, &reference).unwrap(), whole);
    let parts =
        [(&middle, &truth), (&last, &middle)].map(|(a, b)| difference(a, b, &reference).unwrap().bias);
    assert_relative_eq!(parts[0] + parts[1], whole.bias, max_relative = 1e-9);
    assert_eq!(difference(&last, &last, &reference).unwrap(), Measures::default());
}

#[test]
fn small_differences_of_many_pixels_survive() {
    // Two ulp in every pixel: lost at once in an f32 sum.
    let size = [16_384, 1];
    let truth = Image::filled(size, Vec3::ONE);
    let image = Image::filled(size, Vec3::splat(1.0 + 2.0 * f32::EPSILON));
    let surface = vec![true; 16_384];
    let e = compare(&image, &Reference::exact(&truth, &surface)).unwrap();
    assert_relative_eq!(e.luminance.bias, f64::from(2.0 * f32::EPSILON), max_relative = 1e-6);
}

#[test]
fn bad_input_is_a_typed_error() {
    let one = grey(&[1.0, 1.0]);
    let call = |image: &Image, truth: &Image, surface: &[bool], error: Option<&Image>| {
        compare(image, &Reference { image: truth, surface, standard_error: error, relative_mean_error: None })
            .unwrap_err()
    };
    let both = [true, true];
    assert!(matches!(call(&grey(&[1.0]), &one, &both, None), MetricsError::SizeMismatch { .. }));
    assert!(matches!(call(&one, &one, &[true], None), MetricsError::SizeMismatch { .. }));
    assert!(matches!(call(&one, &one, &both, Some(&grey(&[0.0]))), MetricsError::SizeMismatch { .. }));
    let empty = Image::new([0, 0]);
    assert_eq!(call(&empty, &empty, &[], None), MetricsError::Empty);
    assert_eq!(call(&one, &one, &[false, false], None), MetricsError::NoSurface);
    assert_eq!(call(&one, &grey(&[0.0, 0.0]), &both, None), MetricsError::BlackReference);
    for bad in [f32::NAN, f32::INFINITY] {
        let bad = grey(&[1.0, bad]);
        let what = |what| MetricsError::NonFinite { what, x: 1, y: 0 };
        assert_eq!(call(&bad, &one, &both, None), what("the image"));
        assert_eq!(call(&one, &bad, &both, None), what("the reference"));
        assert_eq!(call(&one, &one, &both, Some(&bad)), what("the standard error"));
    }
}
