//! Traversal and triangle test, generic over the SIMD type.
//!
//! # Why nothing leaks
//!
//! *Triangle.* The test of Woop, Benthin & Wald (2013, "Watertight Ray/Triangle Intersection", JCGT 2(1)): vertices are
//! moved and sheared so that the ray is the z axis, then classified by the signs of three 2-D edge functions. A shared edge
//! has the same two sheared end points in both triangles, hence the same edge function up to its sign, if that sign is
//! exact. `fl(p) − fl(q)` of two products has the exact sign of `p − q` unless it is 0, since rounding is monotonic; where it
//! is 0 it is computed again in f64, which holds products of two f32 without error. An edge function of exactly 0 counts
//! for both neighbours. No operation may be fused.
//!
//! *Boxes.* With `u = 2⁻²⁴` and `D` the largest distance (in any axis) from the ray's origin to the scene's bounds: the
//! sheared vertices carry at most `7uD` of error, the slab distances `3uD`, the hit distance `8uD`, and the boxes of split
//! triangles, whose extent is at most `2D`, `12uD + u|box|`. Moving every slab outward by `32uD` therefore makes the box
//! test conservative for the triangle test as computed, and costs nothing: the slabs stay, the ray's origin moves. Rounding
//! that moved origin costs up to `u(|o| + 32uD)`, and `|o| ≤ |box| + D`; boxes grow by `3u|box|` or more at build time. All
//! of it scales with the scene; there is no absolute epsilon.

use indirect_core::{Hit, Ray, Scene};

use crate::layout::{LEAF, Node, Packet, Row, Tree, WIDTH};
use crate::simd::{Entry, Lanes, Query, Stack};

/// `32 u`, see the module.
const MARGIN: f32 = 32.0 * (f32::EPSILON / 2.0);

/// A ray, prepared once for all boxes and triangles.
struct Prepared<L> {
    /// Origin of the near and of the far slab distances, per axis.
    near_origin: [L; 3],
    far_origin: [L; 3],
    inverse: [L; 3],
    /// Rows of [`Node::planes`] that hold the near and far planes.
    near_row: [usize; 3],
    far_row: [usize; 3],
    /// The axis along which the direction is longest, last.
    axes: [usize; 3],
    /// Origin in the order of `axes`.
    origin: [L; 3],
    shear: [L; 3],
}

impl<L: Lanes> Prepared<L> {
    /// `None` for a ray that hits nothing: no tree, a direction of zero, anything not finite but `t_max`.
    #[inline(always)]
    fn new(tree: &Tree, ray: &Ray) -> Option<Self> {
        let (o, d) = (ray.origin.to_array(), ray.direction.to_array());
        let size = ray.direction.abs();
        let axes = if size.x > size.y && size.x > size.z {
            [1, 2, 0]
        } else if size.y > size.z {
            [2, 0, 1]
        } else {
            [0, 1, 2]
        };
        let [kx, ky, kz] = axes;
        let inverse = [1.0 / d[0], 1.0 / d[1], 1.0 / d[2]];
        // A sum is finite only if all its terms are.
        let finite = (o[0] + o[1] + o[2] + d[0] + d[1] + d[2]).is_finite();
        if !(finite && inverse[kz].is_finite() && ray.t_max > 0.0) || tree.nodes.is_empty() {
            return None;
        }
        let [lo, hi] = &tree.bounds;
        let mut reach = 0.0_f32;
        for i in 0..3 {
            let (a, b) = (hi[i] - o[i], o[i] - lo[i]);
            let farther = if a > b { a } else { b };
            reach = if farther > reach { farther } else { reach };
        }
        let margin = reach * MARGIN;
        let zero = L::splat(0.0);
        let mut r = Self {
            near_origin: [zero; 3],
            far_origin: [zero; 3],
            inverse: [L::splat(inverse[0]), L::splat(inverse[1]), L::splat(inverse[2])],
            near_row: [0; 3],
            far_row: [0; 3],
            axes,
            origin: [L::splat(o[kx]), L::splat(o[ky]), L::splat(o[kz])],
            shear: [L::splat(d[kx] * inverse[kz]), L::splat(d[ky] * inverse[kz]), L::splat(inverse[kz])],
        };
        for i in 0..3 {
            let (plus, minus) = (L::splat(o[i] + margin), L::splat(o[i] - margin));
            let negative = inverse[i].is_sign_negative();
            (r.near_origin[i], r.far_origin[i]) = if negative { (minus, plus) } else { (plus, minus) };
            (r.near_row[i], r.far_row[i]) = if negative { (i + 3, i) } else { (i, i + 3) };
        }
        Some(r)
    }

    #[inline(always)]
    fn near(&self, node: &Node, i: usize) -> L {
        L::load(&node.planes[self.near_row[i]]).sub(self.near_origin[i]).mul(self.inverse[i])
    }

    #[inline(always)]
    fn far(&self, node: &Node, i: usize) -> L {
        L::load(&node.planes[self.far_row[i]]).sub(self.far_origin[i]).mul(self.inverse[i])
    }

    /// Parameters at which the ray enters the children's boxes, and a bit per child that it enters within `[0, limit]`.
    #[inline(always)]
    fn enter(&self, node: &Node, limit: f32) -> (L, u32) {
        // 0·∞ is NaN where the ray lies in the plane of a slab: the order of min and max then drops the slab.
        let near = self.near(node, 2).max(L::splat(0.0));
        let near = self.near(node, 0).max(self.near(node, 1).max(near));
        let far = self.far(node, 2).min(L::splat(limit));
        let far = self.far(node, 0).min(self.far(node, 1).min(far));
        (near, near.le(far))
    }

    /// A vertex of all triangles, moved and sheared so that the ray is the z axis.
    #[inline(always)]
    fn sheared(&self, packet: &Packet, vertex: usize) -> [L; 3] {
        let [kx, ky, kz] = self.axes;
        let z = L::load(&packet.vertices[kz][vertex]).sub(self.origin[2]);
        let x = L::load(&packet.vertices[kx][vertex]).sub(self.origin[0]).sub(self.shear[0].mul(z));
        let y = L::load(&packet.vertices[ky][vertex]).sub(self.origin[1]).sub(self.shear[1].mul(z));
        [x, y, z]
    }

    /// All triangles of a packet at once.
    #[inline(always)]
    fn meet(&self, packet: &Packet, limit: f32) -> Option<Candidates<L>> {
        let (p, q, r) = (self.sheared(packet, 0), self.sheared(packet, 1), self.sheared(packet, 2));
        let (mut a, mut b, mut c) = (edge(q, r), edge(r, p), edge(p, q));
        let zero = L::splat(0.0);
        let least = a.min(b.min(c));
        let most = a.max(b.max(c));
        // Lanes where an edge function is 0 and the other two agree: only there the exact sign matters.
        let unsure = least.eq(zero) | most.eq(zero);
        let mut inside = !(least.lt(zero) & zero.lt(most)) & 0xff;
        if unsure != 0 {
            let x = [p[0].store(), q[0].store(), r[0].store()];
            let y = [p[1].store(), q[1].store(), r[1].store()];
            let (exact, sure) = exact_edges(&x, &y, [a.store(), b.store(), c.store()], unsure);
            (a, b, c) = (L::load(&exact[0]), L::load(&exact[1]), L::load(&exact[2]));
            inside = inside & !unsure | sure;
        }
        if inside == 0 {
            return None;
        }
        // Normalized before the depths come in: a product of three lengths would leave f32's range early.
        let scale = L::splat(1.0).div(a.add(b.add(c)));
        let (u, v) = (b.mul(scale), c.mul(scale));
        let depth = p[2].add(u.mul(q[2].sub(p[2])).add(v.mul(r[2].sub(p[2]))));
        let t = depth.mul(self.shear[2]);
        let lanes = inside & zero.le(t) & t.le(L::splat(limit));
        (lanes != 0).then_some(Candidates { lanes, t, u, v })
    }
}

/// The edge function from `p` to `q` at the ray: twice the signed area of the triangle that the edge makes with it.
#[inline(always)]
fn edge<L: Lanes>(p: [L; 3], q: [L; 3]) -> L {
    q[0].mul(p[1]).sub(q[1].mul(p[0]))
}

/// Lanes of a packet that the ray meets.
struct Candidates<L> {
    lanes: u32,
    t: L,
    u: L,
    v: L,
}

/// The edge functions of the lanes in `unsure` with their exact signs, and the bits of those lanes that the ray meets.
#[cold]
#[inline(never)]
fn exact_edges(x: &[Row; 3], y: &[Row; 3], mut weights: [Row; 3], unsure: u32) -> ([Row; 3], u32) {
    let mut sure = 0;
    for lane in (0..WIDTH).filter(|lane| unsure >> lane & 1 != 0) {
        let edge = |a: usize, b: usize| {
            let product = |p: &Row, q: &Row| f64::from(p.0[lane]) * f64::from(q.0[lane]);
            product(&x[b], &y[a]) - product(&y[b], &x[a])
        };
        let edges = [edge(1, 2), edge(2, 0), edge(0, 1)];
        if !(edges.iter().any(|&e| e < 0.0) && edges.iter().any(|&e| e > 0.0)) {
            sure |= 1 << lane;
        }
        for (row, e) in weights.iter_mut().zip(edges) {
            row.0[lane] = e as f32;
        }
    }
    (weights, sure)
}

/// The hit with the smallest `t`, and of those the triangle with the smallest index, whatever the shape of the tree.
pub(crate) struct Closest<'a, const MASKED: bool> {
    pub(crate) tree: &'a Tree,
    pub(crate) scene: &'a Scene,
    pub(crate) ray: &'a Ray,
}

impl<const MASKED: bool> Query for Closest<'_, MASKED> {
    type Answer = Option<Hit>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Option<Hit> {
        let Self { tree, scene, ray } = self;
        let prepared = Prepared::<L>::new(tree, ray)?;
        // t < t_max ⇔ t ≤ its predecessor; an equal t then wins by a smaller triangle index.
        let best = Hit { t: ray.t_max.next_down(), u: 0.0, v: 0.0, triangle: u32::MAX };
        Stack::with(tree.stack, |stack| nearest::<L, MASKED>(tree, scene, &prepared, best, stack))
    }
}

#[inline(always)]
fn nearest<L: Lanes, const MASKED: bool>(
    tree: &Tree,
    scene: &Scene,
    prepared: &Prepared<L>,
    mut best: Hit,
    mut stack: Stack<'_>,
) -> Option<Hit> {
    let mut link = 0;
    loop {
        if link & LEAF == 0 {
            let node = &tree.nodes[link as usize];
            let (near, mut entered) = prepared.enter(node, best.t);
            if entered != 0 {
                let first = entered.trailing_zeros() as usize;
                entered &= entered - 1;
                if entered == 0 {
                    link = node.children[first];
                    continue;
                }
                let near = near.store();
                // The nearest stays in hand, the rest goes onto the stack, nearest on top.
                let mut nearest = Entry { link: node.children[first], near: near.0[first] };
                let base = stack.len();
                while entered != 0 {
                    let i = entered.trailing_zeros() as usize;
                    let mut e = Entry { link: node.children[i], near: near.0[i] };
                    entered &= entered - 1;
                    if e.near < nearest.near {
                        core::mem::swap(&mut e, &mut nearest);
                    }
                    stack.insert(base, e);
                }
                link = nearest.link;
                continue;
            }
        } else {
            let packet = &tree.packets[(link & !LEAF) as usize];
            if let Some(found) = prepared.meet(packet, best.t) {
                nearest_in::<L, MASKED>(packet, &found, scene, &mut best);
            }
        }
        loop {
            let Some(e) = stack.pop() else {
                return (best.triangle != u32::MAX).then_some(best);
            };
            if e.near <= best.t {
                link = e.link;
                break;
            }
        }
    }
}

#[inline(always)]
fn nearest_in<L: Lanes, const MASKED: bool>(
    packet: &Packet,
    found: &Candidates<L>,
    scene: &Scene,
    best: &mut Hit,
) {
    let (t, u, v) = (found.t.store().0, found.u.store().0, found.v.store().0);
    let mut lanes = found.lanes;
    while lanes != 0 {
        let i = lanes.trailing_zeros() as usize;
        lanes &= lanes - 1;
        let triangle = packet.triangles[i];
        let nearer = t[i] < best.t || t[i] == best.t && triangle < best.triangle;
        if nearer && (!MASKED || packet.masked >> i & 1 == 0 || scene.is_solid(triangle, u[i], v[i])) {
            *best = Hit { t: t[i], u: u[i], v: v[i], triangle };
        }
    }
}

/// Whether anything is hit.
pub(crate) struct Any<'a, const MASKED: bool> {
    pub(crate) tree: &'a Tree,
    pub(crate) scene: &'a Scene,
    pub(crate) ray: &'a Ray,
}

impl<const MASKED: bool> Query for Any<'_, MASKED> {
    type Answer = bool;

    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let Self { tree, scene, ray } = self;
        let Some(prepared) = Prepared::<L>::new(tree, ray) else {
            return false;
        };
        let limit = ray.t_max.next_down();
        Stack::with(tree.stack, |stack| exists::<L, MASKED>(tree, scene, &prepared, limit, stack))
    }
}

#[inline(always)]
fn exists<L: Lanes, const MASKED: bool>(
    tree: &Tree,
    scene: &Scene,
    prepared: &Prepared<L>,
    limit: f32,
    mut stack: Stack<'_>,
) -> bool {
    let mut node = &tree.nodes[0];
    loop {
        let (_, mut entered) = prepared.enter(node, limit);
        while entered != 0 {
            let i = entered.trailing_zeros() as usize;
            entered &= entered - 1;
            let link = node.children[i];
            if link & LEAF == 0 {
                stack.push(Entry { link, near: 0.0 });
                continue;
            }
            let packet = &tree.packets[(link & !LEAF) as usize];
            if let Some(found) = prepared.meet(packet, limit)
                && solid_in::<L, MASKED>(packet, &found, scene)
            {
                return true;
            }
        }
        let Some(e) = stack.pop() else {
            return false;
        };
        node = &tree.nodes[e.link as usize];
    }
}

#[inline(always)]
fn solid_in<L: Lanes, const MASKED: bool>(packet: &Packet, found: &Candidates<L>, scene: &Scene) -> bool {
    if !MASKED || found.lanes & !packet.masked != 0 {
        return true;
    }
    let (u, v) = (found.u.store().0, found.v.store().0);
    let mut lanes = found.lanes;
    while lanes != 0 {
        let i = lanes.trailing_zeros() as usize;
        lanes &= lanes - 1;
        if scene.is_solid(packet.triangles[i], u[i], v[i]) {
            return true;
        }
    }
    false
}
