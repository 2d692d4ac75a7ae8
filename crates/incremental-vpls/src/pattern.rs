//! Points in a [`Shape`] with their Delaunay triangulation: where they are densest, where a new one fits best, and
//! what share of the domain is nearest to each.
//!
//! On the disc the triangulation is that of the plane. On the sphere it is the plane's too: stereographic projection
//! from one of the points, the *pole*, maps circles to circles, so the triangles of the other points in the plane are
//! those of the sphere, and the edges of their convex hull form triangles with the pole, which lies behind every line.
//! Predicates are exact (`spade`), so that cocircular, collinear and coincident points are no special case.

use glam::{DVec2, DVec3};
use spade::handles::{DirectedEdgeHandle, FixedVertexHandle};
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};

pub use crate::shape::Shape;

/// Points nearer to the pole than this are the pole: the projection would throw them out of the plane's range.
const COINCIDENT: f64 = 1e-12;

/// What a coordinate of the plane is rounded to zero below, so that its products do not underflow.
const UNDERFLOW: f64 = 1e-40;

/// A point in the plane and its number in the pattern.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Vertex {
    at: Point2<f64>,
    pub(crate) id: usize,
}

impl HasPosition for Vertex {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.at
    }
}

pub(crate) type Mesh = DelaunayTriangulation<Vertex>;
pub(crate) type Edge<'a> = DirectedEdgeHandle<'a, Vertex, (), (), ()>;

/// Points in a domain. They are numbered in the order in which they came; numbers are not used again.
#[derive(Debug, Clone)]
pub struct Pattern {
    pub(crate) shape: Shape,
    pub(crate) points: Vec<DVec3>,
    pub(crate) live: Vec<bool>,
    pub(crate) len: usize,
    /// The point of the sphere that the others are projected from.
    pub(crate) pole: Option<usize>,
    axes: [DVec3; 2],
    pub(crate) mesh: Mesh,
    pub(crate) steps: u64,
}

impl Pattern {
    /// The pattern of `points`: positions on the disc (`z` is ignored), directions of any length on the sphere. What
    /// [`Shape::accept`] refuses and what coincides with another point keeps its number, but is not part of the
    /// pattern.
    #[must_use]
    pub fn new(shape: Shape, points: &[DVec3]) -> Self {
        let mut pattern = Self {
            shape,
            points: points.iter().map(|&p| shape.accept(p).unwrap_or(DVec3::NAN)).collect(),
            live: vec![false; points.len()],
            len: 0,
            pole: None,
            axes: [DVec3::X, DVec3::Y],
            mesh: Mesh::new(),
            steps: 0,
        };
        if let (Shape::Sphere, Some(pole)) = (shape, pattern.points.iter().position(|p| p.is_finite())) {
            pattern.set_pole(pole);
        }
        let vertices: Vec<_> = (0..points.len())
            .filter_map(|id| pattern.project(pattern.points[id]).map(|at| Vertex { at, id }))
            .collect();
        // Projected coordinates are in range, so that loading cannot fail.
        pattern.mesh = Mesh::bulk_load(vertices).unwrap_or_default();
        for v in pattern.mesh.vertices() {
            pattern.live[v.data().id] = true;
        }
        pattern.len += pattern.mesh.num_vertices();
        pattern
    }

    fn set_pole(&mut self, id: usize) {
        let (t, b) = self.points[id].any_orthonormal_pair();
        self.pole = Some(id);
        self.axes = [t, b];
        self.live[id] = true;
        self.len += 1;
    }

    /// The point in the plane of the triangulation; `None` for what is not finite and for the pole.
    fn project(&self, p: DVec3) -> Option<Point2<f64>> {
        let at = match self.pole {
            None => p.truncate(),
            Some(pole) => {
                // 1 − p·q from the chord: it keeps its digits near the pole.
                let square = p.distance_squared(self.points[pole]);
                if square < COINCIDENT * COINCIDENT {
                    return None;
                }
                DVec2::new(p.dot(self.axes[0]), p.dot(self.axes[1])) / (0.5 * square)
            }
        };
        let flush = |x: f64| if x.abs() < UNDERFLOW { 0.0 } else { x };
        at.is_finite().then(|| Point2::new(flush(at.x), flush(at.y)))
    }

    /// The domain.
    #[must_use]
    pub const fn shape(&self) -> Shape {
        self.shape
    }

    /// How many points there are.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// How many numbers were given out; all are below.
    #[must_use]
    pub fn numbers(&self) -> usize {
        self.points.len()
    }

    /// The point of this number; `None` where it is not part of the pattern (any more).
    #[must_use]
    pub fn point(&self, id: usize) -> Option<DVec3> {
        (*self.live.get(id)?).then(|| self.points[id])
    }

    /// Candidates that [`Pattern::insert_sparsest`] and edges that [`Pattern::remove_densest`] have looked at so far:
    /// a measure of work that does not depend on the machine.
    #[must_use]
    pub const fn steps(&self) -> u64 {
        self.steps
    }

    /// Adds a point; its handle in the mesh, or `None` where it coincides with the pole or is the first on the sphere.
    /// The caller made sure that it coincides with no other.
    pub(crate) fn add(&mut self, p: DVec3, hint: Option<FixedVertexHandle>) -> Option<FixedVertexHandle> {
        let p = self.shape.accept(p)?;
        let id = self.points.len();
        self.points.push(p);
        self.live.push(false);
        if self.shape == Shape::Sphere && self.pole.is_none() {
            self.set_pole(id);
            return None;
        }
        let vertex = Vertex { at: self.project(p)?, id };
        let handle = match hint {
            Some(hint) => self.mesh.insert_with_hint(vertex, hint),
            None => self.mesh.insert(vertex),
        }
        .ok()?;
        self.live[id] = true;
        self.len += 1;
        Some(handle)
    }

    /// The position of a vertex of the mesh in the domain.
    pub(crate) fn at(&self, v: Vertex) -> DVec3 {
        self.points[v.id]
    }

    /// The directed edges that have the outer face at their left, once around.
    pub(crate) fn outer_edges(&self) -> impl Iterator<Item = Edge<'_>> {
        let first = self.mesh.outer_face().adjacent_edge();
        let mut next = first;
        core::iter::from_fn(move || {
            let edge = next?;
            next = Some(edge.next()).filter(|&e| Some(e) != first);
            Some(edge)
        })
    }

    /// Sphere: where the face at the left of an edge is farthest from its three points, the centre of its
    /// circumscribed circle: the outward normal of its plane. The third point of an outer face is the pole.
    pub(crate) fn centre(&self, edge: Edge<'_>) -> DVec3 {
        let [a, b] = edge.vertices().map(|v| self.at(*v.data()));
        let third = edge.opposite_vertex().map(|v| v.data().id).or(self.pole);
        let c = third.map_or(DVec3::ZERO, |id| self.points[id]);
        // Counter-clockwise in the plane, which is seen from the pole, is clockwise seen from outside of the sphere.
        let normal = (c - a).cross(b - a);
        normal.try_normalize().or_else(|| (a + b + c).try_normalize()).unwrap_or(a)
    }
}

/// Disc: how far the centre of the circumscribed circle of the face at an edge's left lies to the left of the edge's
/// midpoint. Infinite for the outer face; for a face without area, infinite to the side on which its centre would be.
pub(crate) fn centre_offset(edge: Edge<'_>) -> f64 {
    let Some(third) = edge.opposite_vertex() else { return f64::INFINITY };
    let [a, b] = edge.positions();
    let p = third.position();
    let along = DVec2::new(b.x - a.x, b.y - a.y);
    let length = along.length();
    let along = along / length;
    let from_middle = DVec2::new(p.x - 0.5 * (a.x + b.x), p.y - 0.5 * (a.y + b.y));
    let (x, y) = (from_middle.dot(along), from_middle.dot(along.perp()));
    // The circle through (±length/2, 0) and (x, y).
    let numerator = x * x + y * y - 0.25 * length * length;
    if y > 0.0 {
        numerator / (2.0 * y)
    } else if numerator == 0.0 {
        0.0
    } else {
        numerator.signum() * f64::INFINITY
    }
}
