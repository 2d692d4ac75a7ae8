//! Area-preserving mappings of the unit square, each with its density and its inverse.
//!
//! | `x(u)` | domain | density `x_pdf` | inverse `x_invert` |
//! |---|---|---|---|
//! | [`disc_concentric`] | unit disc | 1/π per area | yes |
//! | [`triangle_uniform`] | barycentrics | 2 per barycentric area | yes |
//! | [`hemisphere_cosine`] | z ≥ 0 | cosθ/π per sr | yes |
//! | [`hemisphere_uniform`] | z ≥ 0 | 1/2π per sr | yes |
//! | [`sphere_uniform`] | all directions | 1/4π per sr | yes |
//! | [`cone_uniform`] | z ≥ cosθ_max | 1/(2π(1 − cosθ_max)) per sr | yes |
//! | [`phong_lobe`] | z ≥ 0 | (n + 1)/2π·cosⁿθ per sr | yes |
//!
//! Directions towards a triangle: [`spherical_triangle`](crate::spherical_triangle).
//!
//! Directions are of unit length in a local frame with z up. All but the triangle go through the concentric disc, which
//! keeps neighbours together: a low-discrepancy set stays one. `u` is in `[0, 1)²`; inverses return `[0, 1]²`.
//!
//! WGSL twin: `sampling/mapping.wgsl`.
//!
//! ```
//! use glam::Vec2;
//! use indirect_sampling::mapping::{hemisphere_cosine, hemisphere_cosine_invert, hemisphere_cosine_pdf};
//!
//! let u = Vec2::new(0.3, 0.8);
//! let d = hemisphere_cosine(u);
//! assert!((hemisphere_cosine_pdf(d) - d.z / core::f32::consts::PI).abs() < 1e-6);
//! assert!(hemisphere_cosine_invert(d).distance(u) < 1e-6);
//! ```

use core::f32::consts::{FRAC_1_PI, FRAC_PI_4, TAU};

use glam::{Vec2, Vec3};

use crate::math::{atan2, exp_m1, ln_1p, powf, sin_cos_eighth, sqrt};

/// A point of the concentric disc as a signed radius in `[−1, 1)` and a unit vector.
#[inline]
fn disc_polar(u: Vec2) -> (f32, Vec2) {
    let a = 2.0 * u - 1.0;
    let x_leads = a.x.abs() > a.y.abs();
    let (r, other) = if x_leads { (a.x, a.y) } else { (a.y, a.x) };
    // Only the centre has r = 0; any direction serves there.
    let (sin, cos) = sin_cos_eighth(if r == 0.0 { 0.0 } else { other / r });
    (r, if x_leads { Vec2::new(cos, sin) } else { Vec2::new(sin, cos) })
}

/// The inverse of [`disc_polar`]: `d` gives the direction, of any length but zero, and `r ≥ 0` the radius.
#[inline]
fn disc_polar_invert(r: f32, d: Vec2) -> Vec2 {
    let eighths = |y: f32, x: f32| atan2(y, x) / FRAC_PI_4;
    let a = if d.x.abs() > d.y.abs() {
        let r = r.copysign(d.x);
        Vec2::new(r, r * eighths(d.y * d.x.signum(), d.x.abs()))
    } else {
        let r = r.copysign(d.y);
        Vec2::new(r * eighths(d.x * d.y.signum(), d.y.abs()), r)
    };
    (0.5 * a + 0.5).clamp(Vec2::ZERO, Vec2::ONE)
}

/// `1 − r²` without cancellation, half of its smallest step at the rim: a direction on the horizon, where the density is
/// zero, never comes out.
#[inline]
fn one_minus_square(r: f32) -> f32 {
    ((1.0 - r) * (1.0 + r)).max(f32::EPSILON)
}

/// A point of the unit disc (Shirley & Chiu 1997).
#[must_use]
#[inline]
pub fn disc_concentric(u: Vec2) -> Vec2 {
    let (r, d) = disc_polar(u);
    r * d
}

/// Density of [`disc_concentric`] per area: `1/π` inside the unit disc, 0 outside.
#[must_use]
#[inline]
pub fn disc_concentric_pdf(p: Vec2) -> f32 {
    if p.length_squared() <= 1.0 { FRAC_1_PI } else { 0.0 }
}

/// The `u` that [`disc_concentric`] maps to `p`.
#[must_use]
#[inline]
pub fn disc_concentric_invert(p: Vec2) -> Vec2 {
    disc_polar_invert(p.length(), p)
}

/// Barycentrics `(u, v)` of a point distributed uniformly over a triangle: `a + u(b − a) + v(c − a)` (Heitz 2019, "A
/// Low-Distortion Map Between Triangle and Square").
#[must_use]
#[inline]
pub fn triangle_uniform(u: Vec2) -> Vec2 {
    if u.y > u.x {
        let x = 0.5 * u.x;
        Vec2::new(x, u.y - x)
    } else {
        let y = 0.5 * u.y;
        Vec2::new(u.x - y, y)
    }
}

/// Density of [`triangle_uniform`] per barycentric area: 2 inside, 0 outside. Divide by twice the triangle's area for the
/// density per area.
#[must_use]
#[inline]
pub fn triangle_uniform_pdf(barycentrics: Vec2) -> f32 {
    let inside = barycentrics.min_element() >= 0.0 && barycentrics.x + barycentrics.y <= 1.0;
    if inside { 2.0 } else { 0.0 }
}

/// The `u` that [`triangle_uniform`] maps to `barycentrics`.
#[must_use]
#[inline]
pub fn triangle_uniform_invert(barycentrics: Vec2) -> Vec2 {
    let Vec2 { x, y } = barycentrics;
    let u = if y > x { Vec2::new(2.0 * x, x + y) } else { Vec2::new(x + y, 2.0 * y) };
    u.clamp(Vec2::ZERO, Vec2::ONE)
}

/// A direction of the upper hemisphere, in proportion to its cosine (Malley's method). Its z is positive.
#[must_use]
#[inline]
pub fn hemisphere_cosine(u: Vec2) -> Vec3 {
    let (r, d) = disc_polar(u);
    (r * d).extend(sqrt(one_minus_square(r)))
}

/// Density of [`hemisphere_cosine`] per steradian: `max(0, z)/π`.
#[must_use]
#[inline]
pub fn hemisphere_cosine_pdf(d: Vec3) -> f32 {
    d.z.max(0.0) * FRAC_1_PI
}

/// The `u` that [`hemisphere_cosine`] maps to the unit vector `d`.
#[must_use]
#[inline]
pub fn hemisphere_cosine_invert(d: Vec3) -> Vec2 {
    disc_concentric_invert(d.truncate())
}

/// A direction of the upper hemisphere, uniformly.
#[must_use]
#[inline]
pub fn hemisphere_uniform(u: Vec2) -> Vec3 {
    cone_uniform(u, 1.0)
}

/// Density of [`hemisphere_uniform`] per steradian: `1/2π` where `z ≥ 0`.
#[must_use]
#[inline]
pub fn hemisphere_uniform_pdf(d: Vec3) -> f32 {
    cone_uniform_pdf(d, 1.0)
}

/// The `u` that [`hemisphere_uniform`] maps to the unit vector `d`.
#[must_use]
#[inline]
pub fn hemisphere_uniform_invert(d: Vec3) -> Vec2 {
    cone_uniform_invert(d, 1.0)
}

/// A direction, uniformly over the sphere. The square's centre becomes +z, its border −z.
#[must_use]
#[inline]
pub fn sphere_uniform(u: Vec2) -> Vec3 {
    let (r, d) = disc_polar(u);
    // 1 − 2r² in two steps keeps −z exact; the sine of twice the angle whose sine is r.
    let c2 = one_minus_square(r);
    (2.0 * r * sqrt(c2) * d).extend(2.0 * c2 - 1.0)
}

/// Density of [`sphere_uniform`] per steradian: `1/4π`.
#[must_use]
#[inline]
pub fn sphere_uniform_pdf() -> f32 {
    0.5 / TAU
}

/// The `u` that [`sphere_uniform`] maps to the unit vector `d`.
#[must_use]
#[inline]
pub fn sphere_uniform_invert(d: Vec3) -> Vec2 {
    cone_uniform_invert(d, 2.0)
}

/// A direction of the cone of half angle `θ_max` about z, uniformly over its solid angle.
///
/// The cone is given by `1 − cosθ_max` in `(0, 2]`, which keeps narrow cones exact: it is `2 sin²(θ_max/2)`, or
/// `s²/(1 + √(1 − s²))` with `s = sinθ_max`.
#[must_use]
#[inline]
pub fn cone_uniform(u: Vec2, one_minus_cos: f32) -> Vec3 {
    let (r, d) = disc_polar(u);
    let h = r * r * one_minus_cos; // 1 − cosθ
    (r * sqrt(one_minus_cos * (2.0 - h).max(0.0)) * d).extend(1.0 - h)
}

/// Density of [`cone_uniform`] per steradian.
#[must_use]
#[inline]
pub fn cone_uniform_pdf(d: Vec3, one_minus_cos: f32) -> f32 {
    if d.z >= 1.0 - one_minus_cos { 1.0 / (TAU * one_minus_cos) } else { 0.0 }
}

/// The `u` that [`cone_uniform`] maps to the unit vector `d`.
#[must_use]
#[inline]
pub fn cone_uniform_invert(d: Vec3, one_minus_cos: f32) -> Vec2 {
    // 1 − cosθ, from the sine where the difference would cancel.
    let h = if d.z > 0.0 { d.truncate().length_squared() / (1.0 + d.z) } else { 1.0 - d.z };
    disc_polar_invert(sqrt(h / one_minus_cos), d.truncate())
}

/// A direction of the upper hemisphere, in proportion to the power `n ≥ 0` of its cosine. Its z is positive.
#[must_use]
#[inline]
pub fn phong_lobe(u: Vec2, n: f32) -> Vec3 {
    let (r, d) = disc_polar(u);
    // cosθ = (1 − r²)^(1/(n+1)), and its sine by way of the logarithm, so that sharp lobes do not cancel.
    let ln_cos = ln_1p(-(r * r).min(1.0 - f32::EPSILON)) / (n + 1.0);
    let sin = sqrt(-exp_m1(2.0 * ln_cos));
    (sin.copysign(r) * d).extend(exp_m1(ln_cos) + 1.0)
}

/// Density of [`phong_lobe`] per steradian: `(n + 1)/2π · max(0, z)ⁿ`.
#[must_use]
#[inline]
pub fn phong_lobe_pdf(d: Vec3, n: f32) -> f32 {
    if d.z > 0.0 { (n + 1.0) / TAU * powf(d.z, n) } else { 0.0 }
}

/// The `u` that [`phong_lobe`] maps to the unit vector `d`.
#[must_use]
#[inline]
pub fn phong_lobe_invert(d: Vec3, n: f32) -> Vec2 {
    // r² = 1 − cosⁿ⁺¹, by the logarithm of whichever of cosine and sine does not cancel.
    let r2 = if d.z * d.z < 0.5 {
        1.0 - powf(d.z.max(0.0), n + 1.0)
    } else {
        -exp_m1(0.5 * (n + 1.0) * ln_1p(-d.truncate().length_squared()))
    };
    disc_polar_invert(sqrt(r2), d.truncate())
}
