//! Means over the pixels in which the reference sees a surface.

/// Mean over pixels whose `surface` entry is set, in f64; 0 without any.
pub(crate) fn mean(values: &[f32], surface: &[bool]) -> f64 {
    let (sum, n) = values
        .iter()
        .zip(surface)
        .filter(|(_, seen)| **seen)
        .fold((0.0, 0_usize), |(sum, n), (v, _)| (sum + f64::from(*v), n + 1));
    if n == 0 { 0.0 } else { sum / n as f64 }
}
