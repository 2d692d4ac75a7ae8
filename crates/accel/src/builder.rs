//! From triangles to the tree: a binary BVH by `obvhs` (PLOC and reinsertion), collapsed to 8-wide nodes and packets by
//! dynamic programming over the surface area heuristic (Ylitie, Karras & Laine 2017, §3.1).

use glam::{Vec3, Vec3A};
use indirect_core::{AlphaMode, Scene};
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, reinsertion::ReinsertionOptimizer};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use obvhs::{splits::split_aabbs_preset, triangle::Triangle};
use rayon::prelude::*;

use crate::layout::{LEAF, Node, Packet, Tree, WIDTH};

/// Costs of entering a node and of testing a packet. Only their ratio matters, and little: between 0.5 and 2.5 the atrium's
/// query times change by less than 10 %.
const NODE_COST: f32 = 1.0;
const PACKET_COST: f32 = 1.8;

/// Most boxes that reinsertion may visit, estimated.
const REINSERTION_VISITS: f64 = 3e7;

/// Largest coordinate of a usable triangle, metres: the square of larger ones leaves f32's range.
const LARGEST: f32 = 4e18;

/// Largest number of children that a decision of the collapse ranges over: a node has 8, a part of one at most 7.
const PARTS: usize = WIDTH - 1;

/// How much time to spend on a tree that is quick to query.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BuildPreset {
    /// Clustering of neighbours along a space-filling curve, with little optimisation.
    Fast,
    /// A wider search for neighbours and more optimisation: up to a third more rays per second for little more time.
    Balanced,
    /// Optimises every node and splits large triangles: about 4 times the build time of `Balanced` for 10 % more closest
    /// hits per second (more in scenes of few, large triangles).
    #[default]
    Best,
}

impl BuildPreset {
    /// The preset whose tree answers any-hit queries fastest, for structures that only shadow rays ask: pieces of split triangles, which
    /// `Best` makes and which shorten the way to the nearest hit, are more leaves to look into for any hit.
    ///
    /// `ray_bench` on the atrium (256 312 triangles): 13.9 million diffuse rays a second with `Balanced` against 12.5 with `Best`; in the
    /// Cornell box (36 triangles), where a leaf or two hold all, `Best` is faster.
    #[must_use]
    pub const fn for_any_hit(triangles: usize) -> Self {
        if triangles < 1024 { Self::Best } else { Self::Balanced }
    }
}

/// Builds the tree; also returns how many triangles are left out. Those that no ray can hit (zero area by repeated vertices, not finite or absurdly far, naming a vertex or
/// material that does not exist) are.
pub(crate) fn build(scene: &Scene, preset: BuildPreset) -> (Tree, usize) {
    let corners: Vec<Option<[Vec3; 3]>> =
        (0..scene.mesh.triangles.len()).into_par_iter().map(|i| corners(scene, i)).collect();
    let ids: Vec<u32> = (0..corners.len() as u32).filter(|&i| corners[i as usize].is_some()).collect();
    let left_out = corners.len() - ids.len();
    let triangles: Vec<[Vec3; 3]> = corners.into_iter().flatten().collect();
    if triangles.is_empty() {
        let none = Tree { nodes: vec![], packets: vec![], bounds: [[0.0; 3]; 2], masked: false, stack: 0 };
        return (none, left_out);
    }
    let (bvh, order) = binary(&triangles, preset);
    let plan = Plan::new(&bvh, &order);
    let mut emit = Emit {
        scene,
        bvh: &bvh,
        plan: &plan,
        ids: &ids,
        triangles: &triangles,
        nodes: vec![],
        packets: vec![],
    };
    let stack = emit.run();
    let (nodes, packets) = (emit.nodes, emit.packets);
    let root = bvh.nodes[0].aabb();
    let masked = packets.iter().any(|p| p.masked != 0);
    let bounds = [root.min.to_array(), root.max.to_array()];
    (Tree { nodes, packets, bounds, masked, stack }, left_out)
}

/// The corners of triangle `i`, if a ray can hit it.
pub(crate) fn corners(scene: &Scene, i: usize) -> Option<[Vec3; 3]> {
    let mesh = &scene.mesh;
    let vertex = |k: usize| mesh.positions.get(mesh.triangles[i][k] as usize).copied();
    let [a, b, c] = [vertex(0)?, vertex(1)?, vertex(2)?];
    let exists = mesh.materials.get(i).is_some_and(|&m| (m as usize) < scene.materials.len());
    let in_range = |p: Vec3| p.abs().cmple(Vec3::splat(LARGEST)).all();
    let sound = in_range(a) && in_range(b) && in_range(c) && a != b && b != c && c != a;
    (exists && sound).then_some([a, b, c])
}

/// Ends of a box along one axis as a node holds them. Boxes grow by two to four ulp of each coordinate, after rounding no less than one
/// and a half: with the margin of the traversal this covers all errors (see `query`).
pub(crate) fn grown(lo: f32, hi: f32) -> [f32; 2] {
    [lo - lo.abs() * (2.0 * f32::EPSILON), hi + hi.abs() * (2.0 * f32::EPSILON)]
}

/// A binary BVH over all triangles, one reference per leaf, and its nodes with children before parents.
fn binary(triangles: &[[Vec3; 3]], preset: BuildPreset) -> (Bvh2, Vec<u32>) {
    let (search, depth, reinsertion, precision) = match preset {
        BuildPreset::Fast => (PlocSearchDistance::Minimum, 0, 0.01, SortPrecision::U64),
        BuildPreset::Balanced => (PlocSearchDistance::Medium, 3, 0.1, SortPrecision::U64),
        BuildPreset::Best => (PlocSearchDistance::Medium, 1, 1.0, SortPrecision::U128),
    };
    let bounds = |t: &[Vec3; 3]| {
        let (lo, hi) = (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]));
        Aabb::new(Vec3A::from(lo), Vec3A::from(hi))
    };
    let mut boxes: Vec<Aabb> = triangles.par_iter().map(bounds).collect();
    let mut owners: Vec<u32> = (0..triangles.len() as u32).collect();
    if preset == BuildPreset::Best {
        let split: Vec<Triangle> = triangles
            .iter()
            .map(|t| Triangle { v0: t[0].into(), v1: t[1].into(), v2: t[2].into() })
            .collect();
        let (sum, largest) =
            boxes.iter().map(Aabb::half_area).fold((0.0, 0.0_f32), |(s, l), a| (s + a, l.max(a)));
        split_aabbs_preset(&mut boxes, &mut owners, &split, sum / split.len() as f32, largest);
    }
    let indices = (0..boxes.len() as u32).collect();
    let mut bvh =
        PlocBuilder::with_capacity(boxes.len()).build(search, &distinct(&boxes), indices, precision, depth);

    // Reinsertion walks into every box that overlaps the one in hand. Where most overlap (fans of slivers, repeated
    // triangles) fewer nodes are optimised, so that no input takes quadratic time.
    let areas = || bvh.nodes.iter().map(|n| f64::from(n.aabb().half_area()));
    let overlap = areas().sum::<f64>() / areas().next().unwrap_or(0.0);
    let visits = bvh.nodes.len() as f64 * f64::from(reinsertion) * overlap;
    let affordable = (REINSERTION_VISITS / visits).min(1.0) as f32;
    ReinsertionOptimizer::default().run(&mut bvh, reinsertion * affordable, None);

    let order = children_first(&bvh);
    for &n in &order {
        let node = bvh.nodes[n as usize];
        let first = node.first_index as usize;
        let aabb = if node.is_leaf() {
            let index = &mut bvh.primitive_indices[first];
            let aabb = boxes[*index as usize];
            *index = owners[*index as usize];
            aabb
        } else {
            bvh.nodes[first].aabb().union(bvh.nodes[first + 1].aabb())
        };
        bvh.nodes[n as usize].set_aabb(aabb);
    }
    (bvh, order)
}

/// The boxes as the clustering sees them: in a cube of size 1 around the origin, so that areas stay in range, and each
/// grown by a different trifle. Clustering merges boxes that prefer each other; among equal ones, or in a row of ever larger
/// ones, only few do, and it would take quadratic time.
fn distinct(boxes: &[Aabb]) -> Vec<Aabb> {
    let all = boxes.iter().fold(Aabb::INVALID, |all, b| all.union(b));
    let (centre, size) = (all.min * 0.5 + all.max * 0.5, all.diagonal().max_element());
    let scale = if size > f32::MIN_POSITIVE { size.recip() } else { 1.0 };
    // How many boxes a line through the scene meets on average: some tens in ordinary scenes. Where it is more than a
    // thousand, as in a fan of slivers, no tree is good and more than a trifle may go into making one quickly.
    let crossed = boxes.iter().map(|b| f64::from(b.half_area())).sum::<f64>() / f64::from(all.half_area());
    let share = if crossed > 1000.0 { 0.1 } else { 0.0 };
    let trifle = |seed: u32| {
        // Three fields of a multiplicative hash, `[0, 1)` each.
        let h = (u64::from(seed) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let field = |shift: u32| (h >> shift & 0xffff) as f32 / 65536.0;
        Vec3A::new(field(48), field(32), field(16))
    };
    let grown = |(i, b): (usize, &Aabb)| {
        // 2⁻²⁰ of the scene: some ulp of any coordinate, too little to matter for the quality of the tree.
        let most = Vec3A::splat(1.0 / 1_048_576.0) + b.diagonal() * (scale * share);
        let (below, above) = (trifle(2 * i as u32), trifle(2 * i as u32 + 1));
        let at = |p: Vec3A| (p - centre) * scale;
        Aabb::new(at(b.min) - below * most, at(b.max) + above * most)
    };
    boxes.par_iter().enumerate().map(grown).collect()
}

/// All nodes, every node after its children. Reinsertion leaves them in no order.
fn children_first(bvh: &Bvh2) -> Vec<u32> {
    let mut order = Vec::with_capacity(bvh.nodes.len());
    let mut open = vec![0_u32];
    while let Some(n) = open.pop() {
        order.push(n);
        let node = &bvh.nodes[n as usize];
        if !node.is_leaf() {
            open.extend([node.first_index, node.first_index + 1]);
        }
    }
    order.reverse();
    order
}

/// What the collapse decided for one binary node.
#[derive(Clone, Copy)]
struct Choice {
    /// Least cost of representing the subtree by at most `i + 1` children of a wide node.
    cost: [f32; PARTS],
    /// Parts given to the first child for `i + 1` parts; 0: better use one part fewer.
    first: [u8; PARTS],
    /// Parts given to the first child when this node becomes a wide node, 0: a packet instead.
    as_node: u8,
}

struct Plan(Vec<Choice>);

impl Plan {
    fn new(bvh: &Bvh2, order: &[u32]) -> Self {
        let none = Choice { cost: [f32::INFINITY; PARTS], first: [0; PARTS], as_node: 0 };
        let mut choices = vec![none; bvh.nodes.len()];
        let mut counts = vec![0_u32; bvh.nodes.len()];
        for &n in order {
            let node = &bvh.nodes[n as usize];
            let area = node.aabb().half_area();
            if node.is_leaf() {
                counts[n as usize] = node.prim_count;
                choices[n as usize].cost = [area * PACKET_COST; PARTS];
                continue;
            }
            let (l, r) = (node.first_index as usize, node.first_index as usize + 1);
            let count = counts[l] + counts[r];
            counts[n as usize] = count;
            let (left, right) = (choices[l], choices[r]);
            // Best way to share `parts` between the two children.
            let share = |parts: usize| {
                (1..parts)
                    .filter(|&i| i <= PARTS && parts - i <= PARTS)
                    .map(|i| (left.cost[i - 1] + right.cost[parts - i - 1], i as u8))
                    .min_by(|a, b| a.0.total_cmp(&b.0))
                    .unwrap_or((f32::INFINITY, 1))
            };
            let choice = &mut choices[n as usize];
            let (below, first) = share(WIDTH);
            let node_cost = area * NODE_COST + below;
            let packet_cost = if count as usize <= WIDTH { area * PACKET_COST } else { f32::INFINITY };
            (choice.cost[0], choice.as_node) =
                if packet_cost <= node_cost { (packet_cost, 0) } else { (node_cost, first) };
            for parts in 2..=PARTS {
                let (cost, first) = share(parts);
                let fewer = choice.cost[parts - 2];
                (choice.cost[parts - 1], choice.first[parts - 1]) =
                    if cost < fewer { (cost, first) } else { (fewer, 0) };
            }
        }
        Self(choices)
    }
}

struct Emit<'a> {
    scene: &'a Scene,
    bvh: &'a Bvh2,
    plan: &'a Plan,
    ids: &'a [u32],
    triangles: &'a [[Vec3; 3]],
    nodes: Vec<Node>,
    packets: Vec<Packet>,
}

impl Emit<'_> {
    /// Writes all nodes and packets; returns the stack that a traversal needs.
    fn run(&mut self) -> usize {
        self.nodes.push(Node::EMPTY);
        if self.plan.0[0].as_node == 0 {
            let packet = self.packet(0);
            self.write(0, &[0], &[packet]);
            return WIDTH;
        }
        // Wide node, binary node, stack entries in use when a traversal reaches it.
        let mut open = vec![(0_usize, 0_u32, 0_usize)];
        let mut stack = WIDTH;
        while let Some((wide, binary, used)) = open.pop() {
            let children = self.children(binary);
            let inner = |n: u32| self.plan.0[n as usize].as_node != 0;
            stack = stack.max(used + children.len());
            let base = self.nodes.len();
            let inner_count = children.iter().filter(|&&n| inner(n)).count();
            self.nodes.resize(base + inner_count, Node::EMPTY);
            let mut next = base;
            let mut links = Vec::with_capacity(WIDTH);
            for &n in &children {
                if self.plan.0[n as usize].as_node == 0 {
                    let packet = self.packet(n);
                    links.push(packet);
                } else {
                    open.push((next, n, used + children.len() - 1));
                    links.push(next as u32);
                    next += 1;
                }
            }
            self.write(wide, &children, &links);
        }
        stack
    }

    /// The binary nodes that become the children of the wide node made of `n`.
    fn children(&self, n: u32) -> Vec<u32> {
        let mut done = Vec::with_capacity(WIDTH);
        let split = |n: u32, first: u8, parts: usize| {
            let l = self.bvh.nodes[n as usize].first_index;
            [(l + 1, parts - first as usize), (l, first as usize)]
        };
        let mut open = Vec::from(split(n, self.plan.0[n as usize].as_node, WIDTH));
        while let Some((n, mut parts)) = open.pop() {
            let choice = &self.plan.0[n as usize];
            while parts > 1 && choice.first[parts - 1] == 0 {
                parts -= 1;
            }
            if parts == 1 {
                done.push(n);
            } else {
                open.extend(split(n, choice.first[parts - 1], parts));
            }
        }
        done
    }

    /// Fills the slots of a wide node.
    fn write(&mut self, wide: usize, children: &[u32], links: &[u32]) {
        for (slot, (&n, &link)) in children.iter().zip(links).enumerate() {
            let aabb = self.bvh.nodes[n as usize].aabb();
            let node = &mut self.nodes[wide];
            for axis in 0..3 {
                let [lo, hi] = grown(aabb.min[axis], aabb.max[axis]);
                node.planes[axis].0[slot] = lo;
                node.planes[axis + 3].0[slot] = hi;
            }
            node.children[slot] = link;
        }
    }

    /// Writes the packet of all triangles under binary node `n` and returns the link to it.
    fn packet(&mut self, n: u32) -> u32 {
        let mut packet = Packet::EMPTY;
        let mut members: Vec<u32> = Vec::with_capacity(WIDTH);
        let mut open = vec![n];
        while let Some(n) = open.pop() {
            let node = &self.bvh.nodes[n as usize];
            if node.is_leaf() {
                let (first, count) = (node.first_index as usize, node.prim_count as usize);
                members.extend(&self.bvh.primitive_indices[first..first + count]);
            } else {
                open.extend([node.first_index, node.first_index + 1]);
            }
        }
        // Two pieces of one split triangle may meet again.
        members.sort_unstable();
        members.dedup();
        for (lane, &i) in members.iter().enumerate() {
            let corners = self.triangles[i as usize];
            for axis in 0..3 {
                for (vertex, corner) in corners.iter().enumerate() {
                    packet.vertices[axis][vertex].0[lane] = corner[axis];
                }
            }
            let triangle = self.ids[i as usize];
            packet.triangles[lane] = triangle;
            let material = self.scene.mesh.materials[triangle as usize] as usize;
            let masked = matches!(self.scene.materials[material].alpha_mode, AlphaMode::Mask { .. });
            packet.masked |= u32::from(masked) << lane;
        }
        self.packets.push(packet);
        (self.packets.len() - 1) as u32 | LEAF
    }
}
