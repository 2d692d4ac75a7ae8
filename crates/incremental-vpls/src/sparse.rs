//! Where points are densest and where they are sparsest: removal and insertion by dispersion (Niederreiter 1992, as in
//! Laine et al. 2007).

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
    /// Two vertices of an edge and the vertices beyond it at the left and right: where the mesh no longer has these,
    /// another point has come into the circle.
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
    /// Puts `count` points one by one into the largest empty circle. Fewer where there is no room left; the new
    /// points, which have the next numbers.
    ///
    /// The centre of the largest empty circle is a vertex of the Voronoi diagram. On the disc its radius is bounded by
    /// the distance to the mirror image behind the rim as well, `2 (1 − r)`: so a point keeps half of the spacing to
    /// the rim, where the largest circle alone would put it onto the rim and half of its cell outside. Then the centre
    /// can also lie on a Voronoi edge, where both are equal.
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

    /// The largest empty circle whose centre could be a new point: how sparse the pattern is where it is sparsest.
    /// Infinite without points.
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
                let (centre, square) = circle(edge);
                (centre.extend(0.0), square.sqrt())
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
        let p: DVec2 = self.at(*a.data()).truncate();
        // What lies within a circle's radius of the point is at most that much nearer to the rim.
        let square = circle(edge).1.max(circle(edge.rev()).1);
        if 9.0 * square < self.shape.rim(p.extend(0.0)).powi(2) {
            return;
        }
        let (right, left) = (-centre_offset(edge.rev()), centre_offset(edge));
        let (middle, normal) = bisector(edge);
        let (enter, leave) = clip(middle, normal);
        let (from, to) = (right.max(enter), left.min(leave));
        if from >= to {
            return;
        }
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
    /// Of the two points that are nearest to each other the one goes whose next neighbour is nearer. On the disc the
    /// mirror image behind the rim counts as a neighbour, see [`Pattern::insert_sparsest`]. The pole of a sphere stays
    /// while another point is left.
    pub fn remove_densest(&mut self, count: usize) -> Vec<usize> {
        let mut removed = Vec::with_capacity(count.min(self.len));
        // Near pairs alone, as long as they suffice: most pairs of a pattern are not.
        let mut spacing = (self.shape.area() / self.len.max(1) as f64).sqrt();
        while removed.len() < count && !self.is_empty() {
            removed.extend(self.remove_closer(count - removed.len(), spacing));
            spacing = if spacing < 2.0 { 2.0 * spacing } else { f64::INFINITY };
        }
        removed
    }

    /// The same while the two nearest are closer than `spacing`: at most `count` points.
    pub fn remove_closer(&mut self, count: usize, spacing: f64) -> Vec<usize> {
        let mut removed = Vec::with_capacity(count.min(self.len));
        if count == 0 {
            return removed;
        }
        let mut handles = vec![None; self.points.len()];
        let mut near = Vec::new();
        for v in self.mesh.vertices() {
            handles[v.data().id] = Some(v.fix());
            near.extend(self.pair(v.data().id, None, spacing));
        }
        for edge in self.mesh.undirected_edges() {
            let [v, w] = edge.vertices().map(|v| v.data().id);
            near.extend(self.pair(v, Some(w), spacing));
        }
        self.steps += near.len() as u64;
        let mut pairs = BinaryHeap::from(near);
        while removed.len() < count {
            let Some(Pair { ids: (v, w), .. }) = pairs.pop() else { break };
            self.steps += 1;
            if !self.live[v] || w.is_some_and(|w| !self.live[w]) {
                continue;
            }
            let goes = match w {
                Some(w) if self.second_nearest(handles[w], v) < self.second_nearest(handles[v], w) => w,
                _ => v,
            };
            let Some(handle) = handles[goes] else { continue };
            let ring: Vec<usize> = self.mesh.vertex(handle).out_edges().map(|e| e.to().data().id).collect();
            self.mesh.remove(handle);
            self.live[goes] = false;
            self.len -= 1;
            removed.push(goes);
            // The last vertex has moved to the free place.
            if let Some(v) = self.mesh.get_vertex(handle) {
                handles[v.data().id] = Some(handle);
            }
            // The nearest two have an edge between them. One that was not there closes the hole.
            for &v in &ring {
                let Some(v) = handles[v] else { continue };
                for edge in self.mesh.vertex(v).out_edges() {
                    let [v, w] = edge.vertices().map(|v| v.data().id);
                    if v < w && ring.contains(&w) {
                        self.steps += 1;
                        pairs.extend(self.pair(v, Some(w), spacing));
                    }
                }
            }
        }
        // The pole alone.
        if removed.len() < count
            && spacing == f64::INFINITY
            && let Some(pole) = self.pole.take()
        {
            self.live[pole] = false;
            self.len -= 1;
            removed.push(pole);
        }
        removed
    }

    /// Two neighbours, or a point and what all have for a neighbour (pole, rim), if they are closer than `spacing`.
    fn pair(&self, v: usize, w: Option<usize>, spacing: f64) -> Option<Pair> {
        let p = self.points[v];
        let distance = match w.or(self.pole) {
            Some(w) => p.distance(self.points[w]),
            None => self.shape.rim(p),
        };
        (distance < spacing).then_some(Pair { distance, ids: (v, w) })
    }

    /// Distance from the vertex `v` to its nearest neighbour but `other`.
    fn second_nearest(&self, v: Option<FixedVertexHandle>, other: usize) -> f64 {
        let Some(v) = v.and_then(|v| self.mesh.get_vertex(v)) else { return f64::INFINITY };
        let p = self.at(*v.data());
        let least = match self.pole {
            Some(pole) => p.distance(self.points[pole]),
            None => self.shape.rim(p),
        };
        let others = v.out_edges().filter(|e| e.to().data().id != other);
        others.map(|e| p.distance(self.at(*e.to().data()))).fold(least, f64::min)
    }
}

/// Two points and how near to each other they are; the second is `None` for the pole or the rim. The nearest is the
/// greatest.
#[derive(Debug, Clone, Copy)]
struct Pair {
    distance: f64,
    ids: (usize, Option<usize>),
}

impl Ord for Pair {
    fn cmp(&self, other: &Self) -> Ordering {
        other.distance.total_cmp(&self.distance).then_with(|| other.ids.cmp(&self.ids))
    }
}

impl PartialOrd for Pair {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Pair {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Pair {}

/// Disc: centre and squared radius of the circle around the face at an edge's left; infinite for the outer face and
/// for one without area.
fn circle(edge: Edge<'_>) -> (DVec2, f64) {
    let none = (DVec2::INFINITY, f64::INFINITY);
    let Some(third) = edge.opposite_vertex() else { return none };
    let [a, b] = edge.positions().map(|p| DVec2::new(p.x, p.y));
    let p = third.position();
    let (u, v) = (b - a, DVec2::new(p.x, p.y) - a);
    let twice_area = u.perp_dot(v);
    let from_a = (u.perp() * v.length_squared() - v.perp() * u.length_squared()) * (0.5 / twice_area);
    if twice_area > 0.0 { (a + from_a, from_a.length_squared()) } else { none }
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
