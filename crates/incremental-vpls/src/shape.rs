//! The two domains of a light's directions, and what is measured in them.

use glam::{DVec2, DVec3};

/// 2⁴⁰.
const GRID: f64 = 1_099_511_627_776.0;

/// A domain in which points are spread.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// The unit disc `x² + y² ≤ 1`; `z` is 0. Distances are straight.
    Disc,
    /// The unit sphere. Distances are chords.
    Sphere,
}

impl Shape {
    /// Its area: π or 4π.
    #[must_use]
    pub const fn area(self) -> f64 {
        match self {
            Self::Disc => core::f64::consts::PI,
            Self::Sphere => 4.0 * core::f64::consts::PI,
        }
    }

    /// `p` as a point of the domain: without `z`, or normalized; its coordinates rounded to 2⁻⁴⁰, so that points
    /// either coincide or are far enough apart for the direction between them to have a meaning. `None` outside of the
    /// disc, for a zero vector and for what is not finite.
    #[must_use]
    pub fn accept(self, p: DVec3) -> Option<DVec3> {
        if !p.is_finite() {
            return None;
        }
        let rounded = |p: DVec3| (p * GRID).round() / GRID + 0.0;
        match self {
            Self::Disc => (p.truncate().length_squared() <= 1.0).then(|| rounded(p.with_z(0.0))),
            // Scaled first, so that no square leaves f64's range.
            Self::Sphere => rounded((p / p.abs().max_element()).try_normalize()?).try_normalize(),
        }
    }

    /// Distance of `p` to its own mirror image behind the rim, `2 (1 − |p|)`; infinite where there is no rim.
    ///
    /// A point has half of its cell behind a rim that it lies on. To count the mirror image as a neighbour keeps
    /// points half of their spacing away from it.
    #[must_use]
    pub(crate) fn rim(self, p: DVec3) -> f64 {
        match self {
            Self::Disc => 2.0 * (1.0 - p.length()),
            Self::Sphere => f64::INFINITY,
        }
    }
}

/// Where the straight line `m + t n`, `n` a unit vector and `m` inside of the unit circle, enters and leaves it.
pub(crate) fn clip(m: DVec2, n: DVec2) -> (f64, f64) {
    let b = m.dot(n);
    let root = (b * b + (1.0 - m.length_squared()).max(0.0)).sqrt();
    (-b - root, -b + root)
}
