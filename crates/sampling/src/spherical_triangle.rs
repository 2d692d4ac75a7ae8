//! Uniform directions towards a triangle, per solid angle (Arvo 1995; the half-angle form of Peters 2021, "BRDF
//! Importance Sampling for Polygonal Lights").
//!
//! Near a triangle this takes the cosine at the light and the distance out of the estimate, which area sampling leaves in.
//!
//! ```
//! use glam::{Vec2, Vec3};
//! use indirect_sampling::spherical_triangle::SphericalTriangle;
//!
//! // An octant.
//! let triangle = SphericalTriangle::new([Vec3::X, Vec3::Y, Vec3::Z]).unwrap();
//! assert!((triangle.solid_angle() - core::f32::consts::FRAC_PI_2).abs() < 1e-6);
//! let u = Vec2::new(0.2, 0.7);
//! let d = triangle.sample(u);
//! assert!(d.min_element() >= 0.0 && triangle.invert(d).distance(u) < 1e-6);
//! ```

use glam::{Vec2, Vec3};

use crate::math::{atan2, sin_cos, sqrt};

/// A triangle on the unit sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphericalTriangle {
    a: Vec3,
    b: Vec3,
    c: Vec3,
    /// Unit tangent at `a` towards `c`.
    tangent: Vec3,
    /// `a × b · tangent`, positive, `1 + a·b` and `b · tangent`.
    det: f32,
    one_plus_ab: f32,
    b_tangent: f32,
    solid_angle: f32,
}

impl SphericalTriangle {
    /// Below this many steradians, where a triangle is flat, rounding outweighs what is gained over area sampling: the vertices
    /// are rounded to `2⁻²⁴` and its height is about `2⁻⁶`.
    pub const MIN_SOLID_ANGLE: f32 = 3e-4;

    /// The triangle of three directions of unit length, in any order.
    ///
    /// `None` below [`Self::MIN_SOLID_ANGLE`], and where the three directions nearly lie in one plane through the centre (their
    /// determinant is below the same number): a sliver, an edge that is degenerate or half a turn, almost a hemisphere. There
    /// rounding decides; sample by area.
    #[must_use]
    pub fn new([a, b, c]: [Vec3; 3]) -> Option<Self> {
        // Differences of nearby directions are exact; products of the directions themselves would cancel.
        let (ab, ac) = (b - a, c - a);
        let volume = a.dot(ab.cross(ac));
        let (b, c, ab, ac) = if volume < 0.0 { (c, b, ac, ab) } else { (b, c, ab, ac) };
        let one_plus_ab = 1.0 + a.dot(b);
        let solid_angle = 2.0 * atan2(volume.abs(), one_plus_ab + a.dot(c) + b.dot(c));
        let tangent = (ac - a * a.dot(ac)).normalize_or_zero();
        let det = a.cross(ab).dot(tangent);
        let sampled = volume.abs() >= Self::MIN_SOLID_ANGLE && solid_angle >= Self::MIN_SOLID_ANGLE;
        (sampled && det > 0.0).then(|| Self {
            a,
            b,
            c,
            tangent,
            det,
            one_plus_ab,
            b_tangent: b.dot(tangent),
            solid_angle,
        })
    }

    /// Solid angle, sr.
    #[must_use]
    pub const fn solid_angle(&self) -> f32 {
        self.solid_angle
    }

    /// Density per steradian inside the triangle.
    #[must_use]
    pub const fn pdf(&self) -> f32 {
        1.0 / self.solid_angle
    }

    /// A direction of the triangle.
    #[must_use]
    #[inline]
    pub fn sample(&self, u: Vec2) -> Vec3 {
        // The point p of the edge ac for which abp has the share u.x: with φ the angle between a and p,
        // tan(Ω/2) = det·tan(φ/2) / (1 + a·b + tan(φ/2)·b·tangent).
        let (sin, cos) = sin_cos(0.5 * u.x * self.solid_angle);
        let half = (cos * self.det - sin * self.b_tangent) * self.a + sin * self.one_plus_ab * self.tangent;
        let p = (2.0 * self.a.dot(half) / half.length_squared()) * half - self.a;
        // The point of the arc bp at the share u.y of 1 − cos.
        let bp = p - self.b;
        let h = u.y * 0.5 * bp.length_squared();
        let across = (bp - self.b * self.b.dot(bp)).normalize_or_zero();
        // `across` is less orthogonal the nearer p lies to the antipode of b.
        ((1.0 - h) * self.b + sqrt(h * (2.0 - h).max(0.0)) * across).normalize()
    }

    /// The `u` that [`Self::sample`] maps to `d`, a unit vector inside the triangle. At the second vertex, where all `u.x`
    /// meet, some `u.x`.
    #[must_use]
    pub fn invert(&self, d: Vec3) -> Vec2 {
        // The edge ac and the arc from b through d meet at p.
        let mut p = self.b.cross(d - self.b).cross(self.a.cross(self.c - self.a)).normalize_or(self.a);
        if p.dot(self.a + self.c) < 0.0 {
            p = -p;
        }
        let (x, y) = (self.a.dot(p), self.tangent.dot(p));
        let tan_half = y / (1.0 + x);
        let angle = 2.0 * atan2(self.det * tan_half, self.one_plus_ab + tan_half * self.b_tangent);
        let h = |v: Vec3| (v - self.b).length_squared();
        Vec2::new(angle / self.solid_angle, h(d) / h(p)).clamp(Vec2::ZERO, Vec2::ONE)
    }
}
