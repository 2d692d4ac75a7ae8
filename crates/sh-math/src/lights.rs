//! Projections of lights in closed form, and lights from projections.

use core::f64::consts::{PI, TAU};

use crate::basis::unit;
use crate::gradient::basis_and_gradient;
use crate::real::{Real, Value, float};
use crate::sh::Sh;
use crate::table::Table;
use crate::zonal::Zonal;

impl<const N: usize, S: Real> Sh<N, S> {
    /// A distant light in the unit direction `d` with the irradiance 1 on a surface that faces it: the delta `Y_i(d)`.
    #[must_use]
    pub fn directional_light(d: impl Into<[S; 3]>) -> Self {
        Zonal::delta().toward(d)
    }

    /// A sphere of radiance 1 with its centre at `centre` (relative to the receiver, any unit) and `radius`, seen without
    /// occlusion: the cap of half angle `asin(radius/|centre|)`, exact. All directions from inside the sphere; 0 where the
    /// centre or the radius is not finite, or the radius is not positive.
    #[must_use]
    pub fn sphere_light(centre: impl Into<[S; 3]>, radius: S) -> Self {
        let (c, radius): ([f64; 3], f64) = (centre.into().map(Into::into), radius.into());
        if !(radius > 0.0 && radius < f64::INFINITY && c.iter().all(|x| x.is_finite())) {
            return Self::default();
        }
        // Only the ratio counts; squares of the scaled numbers do not overflow.
        let scale = c.iter().fold(radius, |a, x| a.max(x.abs()));
        let (c, radius) = (c.map(|x| x / scale), radius / scale);
        let distance2 = c[0] * c[0] + c[1] * c[1] + c[2] * c[2];
        let tangent2 = distance2 - radius * radius;
        let half_angle = if tangent2 > 0.0 { float::atan2(radius, float::sqrt(tangent2)) } else { PI };
        let axis = unit::<S>(c.map(S::from_f64)).unwrap_or([S::default(), S::default(), S::from_f64(1.0)]);
        Zonal::cap(half_angle).toward(axis)
    }

    /// A polygon of radiance 1 seen from the origin without occlusion: `c_i = ∫ Y_i dω` over its solid angle, exact.
    ///
    /// `vertices` in order, relative to the receiver, any unit; the sign is positive where they turn counter-clockwise as
    /// seen from the origin, so a polygon seen from behind gives the negative. Planar or not, convex or not; less than a
    /// hemisphere. 0 for fewer than three vertices, and where the origin lies on an edge or a vertex: the polygon's plane is
    /// seen from within, and has no solid angle. 0 too where a vertex is not finite.
    ///
    /// `Y = −ΔY/(l(l+1))`, so by Gauss's theorem each band is a sum over edges, great-circle arcs, of the integral of
    /// `∇Y·n`, `n` the arc's normal. Along an arc that is a trigonometric polynomial of degree `l − 1`: its samples at
    /// `2l − 1` even steps of the full circle determine its integral over any part. Band 0 is the solid angle.
    ///
    /// ```
    /// use sh_math::Sh;
    /// let octant = Sh::<9>::polygon_light(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    /// assert!((octant.integral() - core::f32::consts::FRAC_PI_2).abs() < 1e-6);
    /// ```
    #[must_use]
    pub fn polygon_light<P: Copy + Into<[S; 3]>>(vertices: &[P]) -> Self {
        if vertices.len() < 3 {
            return Self::default();
        }
        let mut c = [0.0; N];
        let vertex = |i: usize| unit::<f64>(vertices[i % vertices.len()].into().map(Into::into));
        for i in 0..vertices.len() {
            let (Some(a), Some(b)) = (vertex(i), vertex(i + 1)) else { return Self::default() };
            // Opposite directions have no arc, and rounding would choose one. f64 leaves 1e-16 of a true zero.
            let normal = cross(a, b);
            if dot(a, b) < 0.0 && dot(normal, normal) < 1e-24 {
                return Self::default();
            }
            add_edge(&mut c, a, b);
        }
        for l in 1..Table::<N>::BANDS {
            let scale = -1.0 / (l * (l + 1)) as f64;
            c[l * l..(l + 1) * (l + 1)].iter_mut().for_each(|c| *c *= scale);
        }
        c[0] = 0.0;
        for i in 1..vertices.len() - 1 {
            if let (Some(a), Some(b), Some(d)) = (vertex(0), vertex(i), vertex(i + 1)) {
                c[0] += solid_angle(a, b, d);
            }
        }
        c[0] *= 0.282_094_791_773_878_14;
        Self(c.map(S::from_f64))
    }

    /// The direction the function points to most, that of its band 1; `None` where band 1 vanishes (or `N = 1`).
    #[must_use]
    pub fn dominant_direction(&self) -> Option<[S; 3]> {
        if N < 4 { None } else { unit([self.0[3], self.0[1], self.0[2]]) }
    }
}

impl<const N: usize, T: Value> Sh<N, T> {
    /// The distant light in the unit direction `d` and the uniform radiance that together fit this radiance field best in
    /// the mean square: `(irradiance of a surface that faces the light, uniform radiance)`. The light may be negative
    /// where nothing points to `d`.
    ///
    /// ```
    /// use glam::Vec3;
    /// use sh_math::Sh;
    /// let sun = Sh::<4>::directional_light(Vec3::Y).map(|c| Vec3::new(3.0, 2.0, 1.0) * c);
    /// let field = sun + Sh::constant(Vec3::splat(0.5));
    /// let (light, ambient) = field.directional_and_ambient(Vec3::Y);
    /// assert!((light - Vec3::new(3.0, 2.0, 1.0)).length() < 1e-5 && (ambient - 0.5).length() < 1e-5);
    /// ```
    #[must_use]
    pub fn directional_and_ambient(&self, d: impl Into<[T::Scalar; 3]>) -> (T, T) {
        // Without band 0, which the uniform part fits alone. Σ Y² over the bands above 0 is (N − 1)/4π.
        let mut lobe = Sh::<N, T::Scalar>::directional_light(d);
        let y0 = core::mem::take(&mut lobe.0[0]);
        if N == 1 {
            return (T::default(), self.mean());
        }
        let light = self.dot(&lobe) * T::Scalar::from_f64(4.0 * PI / (N - 1) as f64);
        let ambient = (self.0[0] - light * y0) * y0;
        (light, ambient)
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Signed solid angle of a triangle of unit vectors (Van Oosterom & Strackee 1983).
fn solid_angle(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> f64 {
    2.0 * float::atan2(dot(a, cross(b, c)), 1.0 + dot(a, b) + dot(b, c) + dot(c, a))
}

/// Adds the outward flux `∫ ∇Y_i·n` through the arc from `a` to `b`.
fn add_edge<const N: usize>(c: &mut [f64; N], a: [f64; 3], b: [f64; 3]) {
    let bands = Table::<N>::BANDS;
    let normal = cross(a, b);
    let sine = float::sqrt(dot(normal, normal));
    if bands < 2 || sine <= 0.0 {
        return;
    }
    let arc = float::atan2(sine, dot(a, b));
    // The polygon lies on the side of a × b.
    let outward = normal.map(|x| -x / sine);
    let side = cross(normal.map(|x| x / sine), a);
    let samples = 2 * bands - 3;
    for j in 0..samples {
        let t = TAU * j as f64 / samples as f64;
        // Integral over [0, arc] of the trigonometric polynomial that is 1 at this sample and 0 at the others.
        let mut weight = arc;
        for k in 1..bands - 1 {
            let k = k as f64;
            weight += 2.0 * (float::sin(k * (arc - t)) + float::sin(k * t)) / k;
        }
        weight /= samples as f64;
        let (cos, sin) = (float::cos(t), float::sin(t));
        let d: [f64; 3] = core::array::from_fn(|i| a[i] * cos + side[i] * sin);
        let (_, gradient) = basis_and_gradient::<N, f64>(d);
        for (c, g) in c.iter_mut().zip(gradient) {
            *c += weight * dot(g, outward);
        }
    }
}
