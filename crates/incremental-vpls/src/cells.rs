//! Voronoi cells: what share of the domain is nearest to each point.

use core::f64::consts::TAU;

use glam::{DVec2, DVec3};
use spade::Triangulation;

use crate::pattern::{Edge, Pattern, centre_offset};
use crate::shape::{Shape, clip};

/// Gauss–Legendre abscissae and weights on `[0, 1]`, four points.
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// Share of the domain that rounding may add to the sum of its cells or take from it.
const LOST: f64 = 1e-3;

/// Where the border of two cells meets the rim of the disc.
struct Crossing {
    angle: f64,
    cells: [usize; 2],
}

impl Pattern {
    /// Area of each point's Voronoi cell, clipped to the domain, by number; 0 for numbers that are not part of the
    /// pattern. The areas sum to that of the domain.
    #[must_use]
    pub fn areas(&self) -> Vec<f64> {
        self.cells(|_| [core::f64::consts::PI; 2]).into_iter().map(|[area, _]| area).collect()
    }

    /// What each point's Voronoi cell holds of two measures, by number.
    ///
    /// On the disc they are any that depend on the radius alone: `held(s)` is what the concentric disc of squared
    /// radius `s`, `(0, 1]`, holds of them, divided by `s`. By Green's theorem a cell holds
    ///
    /// ```text
    /// 1/2π ∮ held(x² + y²) (x dy − y dx)
    /// ```
    ///
    /// around its border. Two cells share a border in opposite directions, and the rim's arcs are a full turn
    /// together: the cells sum to `held(1)`, whatever the error of the quadrature (four points a border; exact where
    /// `held` is a cubic in `s`).
    ///
    /// On the sphere both are the solid angle and `held` is not asked.
    #[must_use]
    pub fn cells(&self, held: impl Fn(f64) -> [f64; 2]) -> Vec<[f64; 2]> {
        let mut cells = vec![[0.0; 2]; self.points.len()];
        match self.shape {
            Shape::Disc => self.disc_cells(&held, &mut cells),
            Shape::Sphere => self.sphere_cells(&mut cells),
        }
        let whole = match self.shape {
            _ if self.is_empty() => return cells,
            Shape::Disc => held(1.0),
            Shape::Sphere => [self.shape.area(); 2],
        };
        for k in 0..2 {
            let sum: f64 = cells.iter().map(|c| c[k].max(0.0)).sum();
            if (sum - whole[k]).abs() <= LOST * whole[k] {
                // Rounding alone.
                let scale = if sum > 0.0 { whole[k] / sum } else { 0.0 };
                cells.iter_mut().for_each(|cell| cell[k] = cell[k].max(0.0) * scale);
            } else {
                // All points lie so close together that rounding decides which are neighbours. None is better than another.
                let share = whole[k] / self.len as f64;
                for (cell, &live) in cells.iter_mut().zip(&self.live) {
                    cell[k] = if live { share } else { 0.0 };
                }
            }
        }
        cells
    }

    fn disc_cells(&self, held: &impl Fn(f64) -> [f64; 2], cells: &mut [[f64; 2]]) {
        let mut crossings = Vec::new();
        for edge in self.mesh.undirected_edges() {
            let edge = edge.as_directed();
            let [u, w] = edge.vertices().map(|v| v.data().id);
            let (middle, normal) = bisector(edge);
            let (enter, leave) = clip(middle, normal);
            let (from, to) = (-centre_offset(edge.rev()), centre_offset(edge));
            if to <= enter || from >= leave {
                continue;
            }
            let angle = |t: f64| (middle + normal * t).to_angle();
            if from < enter {
                crossings.push(Crossing { angle: angle(enter), cells: [u, w] });
            }
            if to > leave {
                crossings.push(Crossing { angle: angle(leave), cells: [u, w] });
            }
            let (a, b) = (middle + normal * from.max(enter), middle + normal * to.min(leave));
            let mut sum = [0.0; 2];
            for (t, weight) in GAUSS {
                let h = held(a.lerp(b, t).length_squared());
                sum = [sum[0] + weight * h[0], sum[1] + weight * h[1]];
            }
            let turn = a.perp_dot(b) / TAU;
            for k in 0..2 {
                cells[u][k] += turn * sum[k];
                cells[w][k] -= turn * sum[k];
            }
        }
        self.rim_arcs(crossings, held(1.0), cells);
    }

    /// Adds each arc of the rim between neighbouring crossings to the cell that it borders.
    fn rim_arcs(&self, mut crossings: Vec<Crossing>, whole: [f64; 2], cells: &mut [[f64; 2]]) {
        let mut add = |owner: usize, share: f64| {
            cells[owner] = [cells[owner][0] + share * whole[0], cells[owner][1] + share * whole[1]];
        };
        crossings.sort_by(|a, b| a.angle.total_cmp(&b.angle).then(a.cells.cmp(&b.cells)));
        if crossings.is_empty() {
            // A single point: two have a border between them, and it crosses the rim.
            if let Some(owner) = self.live.iter().position(|&l| l) {
                add(owner, 1.0);
            }
            return;
        }
        for (i, a) in crossings.iter().enumerate() {
            let (b, turn) = crossings.get(i + 1).map_or_else(|| (&crossings[0], TAU), |next| (next, 0.0));
            let arc = b.angle + turn - a.angle;
            let middle = DVec2::from_angle(a.angle + 0.5 * arc).extend(0.0);
            // Whose arc it is both crossings should say; where four cells meet at the rim they may not.
            let near = a.cells.into_iter().chain(b.cells);
            let distance = |id: usize| self.points[id].distance_squared(middle);
            let owner = near.min_by(|&p, &q| distance(p).total_cmp(&distance(q)).then(p.cmp(&q)));
            if let Some(owner) = owner {
                add(owner, arc / TAU);
            }
        }
    }

    fn sphere_cells(&self, cells: &mut [[f64; 2]]) {
        let whole = Shape::Sphere.area();
        let Some(pole) = self.pole else { return };
        if self.mesh.num_vertices() < 2 {
            for (cell, _) in cells.iter_mut().zip(&self.live).filter(|(_, live)| **live) {
                *cell = [whole / self.len as f64; 2];
            }
            return;
        }
        let mut add = |u: usize, w: usize, left: DVec3, right: DVec3| {
            let area = self.half_border(u, w, left, right);
            for id in [u, w] {
                cells[id] = [cells[id][0] + area; 2];
            }
        };
        for edge in self.mesh.undirected_edges() {
            let edge = edge.as_directed();
            let [u, w] = edge.vertices().map(|v| v.data().id);
            add(u, w, self.centre(edge), self.centre(edge.rev()));
        }
        for edge in self.outer_edges() {
            // From this vertex to the pole: the face with the edge before is at the left.
            add(edge.from().data().id, pole, self.centre(edge.prev()), self.centre(edge));
        }
    }

    /// Solid angle between one of two neighbours and their cells' common border, from the border's end `right` to
    /// `left` as the plane sees the edge from `u` to `w`.
    ///
    /// With the edge's half length `a` the border is a great circle at right angles to it, and up to the angle `α`
    /// along that circle the right triangle has the excess `E(α)`, `tan(E/2) = tan(a/2) tan(α/2)`. This stays exact
    /// where both ends are opposite poles, as for points on a common circle.
    fn half_border(&self, u: usize, w: usize, left: DVec3, right: DVec3) -> f64 {
        let (u, w) = (self.points[u], self.points[w]);
        let Some(along) = (w - u).try_normalize() else { return 0.0 };
        let middle = (u + w).try_normalize().unwrap_or_else(|| along.any_orthonormal_vector());
        let tan_quarter = 0.5 * u.distance(w) / (1.0 + 0.5 * (u + w).length());
        let side = along.cross(middle);
        let plane = |c: DVec3| DVec2::new(c.dot(middle), c.dot(side));
        let (from, to) = (plane(right), plane(left));
        let area = excess(tan_quarter, to) - excess(tan_quarter, from);
        // A border is at most half a turn and runs from right to left. One that crosses the point opposite to the edge
        // goes from positive angles to negative ones, and the angle jumps by a full turn; so does one of no length at
        // the edge itself, by rounding, but backwards.
        let backwards = from.perp_dot(to) < 0.0 && from.dot(to) > 0.0;
        if from.y >= 0.0 && to.y < 0.0 && !backwards { area + TAU } else { area }
    }
}

/// `2 atan(k tan(α/2))` for the angle `α`, −π to π, of the vector `v`, without a cancellation near either end.
fn excess(k: f64, v: DVec2) -> f64 {
    let r = v.length();
    if v.x >= 0.0 {
        2.0 * (k * v.y).atan2(r + v.x)
    } else {
        2.0 * (k * (r - v.x).copysign(v.y)).atan2(v.y.abs())
    }
}

/// Midpoint and left unit normal of an edge in the plane: the border of its two cells lies on that line.
pub(crate) fn bisector(edge: Edge<'_>) -> (DVec2, DVec2) {
    let [a, b] = edge.positions().map(|p| DVec2::new(p.x, p.y));
    let along = b - a;
    (0.5 * (a + b), along.perp() / along.length())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Before they are scaled: the borders must cancel and close by themselves.
    #[test]
    fn cells_sum_to_the_domain_unscaled() {
        for shape in [Shape::Disc, Shape::Sphere] {
            for n in [2, 3, 4, 10, 100, 1000, 4000] {
                let mut pattern = Pattern::new(shape, &[]);
                pattern.insert_sparsest(n, 3);
                let mut cells = vec![[0.0; 2]; n];
                match shape {
                    Shape::Disc => pattern.disc_cells(&|s| [core::f64::consts::PI, s], &mut cells),
                    Shape::Sphere => pattern.sphere_cells(&mut cells),
                }
                let sum: f64 = cells.iter().map(|c| c[0]).sum();
                // 6 n terms of about 1/n each: their rounding.
                assert!((sum / shape.area() - 1.0).abs() < 1e-12, "{shape:?} {n}: {sum}");
                assert!(cells.iter().all(|c| c[0] > 0.0), "{shape:?} {n}");
            }
        }
    }
}
