//! Which cells a triangle passes through, and how much of it lies in each.

use glam::{UVec3, Vec2, Vec3};
use indirect_sampling::mapping::triangle_uniform;

use crate::grid::{FINE, Grid};

/// What is added to the half side of a cell: points of a triangle, as rays find them, lie in cells that it passes through. In cells;
/// where coordinates are large, their rounding is added.
const SLACK: f32 = 1e-3;

/// A triangle in units of cells, prepared for tests against boxes (separating axes: Schwarz & Seidel 2010 test the same).
#[derive(Debug, Clone)]
pub(crate) struct TriangleBox {
    corners: [Vec3; 3],
    normal: Vec3,
    low: Vec3,
    high: Vec3,
    slack: f32,
}

impl TriangleBox {
    /// `None` for a triangle without area.
    pub(crate) fn new(corners: [Vec3; 3], grid: &Grid) -> Option<Self> {
        let largest = corners.iter().fold(0.0_f32, |m, c| m.max(c.abs().max_element()));
        let slack = SLACK + largest / grid.cell * (4.0 * f32::EPSILON);
        let corners = corners.map(|c| grid.local(c));
        let [a, b, c] = corners;
        let normal = indirect_core::math::normalize_or((b - a).cross(c - a), Vec3::ZERO);
        if normal == Vec3::ZERO {
            return None;
        }
        let (low, high) = (a.min(b).min(c) - slack, a.max(b).max(c) + slack);
        Some(Self { corners, normal, low, high, slack })
    }

    pub(crate) const fn normal(&self) -> Vec3 {
        self.normal
    }

    pub(crate) const fn corners(&self) -> [Vec3; 3] {
        self.corners
    }

    /// Whether it meets the box around `centre`, slack included. The box's own axes are not tested: `low` and `high` say that.
    fn meets(&self, centre: Vec3, half: f32) -> bool {
        let half = half + self.slack;
        let [a, b, c] = self.corners.map(|v| v - centre);
        if self.normal.dot(a).abs() > half * self.normal.abs().element_sum() {
            return false;
        }
        for edge in [b - a, c - b, a - c] {
            for axis in [
                Vec3::new(0.0, -edge.z, edge.y),
                Vec3::new(edge.z, 0.0, -edge.x),
                Vec3::new(-edge.y, edge.x, 0.0),
            ] {
                let (p, q, r) = (axis.dot(a), axis.dot(b), axis.dot(c));
                let reach = half * axis.abs().element_sum();
                if p.min(q).min(r) > reach || p.max(q).max(r) < -reach {
                    return false;
                }
            }
        }
        true
    }

    /// Calls `at` with every cell that it passes through.
    pub(crate) fn for_cells(&self, size: UVec3, mut at: impl FnMut(UVec3)) {
        let last = (size - 1).as_vec3();
        let low = self.low.floor().clamp(Vec3::ZERO, last).as_uvec3();
        let high = self.high.floor().clamp(Vec3::ZERO, last).as_uvec3();
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    let cell = UVec3::new(x, y, z);
                    if self.meets(cell.as_vec3() + 0.5, 0.5) {
                        at(cell);
                    }
                }
            }
        }
    }

    /// Calls `at` with the bit of every fine cell of `cell` that it passes through.
    pub(crate) fn for_fine_cells(&self, cell: UVec3, mut at: impl FnMut(u32)) {
        let (corner, n) = (cell.as_vec3(), FINE as f32);
        let last = Vec3::splat(n - 1.0);
        let low = ((self.low - corner) * n).floor();
        let high = ((self.high - corner) * n).floor();
        if low.cmpgt(last).any() || high.cmplt(Vec3::ZERO).any() {
            return;
        }
        let low = low.clamp(Vec3::ZERO, last).as_uvec3();
        let high = high.clamp(Vec3::ZERO, last).as_uvec3();
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    let centre = corner + (UVec3::new(x, y, z).as_vec3() + 0.5) / n;
                    if self.meets(centre, 0.5 / n) {
                        at((z * FINE + y) * FINE + x);
                    }
                }
            }
        }
    }
}

/// The part of a triangle within a cell, in units of cells from the cell's corner: clipped by its six planes. A cell holds its lower
/// faces, not its upper ones, so that the areas of all cells sum to the triangle's.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Part {
    corners: [Vec3; Self::MOST],
    count: usize,
}

impl Part {
    /// A triangle has 9 corners at most after six cuts; rounding may make it cross a plane once more.
    const MOST: usize = 16;

    pub(crate) fn of(corners: [Vec3; 3], cell: UVec3) -> Self {
        let low = cell.as_vec3();
        let mut part = Self { corners: [Vec3::ZERO; Self::MOST], count: 3 };
        part.corners[..3].copy_from_slice(&corners.map(|c| c - low));
        for axis in 0..3 {
            part = part.cut(axis, false).cut(axis, true);
        }
        part
    }

    fn cut(self, axis: usize, upper: bool) -> Self {
        let mut cut = Self { corners: [Vec3::ZERO; Self::MOST], count: 0 };
        let inside = |p: Vec3| if upper { p[axis] < 1.0 } else { p[axis] >= 0.0 };
        let plane = if upper { 1.0 } else { 0.0 };
        for i in 0..self.count {
            let (p, q) = (self.corners[i], self.corners[(i + 1) % self.count]);
            if inside(p) {
                cut.push(p);
            }
            if inside(p) != inside(q) {
                let mut x = p + (q - p) * ((plane - p[axis]) / (q[axis] - p[axis]));
                x[axis] = plane;
                cut.push(x);
            }
        }
        cut
    }

    fn push(&mut self, p: Vec3) {
        if self.count < Self::MOST {
            self.corners[self.count] = p;
            self.count += 1;
        }
    }

    /// Areas of the triangles of its fan.
    fn fan(&self) -> impl Iterator<Item = (usize, f32)> + '_ {
        let c = &self.corners;
        (1..self.count.max(2) - 1).map(|i| (i, 0.5 * (c[i] - c[0]).cross(c[i + 1] - c[0]).length()))
    }

    /// In units of a cell's face.
    pub(crate) fn area(&self) -> f32 {
        self.fan().map(|(_, area)| area).sum()
    }

    /// A point of it for `u` in `[0, 1)²`, evenly spread.
    pub(crate) fn point(&self, u: Vec2) -> Vec3 {
        let mut rest = u.x * self.area();
        let (mut chosen, mut x) = (1, 0.0);
        for (i, area) in self.fan() {
            if area > 0.0 {
                (chosen, x) = (i, (rest / area).clamp(0.0, 0.999_999_94));
                if rest < area {
                    break;
                }
            }
            rest -= area;
        }
        let b = triangle_uniform(Vec2::new(x, u.y));
        let [o, p, q] = [0, chosen, chosen + 1].map(|i| self.corners[i.min(Self::MOST - 1)]);
        o + (p - o) * b.x + (q - o) * b.y
    }
}
