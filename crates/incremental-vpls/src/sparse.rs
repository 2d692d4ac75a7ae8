//! Where points are densest and where they are sparsest: removal and insertion by dispersion (Niederreiter 1992, as in Laine et al.
//! 2007).

use core::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::{DVec2, DVec3, Vec2};
use indirect_sampling::{mapping, sobol};
use spade::Triangulation;
use spade::handles::FixedVertexHandle;

use crate::cells::bisector;
use crate::pattern::{Edge, Pattern, centre_offset};
use crate::shape::{Shape, clip};

/// Third vertex of the outer face.
const OUTER: u32 = u32::MAX;
/// A face at the right that does not matter.
const ANY: u32 = u32::MAX - 1;

/// Points that are tried where the triangulation offers no candidate.
const TRIALS: u32 = 64;

/// Halvings of an interval of at most 2: to the last digit.
const HALVINGS: u32 = 52;

/// Empty circles smaller than this are no place for a point.
const LEAST_RADIUS: f64 = 1e-9;

/// Centre of an empty circle.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    /// Radius of the circle; chord on the sphere.
    radius: f64,
    centre: DVec3,
    /// Two vertices of an edge and the vertices beyond it at the left and right: where the mesh no longer has these, another
    /// point has come into the circle.
    key: [u32; 4],
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.radius.total_cmp(&other.radius).then_with(|| other.key.cmp(&self.key))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

fn beyond(edge: Edge<'_>) -> u32 {
    edge.opposite_vertex().map_or(OUTER, |v| v.index() as u32)
}

impl Pattern {
    /// Puts `count` points one by one into the largest empty circle. Fewer where there is no room left; the new points, which
    /// have the next numbers.
    ///
    /// The centre of the largest empty circle is a vertex of the Voronoi diagram. On the disc its radius is bounded by
    /// the distance to the mirror image behind the rim as well, `2 (1 − r)`: so a point keeps half of the spacing to the rim, where the
    /// largest circle alone would put it onto the rim and half of its cell outside. Then the centre can also lie on a Voronoi edge,
    /// where both are equal.
    ///
    /// `seed` chooses the first point where there is none. All others follow.
    pub fn insert_sparsest(&mut self, count: usize, seed: u32) -> Vec<DVec3> {
        let mut heap = BinaryHeap::new();
        self.candidates(&mut heap);
        let mut added = Vec::with_capacity(count);
        while added.len() < count {
            let found = self.next_valid(&mut heap).or_else(|| self.trial(seed));
            let Some(Candidate { radius, centre, key }) = found else { break };
            if radius < LEAST_RADIUS {
                break;
            }
            let hint = (key[0] != OUTER).then(|| FixedVertexHandle::from_index(key[0] as usize));
            let before = self.len;
            let handle = self.add(centre, hint);
            if self.len == before {
                break;
            }
            added.push(centre);
            if let Some(handle) = handle {
                self.candidates_at(handle, &mut heap);
            }
        }
        added
    }

    /// The largest empty circle whose centre could be a new point: how sparse the pattern is where it is sparsest. Infinite
    /// without points.
    #[must_use]
    pub fn dispersion(&mut self) -> f64 {
        let mut heap = BinaryHeap::new();
        self.candidates(&mut heap);
        self.next_valid(&mut heap).or_else(|| self.trial(0)).map_or(f64::INFINITY, |c| c.radius)
    }

    fn next_valid(&mut self, heap: &mut BinaryHeap<Candidate>) -> Option<Candidate> {
        while let Some(c) = heap.pop() {
            self.steps += 1;
            let [a, b] = [c.key[0], c.key[1]].map(|i| FixedVertexHandle::from_index(i as usize));
            let edge = self.mesh.get_edge_from_neighbors(a, b);
            let same =
                |e: Edge<'_>| beyond(e) == c.key[2] && (c.key[3] == ANY || beyond(e.rev()) == c.key[3]);
            if edge.is_some_and(same) {
                return Some(c);
            }
        }
        None
    }

    /// The best of some fixed points: for patterns so small that no Voronoi vertex lies in the domain.
    fn trial(&mut self, seed: u32) -> Option<Candidate> {
        let points: Vec<DVec3> = (0..self.points.len()).filter_map(|id| self.point(id)).collect();
        let mut best: Option<Candidate> = None;
        for i in 0..TRIALS {
            self.steps += 1;
            let centre = even_point(self.shape, i, seed);
            let nearest = points.iter().map(|p| p.distance(centre)).fold(f64::INFINITY, f64::min);
            // On an empty sphere all are as good: the first.
            let radius = nearest.min(self.shape.rim(centre));
            if best.is_none_or(|b| radius > b.radius) {
                best = Some(Candidate { radius, centre, key: [OUTER; 4] });
            }
        }
        best
    }

    /// All candidates of the mesh.
    fn candidates(&mut self, heap: &mut BinaryHeap<Candidate>) {
        let mut all = Vec::with_capacity(2 * self.len);
        for face in self.mesh.inner_faces() {
            all.extend(self.face_candidate(face.adjacent_edge()));
        }
        match self.shape {
            Shape::Disc => {
                for edge in self.mesh.undirected_edges() {
                    self.edge_candidates(edge.as_directed(), &mut all);
                }
            }
            Shape::Sphere => {
                for edge in self.outer_edges() {
                    all.extend(self.face_candidate(edge));
                }
            }
        }
        self.steps += all.len() as u64;
        heap.extend(all);
    }

    /// The candidates that a new vertex brings: all faces and edges that changed touch it or are opposite to it.
    fn candidates_at(&mut self, vertex: FixedVertexHandle, heap: &mut BinaryHeap<Candidate>) {
        let mut new = Vec::new();
        for edge in self.mesh.vertex(vertex).out_edges() {
            new.extend(self.face_candidate(edge));
            match self.shape {
                Shape::Disc => {
                    self.edge_candidates(edge, &mut new);
                    self.edge_candidates(edge.next(), &mut new);
                }
                Shape::Sphere if edge.is_outer_edge() => new.extend(self.face_candidate(edge.prev())),
                Shape::Sphere => {}
            }
        }
        self.steps += new.len() as u64;
        heap.extend(new);
    }

    /// The circle around the face at an edge's left.
    fn face_candidate(&self, edge: Edge<'_>) -> Option<Candidate> {
        let [a, b] = edge.vertices();
        let key = [a.index() as u32, b.index() as u32, beyond(edge), ANY];
        let (centre, radius) = match self.shape {
            Shape::Disc => {
                let (middle, normal) = bisector(edge);
                let t = centre_offset(edge);
                let centre = (middle + normal * t).extend(0.0);
                (centre, centre.distance(self.at(*a.data())))
            }
            Shape::Sphere => {
                let centre = self.centre(edge);
                (centre, centre.distance(self.at(*a.data())))
            }
        };
        (radius.is_finite() && self.shape.rim(centre) >= radius).then_some(Candidate { radius, centre, key })
    }

    /// Disc: where the border of two cells is as far from its points as from the rim's mirror image.
    fn edge_candidates(&self, edge: Edge<'_>, out: &mut Vec<Candidate>) {
        let [a, b] = edge.vertices();
        let (middle, normal) = bisector(edge);
        let (enter, leave) = clip(middle, normal);
        let from = (-centre_offset(edge.rev())).max(enter);
        let to = centre_offset(edge).min(leave);
        if from >= to {
            return;
        }
        let p: DVec2 = self.at(*a.data()).truncate();
        let at = |t: f64| middle + normal * t;
        // Concave along the line: both lengths are convex. So it is positive on one interval, or nowhere.
        let excess = |t: f64| 2.0 * (1.0 - at(t).length()) - at(t).distance(p);
        let positive = |t: f64| excess(t) > 0.0;
        let (low, high) = (positive(from), positive(to));
        if low && high {
            return;
        }
        let within = if low {
            from
        } else if high {
            to
        } else {
            // Nearest to the points, or nearest to the centre of the disc.
            let nearest = [0.0, -middle.dot(normal)].map(|t| t.clamp(from, to));
            let Some(t) = nearest.into_iter().find(|&t| positive(t)) else { return };
            t
        };
        let key = [a.index() as u32, b.index() as u32, beyond(edge), beyond(edge.rev())];
        for (end, inside) in [(from, low), (to, high)] {
            if inside {
                continue;
            }
            let (mut good, mut bad) = (within, end);
            for _ in 0..HALVINGS {
                let t = 0.5 * (good + bad);
                if positive(t) {
                    good = t;
                } else {
                    bad = t;
                }
            }
            let centre = at(good);
            out.push(Candidate { radius: centre.distance(p), centre: centre.extend(0.0), key });
        }
    }

    /// Removes `count` points, one after the other, from where they are densest; their numbers, in that order.
    ///
    /// Of the two points that are nearest to each other the one goes whose next neighbour is nearer. On the disc the mirror
    /// image behind the rim counts as a neighbour, see [`Pattern::insert_sparsest`]. The pole of a sphere stays while another
    /// point is left.
    pub fn remove_densest(&mut self, count: usize) -> Vec<usize> {
        let mut removed = Vec::with_capacity(count.min(self.len));
        while removed.len() < count {
            let Some(id) = self.densest() else { break };
            removed.push(id);
        }
        removed
    }

    /// Removes one point.
    fn densest(&mut self) -> Option<usize> {
        // Nearest pair as (squared distance, handle, other number); a pair with the rim or the pole names that by a number of none.
        let mut best: Option<(f64, FixedVertexHandle, Option<FixedVertexHandle>)> = None;
        let mut offer = |square: f64, v: FixedVertexHandle, w: Option<FixedVertexHandle>| {
            if best.is_none_or(|(least, ..)| square < least) {
                best = Some((square, v, w));
            }
        };
        for edge in self.mesh.undirected_edges() {
            let [v, w] = edge.vertices();
            offer(self.at(*v.data()).distance_squared(self.at(*w.data())), v.fix(), Some(w.fix()));
        }
        match (self.shape, self.pole) {
            (Shape::Disc, _) => {
                for v in self.mesh.vertices() {
                    offer(self.shape.rim(self.at(*v.data())).powi(2), v.fix(), None);
                }
            }
            (Shape::Sphere, Some(pole)) => {
                let pole = self.points[pole];
                for edge in self.outer_edges() {
                    offer(self.at(*edge.from().data()).distance_squared(pole), edge.from().fix(), None);
                }
                if self.mesh.num_undirected_edges() == 0
                    && let Some(v) = self.mesh.vertices().next()
                {
                    offer(self.at(*v.data()).distance_squared(pole), v.fix(), None);
                }
            }
            (Shape::Sphere, None) => {}
        }
        self.steps += self.mesh.num_undirected_edges() as u64;
        let Some((_, v, w)) = best else {
            // The pole alone, or nothing.
            let pole = self.pole.take()?;
            self.live[pole] = false;
            self.len -= 1;
            return Some(pole);
        };
        let goes = match w {
            Some(w) if self.second_nearest(w, v) < self.second_nearest(v, w) => w,
            _ => v,
        };
        let id = self.mesh.remove(goes).id;
        self.live[id] = false;
        self.len -= 1;
        Some(id)
    }

    /// Squared distance from `v` to its nearest neighbour but `other`.
    fn second_nearest(&self, v: FixedVertexHandle, other: FixedVertexHandle) -> f64 {
        let v = self.mesh.vertex(v);
        let p = self.at(*v.data());
        let mut least = match self.pole {
            Some(pole) => p.distance_squared(self.points[pole]),
            None => self.shape.rim(p).powi(2),
        };
        for edge in v.out_edges().filter(|e| e.to().fix() != other) {
            least = least.min(p.distance_squared(self.at(*edge.to().data())));
        }
        least
    }
}

/// Point `index` of an even sequence over the domain.
pub(crate) fn even_point(shape: Shape, index: u32, seed: u32) -> DVec3 {
    let u: Vec2 = sobol::sample_2d(index, seed);
    match shape {
        Shape::Disc => {
            let p = mapping::disc_concentric(u).as_dvec2();
            // f32 may round onto or past the rim.
            (p * (1.0 - 1e-6)).extend(0.0)
        }
        Shape::Sphere => mapping::sphere_uniform(u).as_dvec3().normalize(),
    }
}
