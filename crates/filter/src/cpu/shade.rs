//! `shade`: the radiance that leaves each pixel, `ρ/π · E`.

use core::f32::consts::FRAC_1_PI;

use glam::Vec3;
use indirect_core::{GBuffer, Image};

/// The radiance that leaves each pixel of `surface`, W/(sr·m²), from the irradiance per pixel, W/m².
#[must_use]
pub fn shade(surface: &GBuffer, irradiance: &[Vec3]) -> Image {
    let pixels = surface.albedo.iter().zip(irradiance).map(|(a, e)| *a * FRAC_1_PI * *e);
    Image { size: surface.size, pixels: pixels.collect() }
}

/// The same where `irradiance` belongs to the pixels `texels` alone; every other pixel is 0.
///
/// # Panics
/// Where `texels` names a pixel that `surface` does not have.
#[must_use]
pub fn shade_texels(surface: &GBuffer, texels: &[u32], irradiance: &[Vec3]) -> Image {
    let mut image = Image::new(surface.size);
    for (&i, e) in texels.iter().zip(irradiance) {
        image.pixels[i as usize] = surface.albedo[i as usize] * FRAC_1_PI * *e;
    }
    image
}
