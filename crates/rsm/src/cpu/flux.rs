//! `flux`: how much light each texel of a map carries, and how much of it the surface reflects.
//!
//! * Perspective: the light sends `I(ω) · ω_texel` through the texel, `ω_texel` its exact solid angle, `I` the intensity
//!   at its centre with the spot's falloff and the range window. No distance and no cosine enters.
//! * Orthographic: `E⊥ · A_texel`. The slope of the surface is in its area, not in its flux (`docs/errata.md`, Radiance
//!   Hints §4).
//!
//! The surface that the texel covers has the area `ω d²/cosθ`, or `A_texel/cosθ`.

use glam::Vec3;
use indirect_core::GBuffer;
use rayon::prelude::*;

use crate::layout::{LightMap, Texel};

/// Least cosine in a footprint's area. Below it (89.1°) the footprint is a strip more than 64 texels long, which the
/// shading normal or the disc form no longer describe; the flux is not touched.
pub const MIN_FOOTPRINT_COSINE: f32 = 1.0 / 64.0;

/// Texels per parallel piece.
const PIECE: usize = 4096;

/// The flux of every texel of one map, row-major.
#[must_use]
pub fn flux(map: &LightMap, surface: &GBuffer) -> Vec<Texel> {
    let mut texels = vec![Texel::default(); surface.len()];
    texels.par_chunks_mut(PIECE).enumerate().for_each(|(piece, out)| {
        for (k, texel) in out.iter_mut().enumerate() {
            let i = piece * PIECE + k;
            if surface.is_surface(i) {
                *texel = flux_texel(map, i as u32, surface.depth[i], surface.normal[i], surface.albedo[i]);
            }
        }
    });
    texels
}

fn flux_texel(map: &LightMap, i: u32, depth: f32, normal: Vec3, albedo: Vec3) -> Texel {
    let n = map.resolution;
    let (x, y) = ((i % n) as f32, (i / n) as f32);
    let inverse = 1.0 / n as f32;
    let step_x = 2.0 * map.half_width * inverse;
    let step_y = 2.0 * map.half_height * inverse;
    // Upper left corner and centre on the image plane.
    let left = (2.0 * x * inverse - 1.0) * map.half_width;
    let top = (1.0 - 2.0 * y * inverse) * map.half_height;
    let cx = left + 0.5 * step_x;
    let cy = top - 0.5 * step_y;

    let incident;
    let across;
    let cos_theta;
    if map.orthographic == 1 {
        across = step_x * step_y;
        incident = map.power * across;
        cos_theta = -normal.dot(map.forward);
    } else {
        let solid_angle = texel_solid_angle(left, top, step_x, step_y);
        // Distance per unit of view depth, and the unit direction of the texel's centre.
        let slant = (1.0 + cx * cx + cy * cy).sqrt();
        let w = (map.forward + map.right * cx + map.up * cy) * (1.0 / slant);
        let d = depth * slant;
        let s = d * map.inverse_range;
        let window = (1.0 - s * s * s * s).clamp(0.0, 1.0);
        let a = ((map.axis.dot(w) - map.cos_outer) * map.spot_scale).clamp(0.0, 1.0);
        incident = map.power * (a * a * window * solid_angle);
        across = solid_angle * d * d;
        cos_theta = -normal.dot(w);
    }
    let area = across / cos_theta.max(MIN_FOOTPRINT_COSINE);
    Texel { incident, pad0: 0.0, reflected: incident * albedo, area }
}

/// Exact solid angle, sr, of the rectangle `[left, left + step_x] × [top − step_y, top]` in the plane at distance 1, in
/// f32 without cancellation.
///
/// The rectangle is two triangles with vertices `a, b, c` in the plane, for which `a · (b × c)` is twice the plane area,
/// `step_x · step_y`, exactly. Van Oosterom & Strackee (1983) give `tan(Ω/2)` as this product over a sum that is
/// positive for any texel below a hemisphere: nothing is subtracted, in contrast to the corner integral of
/// [`indirect_core::solid_angle::rectangle`], whose four terms nearly cancel and need f64.
#[must_use]
pub fn texel_solid_angle(left: f32, top: f32, step_x: f32, step_y: f32) -> f32 {
    let (x0, x1) = (left, left + step_x);
    let (y0, y1) = (top - step_y, top);
    let twice_area = step_x * step_y;
    let l00 = (1.0 + x0 * x0 + y0 * y0).sqrt();
    let l10 = (1.0 + x1 * x1 + y0 * y0).sqrt();
    let l01 = (1.0 + x0 * x0 + y1 * y1).sqrt();
    let l11 = (1.0 + x1 * x1 + y1 * y1).sqrt();
    let d00_10 = 1.0 + x0 * x1 + y0 * y0;
    let d10_11 = 1.0 + x1 * x1 + y0 * y1;
    let d11_01 = 1.0 + x0 * x1 + y1 * y1;
    let d01_00 = 1.0 + x0 * x0 + y0 * y1;
    let d00_11 = 1.0 + x0 * x1 + y0 * y1;
    let lower = l00 * l10 * l11 + d00_10 * l11 + d10_11 * l00 + d00_11 * l10;
    let upper = l00 * l11 * l01 + d00_11 * l01 + d11_01 * l00 + d01_00 * l11;
    2.0 * (arctangent(twice_area, lower) + arctangent(twice_area, upper))
}

/// `atan2(y, x)` for `y ≥ 0`, relative error below 1e-6, for shading languages whose own `atan` promises 4096 ulp.
///
/// Three half-angle steps, `tan(φ/2) = y/(x + √(x²+y²))`, bring the tangent to at most `tan(π/8) = 0.414`; the series to
/// `t¹³` then leaves `0.414¹⁴/15 = 3e-7`.
fn arctangent(y: f32, x: f32) -> f32 {
    let length = (x * x + y * y).sqrt();
    // The second form has no cancellation for x < 0.
    let half = if x >= 0.0 { y / (x + length).max(f32::MIN_POSITIVE) } else { (length - x) / y };
    let quarter = half / (1.0 + (1.0 + half * half).sqrt());
    let t = quarter / (1.0 + (1.0 + quarter * quarter).sqrt());
    let s = t * t;
    let series = 1.0
        + s * (-1.0 / 3.0
            + s * (0.2 + s * (-1.0 / 7.0 + s * (1.0 / 9.0 + s * (-1.0 / 11.0 + s * (1.0 / 13.0))))));
    8.0 * t * series
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f32::consts::PI;
    use glam::Vec2;
    use indirect_core::solid_angle;
    use proptest::prelude::*;

    #[test]
    fn arctangent_is_accurate_over_half_a_turn() {
        for i in 0..=20_000 {
            let angle = f64::from(i) / 20_000.0 * core::f64::consts::PI;
            let (y, x) = angle.sin_cos();
            let (y, x) = (y.max(0.0) as f32, x as f32);
            let exact = f64::from(y).atan2(f64::from(x));
            // The series leaves 3e-7; about ten roundings of 6e-8 come on top.
            assert!((f64::from(arctangent(y, x)) - exact).abs() <= 1e-6 * exact, "{angle}");
        }
        assert_eq!(arctangent(0.0, 1.0), 0.0);
    }

    #[test]
    fn f32_solid_angles_match_the_f64_corner_integral() {
        for (n, half) in [(1_u32, 1.0_f32), (7, 1e-4), (64, 0.3), (512, 1.0), (512, 1.732), (4096, 1.0)] {
            let step = 2.0 * half / n as f32;
            for (x, y) in [(0, 0), (n / 2, n / 2), (n - 1, n / 3), (n / 5, n - 1)] {
                let left = (2.0 * x as f32 / n as f32 - 1.0) * half;
                let top = (1.0 - 2.0 * y as f32 / n as f32) * half;
                let at =
                    |k: u32, sign: f64| sign * (2.0 * f64::from(k) / f64::from(n) - 1.0) * f64::from(half);
                // The corner integral in f64 throughout: core's takes corners rounded to f32, which for a small texel far
                // from the axis costs more than the formula under test.
                let corner = |x: f64, y: f64| (x * y).atan2((1.0 + x * x + y * y).sqrt());
                let (x0, x1, y0, y1) = (at(x, 1.0), at(x + 1, 1.0), at(y + 1, -1.0), at(y, -1.0));
                let exact = corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0);
                let found = f64::from(texel_solid_angle(left, top, step, step));
                // f32 corners off by 6e-8 of the plane's size move the cosine factor by about 3e-7; sums add a few more;
                // the exact value itself cancels to 1e-16/ω.
                assert!((found - exact).abs() <= 2e-6 * exact + 1e-15, "{n} {half} {x} {y}: {found} {exact}");
            }
        }
    }

    #[test]
    fn texels_sum_to_their_frustum_and_six_faces_to_the_sphere() {
        for (n, half) in [(1_u32, 1.0_f32), (5, 0.7), (64, 1.0), (256, 1.5)] {
            let step = 2.0 * half / n as f32;
            let at = |k: u32| 2.0 * k as f32 / n as f32 - 1.0;
            let sum: f64 = (0..n * n)
                .map(|i| {
                    let (left, top) = (at(i % n) * half, -at(i / n) * half);
                    f64::from(texel_solid_angle(left, top, step, step))
                })
                .sum();
            let whole = f64::from(solid_angle::rectangle(Vec2::splat(-half), Vec2::splat(half)));
            assert!((sum / whole - 1.0).abs() < 1e-6, "{n} {half}: {sum} {whole}");
            if half == 1.0 {
                assert!((6.0 * sum / f64::from(4.0 * PI) - 1.0).abs() < 1e-6);
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2048, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn any_rectangle_has_a_finite_positive_solid_angle(
            left in -100.0_f32..100.0, top in -100.0_f32..100.0, exponent in -12_i32..3
        ) {
            let step = 10.0_f32.powi(exponent);
            let omega = texel_solid_angle(left, top, step, step);
            prop_assert!(omega > 0.0 && omega <= 2.0 * PI + 1e-5, "{}", omega);
        }
    }
}
