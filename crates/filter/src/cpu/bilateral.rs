//! `bilateral`: an image at full resolution from one of reduced resolution, guided by the G-buffer (Kopf et al. 2007,
//! "Joint Bilateral Upsampling").

use glam::Vec3;
use indirect_core::GBuffer;

use crate::Reduced;

/// The weighted sum of the four texels of `low` nearest to `pixel`, and the sum of their weights, `[0, 1]`.
///
/// A texel's weight is its bilinear one times how well its surface agrees with the pixel's: `max(1 − 4·out, 0)`, where `out`
/// is the sine of the angle between the pixel's plane and the direction to the texel's surface, times the fourth power of
/// the cosine between both normals. No constant has a unit, so that the scale of the scene does not matter. Where the sum of
/// weights is small no texel shows the surface that the pixel shows, at an edge or on a thin object: the caller decides what
/// to do there.
///
/// # Panics
/// Where `pixel` is not of `surface`, or `surface` or `low` is not of the sizes of `reduced`.
#[must_use]
pub fn bilateral(surface: &GBuffer, reduced: &Reduced, low: &[Vec3], pixel: u32) -> (Vec3, f32) {
    let (p, n) = (surface.position[pixel as usize], surface.normal[pixel as usize]);
    let Reduced { size: [width, _], small, step, .. } = *reduced;
    let place = |pixel: u32| ((pixel as f32 - (step / 2) as f32) / step as f32).max(0.0);
    let (x, y) = (place(pixel % width), place(pixel / width));
    let (x0, y0) = (x.floor(), y.floor());
    let (tx, ty) = (x - x0, y - y0);
    let (mut sum, mut total) = (Vec3::ZERO, 0.0);
    for corner in 0..4_u32 {
        let (right, below) = (corner & 1, corner >> 1);
        let a = (x0 as u32 + right).min(small[0] - 1);
        let b = (y0 as u32 + below).min(small[1] - 1);
        let at = reduced.pixel_of([a, b]) as usize;
        let m = surface.normal[at];
        let d = surface.position[at] - p;
        // How far it is out of the plane, as a share of its distance.
        let distance = d.dot(d).sqrt();
        let out = if distance > 0.0 { n.dot(d).abs() / distance } else { 0.0 };
        let alike = n.dot(m).max(0.0);
        let alike = alike * alike;
        let bilinear = (if right == 1 { tx } else { 1.0 - tx }) * (if below == 1 { ty } else { 1.0 - ty });
        let weight = bilinear * (1.0 - 4.0 * out).max(0.0) * (alike * alike);
        sum += low[(b * small[0] + a) as usize] * weight;
        total += weight;
    }
    (sum, total)
}
