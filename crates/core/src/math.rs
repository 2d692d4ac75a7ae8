//! Orthonormal bases, robust ray origins, luminance.

use glam::Vec3;

/// Two unit vectors that complete the unit vector `n` to a right-handed orthonormal basis `(t, b, n)`.
///
/// Branchless and accurate everywhere, `n = (0, 0, −1)` included (Duff et al. 2017, "Building an Orthonormal Basis,
/// Revisited", JCGT 6(1), listing 3).
#[must_use]
#[inline]
pub fn orthonormal_basis(n: Vec3) -> (Vec3, Vec3) {
    // Not by the sign's bit: a shader cannot tell −0 from 0, and two bases would differ.
    let sign = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), Vec3::new(b, sign + n.y * n.y * a, -n.y))
}

/// Moves a surface point `p` off its surface along `n`, the unit geometric normal that points to the side the new ray
/// leaves to, so that the ray does not meet its own surface again: [`offset_ray_origin_scaled`] for a scene of 1 m.
#[must_use]
#[inline]
pub fn offset_ray_origin(p: Vec3, n: Vec3) -> Vec3 {
    offset_ray_origin_scaled(p, n, 1.0)
}

/// Moves a surface point `p` by `2⁻¹⁷·unit + 2⁻²⁰·Σ|nᵢpᵢ|` along the unit normal `n`. `unit` is the scene's
/// characteristic length, metres (for example its bounding box diagonal); the result scales with the scene.
///
/// With `u = 2⁻²⁴`: a point interpolated from the vertices is off its plane by up to `6u·Σ|nᵢpᵢ|`, to which the move
/// itself adds `u·Σ|nᵢpᵢ|`, and a ray query errs by some `u` of the triangle's size, more for slivers. The move is
/// `16u` and `128u` of these. Wächter & Binder (2019, "A Fast and Robust Method for Avoiding Self-Intersection", Ray
/// Tracing Gems, chapter 6) move each coordinate by `256·nᵢ` of its own ulp instead; that fails where one coordinate is
/// large and the normal nearly perpendicular to its axis, since the error then grows with `|nᵢ|` but the move with `nᵢ²`.
#[must_use]
#[inline]
pub fn offset_ray_origin_scaled(p: Vec3, n: Vec3, unit: f32) -> Vec3 {
    const OF_UNIT: f32 = 1.0 / 131_072.0;
    const OF_COORDINATES: f32 = 1.0 / 1_048_576.0;
    p + n * (OF_UNIT * unit + OF_COORDINATES * n.abs().dot(p.abs()))
}

/// Luminance of linear RGB with the BT.709 primaries, in the unit of its argument.
#[must_use]
#[inline]
pub fn luminance(rgb: Vec3) -> f32 {
    rgb.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// `1 − cos(α + β)` from `a = 1 − cos α` and `b = 1 − cos β`, 2 from half a turn on: how cones of directions add up. Versines
/// keep their digits for narrow cones, where a cosine near 1 has none.
#[must_use]
#[inline]
pub fn versine_of_sum(a: f32, b: f32) -> f32 {
    if a + b >= 2.0 {
        return 2.0;
    }
    let sines = (a * (2.0 - a) * b * (2.0 - b)).max(0.0).sqrt();
    (a + b - a * b + sines).min(2.0)
}

/// `v / |v|`, or `fallback` where `v` is zero, not finite or too small to normalize.
#[must_use]
#[inline]
pub fn normalize_or(v: Vec3, fallback: Vec3) -> Vec3 {
    // Scaling first keeps the squared length inside f32's range for any finite v.
    let m = v.abs().max_element();
    if !(m > 0.0 && v.is_finite()) {
        return fallback;
    }
    (v / m).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn unit_vector() -> impl Strategy<Value = Vec3> {
        (-1.0_f32..=1.0, 0.0_f32..core::f32::consts::TAU).prop_map(|(z, phi)| {
            let r = (1.0 - z * z).max(0.0).sqrt();
            Vec3::new(r * phi.cos(), r * phi.sin(), z).normalize()
        })
    }

    fn assert_orthonormal(n: Vec3) {
        let (t, b) = orthonormal_basis(n);
        // Dots in f64, so that only the basis' own rounding counts. |n|² is 1 to two roundings (2.4e-7), which t·b inherits,
        // and the products round once more.
        for (a, b) in [(t, b), (t, n), (b, n)] {
            let dot = a.as_dvec3().dot(b.as_dvec3());
            assert!(dot.abs() <= 4e-7, "{n} {a} {b} {dot}");
        }
        assert!((t.length() - 1.0).abs() <= 3e-7 && (b.length() - 1.0).abs() <= 3e-7, "{n}");
        assert!(t.cross(b).dot(n) > 0.999_999, "{n} is left-handed");
    }

    /// Shaders compare, and to them both zeros are one.
    #[test]
    fn basis_of_minus_zero_is_that_of_zero() {
        let n = Vec3::new(0.6, 0.8, 0.0);
        assert_eq!(orthonormal_basis(n), orthonormal_basis(n.with_z(-0.0)));
    }

    #[test]
    fn basis_at_the_axes_and_near_the_pole() {
        for n in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z] {
            assert_orthonormal(n);
        }
        for e in [1e-3_f32, 1e-5, 1e-7, 1e-20] {
            assert_orthonormal(Vec3::new(e, -e, -1.0).normalize());
            assert_orthonormal(Vec3::new(e, -e, 1.0).normalize());
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4096))]

        #[test]
        fn basis_is_orthonormal(n in unit_vector()) {
            assert_orthonormal(n);
        }

        #[test]
        fn offset_leaves_on_the_normal_side_and_stays_close(
            n in unit_vector(), p in prop::array::uniform3(-1e5_f32..1e5), exponent in -3_i32..3
        ) {
            let unit = 10.0_f32.powi(exponent);
            let p = Vec3::from(p);
            let q = offset_ray_origin_scaled(p, n, unit);
            prop_assert!(q.is_finite());
            // No axis moves against the normal.
            prop_assert!(((q - p) * n).min_element() >= 0.0);
            // Farther from the plane through p than six roundings of each coordinate may be wrong, though the result
            // is rounded too; and no farther than the stated distance and that rounding.
            let weight = n.abs().dot(p.abs()) * (f32::EPSILON / 2.0);
            let moved = (q.as_dvec3() - p.as_dvec3()).dot(n.as_dvec3()) as f32;
            prop_assert!(moved > 6.0 * weight, "{} {} {}", p, q, moved);
            let bound = unit / 131_072.0 + 17.0 * weight;
            prop_assert!(moved <= bound * 1.001, "{} {} {} {}", p, q, moved, bound);
        }
    }

    #[test]
    fn normalize_survives_extremes() {
        assert_eq!(normalize_or(Vec3::ZERO, Vec3::Y), Vec3::Y);
        assert_eq!(normalize_or(Vec3::new(f32::NAN, 1.0, 0.0), Vec3::Y), Vec3::Y);
        for s in [1e-38_f32, 1e-20, 1e20, 1e38] {
            let v = normalize_or(Vec3::new(s, -s, 0.0), Vec3::Y);
            assert!((v - Vec3::new(1.0, -1.0, 0.0).normalize()).length() < 1e-6, "{s}");
        }
    }

    #[test]
    fn angles_add_as_versines() {
        for i in 0..50 {
            for k in 0..50 {
                let (a, b) = (f64::from(i) * 0.07, f64::from(k) * 0.07);
                if a > core::f64::consts::PI || b > core::f64::consts::PI {
                    continue;
                }
                let exact = if a + b >= core::f64::consts::PI { 2.0 } else { 1.0 - (a + b).cos() };
                let found = versine_of_sum((1.0 - a.cos()) as f32, (1.0 - b.cos()) as f32);
                assert!((f64::from(found) - exact).abs() < 2e-6, "{a} {b}: {found} {exact}");
            }
        }
    }
}
