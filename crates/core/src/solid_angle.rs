//! Exact solid angles of rectangles and triangles.

use glam::{Vec2, Vec3};

/// Solid angle, sr, of the rectangle `[lo.x, hi.x] × [lo.y, hi.y]` in the plane at distance 1, seen from the origin.
///
/// This is the exact size of a texel of a perspective map whose tangent-plane corners are `lo` and `hi`. The corner
/// integral `∫∫ (1+x²+y²)^(-3/2) = atan(xy / √(1+x²+y²))` is summed in f64: its four terms nearly cancel for small
/// texels far from the axis.
#[must_use]
pub fn rectangle(lo: Vec2, hi: Vec2) -> f32 {
    let corner = |x: f32, y: f32| {
        let (x, y) = (f64::from(x), f64::from(y));
        (x * y).atan2((1.0 + x * x + y * y).sqrt())
    };
    (corner(hi.x, hi.y) - corner(lo.x, hi.y) - corner(hi.x, lo.y) + corner(lo.x, lo.y)) as f32
}

/// Solid angle, sr, of the triangle `(a, b, c)` seen from the origin, `[0, 2π]`, without a sign (Van Oosterom & Strackee
/// 1983, "The Solid Angle of a Plane Triangle").
#[must_use]
pub fn triangle(a: Vec3, b: Vec3, c: Vec3) -> f32 {
    let (a, b, c) = (a.as_dvec3().normalize(), b.as_dvec3().normalize(), c.as_dvec3().normalize());
    let numerator = a.dot(b.cross(c)).abs();
    let denominator = 1.0 + a.dot(b) + b.dot(c) + c.dot(a);
    (2.0 * numerator.atan2(denominator)) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use core::f32::consts::PI;

    #[test]
    fn six_faces_are_the_sphere_and_texels_sum_to_their_face() {
        let face = rectangle(Vec2::NEG_ONE, Vec2::ONE);
        assert_relative_eq!(6.0 * face, 4.0 * PI, max_relative = 1e-6);
        let n = 64;
        let at = |i: u32| i as f32 / n as f32 * 2.0 - 1.0;
        let sum: f64 = (0..n * n)
            .map(|i| (i % n, i / n))
            .map(|(x, y)| f64::from(rectangle(Vec2::new(at(x), at(y)), Vec2::new(at(x + 1), at(y + 1)))))
            .sum();
        assert_relative_eq!(sum, f64::from(face), max_relative = 1e-6);
    }

    #[test]
    fn small_texels_far_off_axis_keep_their_digits() {
        // d/dx d/dy of the corner integral is (1+x²+y²)^(-3/2); a texel of 1e-4 has a curvature error below 1e-7.
        let (p, h) = (Vec2::new(3.0, -2.0), 1e-3);
        let exact = (h * h) / (1.0 + p.length_squared()).powf(1.5);
        let half = Vec2::splat(h / 2.0);
        // lo and hi are rounded to f32: 2^-22 / 1e-3 of the side.
        assert_relative_eq!(rectangle(p - half, p + half), exact, max_relative = 1e-3);
    }

    #[test]
    fn octant_and_rectangle_agree() {
        assert_relative_eq!(triangle(Vec3::X, Vec3::Y, Vec3::Z), PI / 2.0, max_relative = 1e-6);
        let (a, b) = (Vec3::new(-0.2, 0.1, 1.0), Vec3::new(0.7, 0.1, 1.0));
        let (c, d) = (Vec3::new(0.7, 0.9, 1.0), Vec3::new(-0.2, 0.9, 1.0));
        assert_relative_eq!(
            triangle(a, b, c) + triangle(a, c, d),
            rectangle(Vec2::new(-0.2, 0.1), Vec2::new(0.7, 0.9)),
            max_relative = 1e-5
        );
    }
}
