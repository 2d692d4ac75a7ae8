//! Directions of a spot light in proportion to its intensity.

use glam::{Vec2, Vec3};
use indirect_sampling::mapping::disc_concentric;

use crate::layout::PunctualLight;

/// A direction about z, by inversion: within the inner cone evenly, and with the density of the falloff `a²`, whose share beyond an angle
/// grows with the cube of `a`.
pub(super) fn spot_direction(light: &PunctualLight, u: Vec2) -> Vec3 {
    // Full intensity is reached at this cosine, unless even the axis is short of it.
    let edge = (light.cos_outer + 1.0 / light.spot_scale).min(1.0);
    let fall = edge - light.cos_outer;
    let inner = 1.0 - edge;
    let brightest = fall * light.spot_scale;
    let falloff = fall * (brightest * brightest) * (1.0 / 3.0);
    let p = disc_concentric(u);
    let r2 = p.length_squared().min(1.0);
    let q = r2 * (inner + falloff);
    // 1 − cosθ.
    let mut h = q;
    if q >= inner {
        let rest = ((inner + falloff - q) / falloff.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        h = (1.0 - light.cos_outer) - fall * cube_root(rest);
    }
    let sine = (h * (2.0 - h)).max(0.0).sqrt();
    (p * (sine / r2.sqrt().max(f32::MIN_POSITIVE))).extend(1.0 - h)
}

/// The cube root of a number in `[0, 1]`, to 3·10⁻⁷, with the same steps in WGSL, whose `pow` may be coarse.
fn cube_root(x: f32) -> f32 {
    // A third of the exponent, then Newton.
    let mut y = f32::from_bits(x.to_bits() / 3 + 709_921_077);
    for _ in 0..3 {
        y = (y + y + x / (y * y)) * (1.0 / 3.0);
    }
    y
}

#[cfg(test)]
mod tests {
    use super::cube_root;

    #[test]
    fn cube_roots_are_those_of_f64() {
        assert!(cube_root(0.0) < 1e-12);
        for i in 1..=100_000_u32 {
            for x in [i as f32 * 1e-5, (-(i as f32) * 5e-4).exp()] {
                let exact = f64::from(x).cbrt();
                // The last step rounds three times; what it begins with is off by 10⁻⁵ and no more, whose square counts.
                assert!((f64::from(cube_root(x)) / exact - 1.0).abs() < 3e-7, "{x}");
            }
        }
    }
}
