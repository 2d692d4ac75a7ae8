//! A binary tree in plain arrays, as a GPU reads it: the contents of [`Accel`] without its SIMD layout.
//!
//! Nodes are 64 bytes: the boxes of two children and where these are. Triangles are 48 bytes, those of a leaf one after the other.
//! The topology is that of [`Accel`]: the children of each wide node and the triangles of each packet are put together in pairs,
//! those with the smallest common box first. Where that would be deeper than [`STACK`], which a traversal's stack holds, the subtree
//! is balanced instead: no tree is too deep, whatever the scene.

use glam::Vec3;
use indirect_core::{AlphaMode, Scene};

use crate::Accel;
use crate::builder;
use crate::error::RefitError;
use crate::layout::{LEAF, Tree, WIDTH};

/// Entries that a traversal's stack has: no [`FlatTree`] is deeper.
pub const STACK: u32 = 48;

/// Most triangles of a leaf.
const LEAF_TRIANGLES: u32 = 4;

/// Costs of testing a pair of boxes and a triangle, each one round of the traversal's loop. Their ratio matters little: between 0.6
/// and 1.6 the atrium's mean rounds per ray change by less than 1 %.
const PAIR_COST: f32 = 1.0;
const TRIANGLE_COST: f32 = 1.0;

/// Bounds of a missing child: no ray enters it, and it adds nothing to the bounds of all. Finite, since shaders may assume that
/// infinity does not occur.
const NOWHERE: [Vec3; 2] = [Vec3::splat(3e38), Vec3::splat(-3e38)];

/// Share of its coordinates by which a box grows: `4·2⁻²³`, for the rounding of a ray's moved origin.
const GROWTH: f32 = 4.0 * f32::EPSILON;

indirect_core::wgsl_struct! {
    /// An inner node: the boxes of its two children, metres, and where these are. WGSL's `AccelNode` (`accel/layout.wgsl`).
    #[derive(Debug, Clone, Copy, PartialEq)]
    #[cfg_attr(feature = "gpu", derive(bytemuck::Pod, bytemuck::Zeroable))]
    pub struct FlatNode = "AccelNode" {
        /// Lower corner of the first child's box.
        pub lower_0: [f32; 3],
        /// 0: no child; below 2³¹ the index of a node; else 2³¹ + the index of a leaf's first triangle.
        pub child_0: u32,
        /// Upper corner of the first child's box.
        pub upper_0: [f32; 3],
        /// As `child_0`.
        pub child_1: u32,
        /// Lower corner of the second child's box.
        pub lower_1: [f32; 3],
        /// Unused.
        pub pad0: u32,
        /// Upper corner of the second child's box.
        pub upper_1: [f32; 3],
        /// Unused.
        pub pad1: u32,
    }
}

indirect_core::wgsl_struct! {
    /// A triangle of a leaf. WGSL's `AccelTriangle` (`accel/layout.wgsl`).
    #[derive(Debug, Clone, Copy, PartialEq)]
    #[cfg_attr(feature = "gpu", derive(bytemuck::Pod, bytemuck::Zeroable))]
    pub struct FlatTriangle = "AccelTriangle" {
        /// First vertex, metres.
        pub a: [f32; 3],
        /// Index into the scene's triangles.
        pub index: u32,
        /// Second vertex.
        pub b: [f32; 3],
        /// [`FlatTriangle::MASKED`], [`FlatTriangle::LAST`] and [`FlatTriangle::VOID`].
        pub flags: u32,
        /// Third vertex.
        pub c: [f32; 3],
        /// Unused.
        pub pad0: u32,
    }
}

impl FlatTriangle {
    /// The triangle's material has an alpha mask.
    pub const MASKED: u32 = 1;
    /// The last triangle of its leaf.
    pub const LAST: u32 = 2;
    /// No ray hits it: it has no area.
    pub const VOID: u32 = 4;

    /// Triangle `index` of `scene`; a void one where no ray can hit it.
    fn new(scene: &Scene, index: u32, last: bool) -> Self {
        let found = corners(scene, index);
        let [a, b, c] = found.unwrap_or_default().map(|v| v.to_array());
        let material =
            scene.mesh.materials.get(index as usize).and_then(|m| scene.materials.get(*m as usize));
        let masked = material.is_some_and(|m| matches!(m.alpha_mode, AlphaMode::Mask { .. }));
        let mut flags = if masked { Self::MASKED } else { 0 };
        flags |= if last { Self::LAST } else { 0 };
        flags |= if found.is_none() { Self::VOID } else { 0 };
        Self { a, index, b, flags, c, pad0: 0 }
    }

    fn bounds(&self) -> [Vec3; 2] {
        if self.flags & Self::VOID == 0 {
            bounds([self.a, self.b, self.c].map(Vec3::from_array))
        } else {
            NOWHERE
        }
    }
}

/// The corners of a triangle that a ray can hit: those of [`Accel`] without the ones whose area is 0.
fn corners(scene: &Scene, index: u32) -> Option<[Vec3; 3]> {
    let corners = builder::corners(scene, index as usize)?;
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    // In f64 a sliver that is not 0 is thinner than 10⁻¹⁵ of its length where this is 0.
    ((b - a).cross(c - a) != glam::DVec3::ZERO).then_some(corners)
}

fn bounds([a, b, c]: [Vec3; 3]) -> [Vec3; 2] {
    [a.min(b).min(c), a.max(b).max(c)]
}

fn union([a, b]: [Vec3; 2], [c, d]: [Vec3; 2]) -> [Vec3; 2] {
    [a.min(c), b.max(d)]
}

fn half_area([lower, upper]: [Vec3; 2]) -> f32 {
    let d = (upper - lower).max(Vec3::ZERO);
    d.x * d.y + d.y * d.z + d.z * d.x
}

/// A binary tree over the triangles of a scene as a GPU reads it, and the twin of its queries on the CPU.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FlatTree {
    nodes: Vec<FlatNode>,
    triangles: Vec<FlatTriangle>,
    scene_triangles: usize,
    depth: u32,
}

impl FlatTree {
    /// The tree of `accel` as a binary one, the same for the same [`Accel`]. Triangles without area are left out.
    #[must_use]
    pub fn of(accel: &Accel<'_>) -> Self {
        let mut arena = Arena { scene: &accel.scene, branches: vec![] };
        let root = arena.wide(&accel.tree);
        let mut emit = Emit { arena, nodes: vec![NO_CHILDREN], triangles: vec![], pieces: vec![], depth: 0 };
        if let Some(root) = root {
            emit.run(root);
        }
        let Emit { mut nodes, triangles, pieces, depth, .. } = emit;
        write_boxes(&mut nodes, |first| pieces[first as usize]);
        Self { nodes, triangles, scene_triangles: accel.scene.mesh.triangles.len(), depth }
    }

    /// Vertices and boxes anew, for a scene whose vertices moved: the topology stays, so that queries are right, but become slow
    /// where triangles that were neighbours no longer are. Triangles that the tree left out stay out; those that lose
    /// their area or their vertices are hit by no ray.
    ///
    /// # Errors
    /// [`RefitError::Triangles`]; the tree is then as it was.
    pub fn refit(&mut self, scene: &Scene) -> Result<(), RefitError> {
        let (expected, found) = (self.scene_triangles, scene.mesh.triangles.len());
        if expected != found {
            return Err(RefitError::Triangles { expected, found });
        }
        for t in &mut self.triangles {
            *t = FlatTriangle::new(scene, t.index, t.flags & FlatTriangle::LAST != 0);
        }
        let triangles = &self.triangles;
        write_boxes(&mut self.nodes, |first| {
            let mut all = NOWHERE;
            for t in &triangles[first as usize..] {
                all = union(all, t.bounds());
                if t.flags & FlatTriangle::LAST != 0 {
                    break;
                }
            }
            all
        });
        Ok(())
    }

    /// The nodes, parents before their children; node 0 is the root.
    #[must_use]
    pub fn nodes(&self) -> &[FlatNode] {
        &self.nodes
    }

    /// The triangles of all leaves; those of one scene triangle that was split, repeatedly.
    #[must_use]
    pub fn triangles(&self) -> &[FlatTriangle] {
        &self.triangles
    }

    /// Nodes from the root to the deepest leaf, at most [`STACK`].
    #[must_use]
    pub const fn depth(&self) -> u32 {
        self.depth
    }

    /// Whether any triangle has an alpha mask.
    #[must_use]
    pub fn is_masked(&self) -> bool {
        self.triangles.iter().any(|t| t.flags & FlatTriangle::MASKED != 0)
    }

    /// Memory of nodes and triangles, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.nodes) + size_of_val(&*self.triangles)
    }
}

const NO_CHILDREN: FlatNode = FlatNode {
    lower_0: NOWHERE[0].to_array(),
    child_0: 0,
    upper_0: NOWHERE[1].to_array(),
    child_1: 0,
    lower_1: NOWHERE[0].to_array(),
    pad0: 0,
    upper_1: NOWHERE[1].to_array(),
    pad1: 0,
};

/// All boxes from the bottom up, given those of leaves by their first triangle.
fn write_boxes(nodes: &mut [FlatNode], leaf: impl Fn(u32) -> [Vec3; 2]) {
    let mut inside = vec![NOWHERE; nodes.len()];
    for i in (0..nodes.len()).rev() {
        let of = |child: u32| match child {
            0 => NOWHERE,
            link if link & LEAF != 0 => leaf(link & !LEAF),
            node => inside[node as usize],
        };
        let (first, second) = (of(nodes[i].child_0), of(nodes[i].child_1));
        inside[i] = union(first, second);
        let grown = |b: [Vec3; 2]| {
            // What is nowhere stays there.
            if b == NOWHERE { b } else { [b[0] - b[0].abs() * GROWTH, b[1] + b[1].abs() * GROWTH] }
        };
        let node = &mut nodes[i];
        [node.lower_0, node.upper_0] = grown(first).map(|v| v.to_array());
        [node.lower_1, node.upper_1] = grown(second).map(|v| v.to_array());
    }
}

/// A binary tree in the making: a leaf of one triangle, or two branches.
struct Branch {
    /// Bounds of those parts of its triangles that it is responsible for.
    bounds: [Vec3; 2],
    /// The two branches, or a triangle of the scene.
    parts: Parts,
    /// Triangles below.
    count: u32,
    /// Whether they make one leaf.
    leaf: bool,
    /// Leaves below and inner nodes on the longest way to one.
    leaves: u32,
    height: u32,
    cost: f32,
}

#[derive(Clone, Copy)]
enum Parts {
    Two(u32, u32),
    Triangle(u32),
}

struct Arena<'a> {
    scene: &'a Scene,
    branches: Vec<Branch>,
}

impl Arena<'_> {
    fn push(&mut self, branch: Branch) -> u32 {
        self.branches.push(branch);
        self.branches.len() as u32 - 1
    }

    /// Two branches as one: a leaf where that costs less.
    fn join(&mut self, a: u32, b: u32) -> u32 {
        let (first, second) = (&self.branches[a as usize], &self.branches[b as usize]);
        let bounds = union(first.bounds, second.bounds);
        let (area, count) = (half_area(bounds), first.count + second.count);
        let below = area * PAIR_COST + first.cost + second.cost;
        let together = area * TRIANGLE_COST * count as f32;
        let leaf = count <= LEAF_TRIANGLES && together <= below;
        let (leaves, height) =
            if leaf { (1, 0) } else { (first.leaves + second.leaves, 1 + first.height.max(second.height)) };
        let (parts, cost) = (Parts::Two(a, b), if leaf { together } else { below });
        self.push(Branch { bounds, parts, count, leaf, leaves, height, cost })
    }

    /// Joins those first whose common box is smallest.
    fn join_all(&mut self, mut open: Vec<u32>) -> Option<u32> {
        while open.len() > 1 {
            let area = |i: usize, j: usize| {
                let of = |k: usize| self.branches[open[k] as usize].bounds;
                half_area(union(of(i), of(j)))
            };
            let pairs = (1..open.len()).flat_map(|j| (0..j).map(move |i| (i, j)));
            let (i, j) = pairs.min_by(|a, b| area(a.0, a.1).total_cmp(&area(b.0, b.1)))?;
            let joined = self.join(open[i], open[j]);
            open.remove(j);
            open[i] = joined;
        }
        open.pop()
    }

    /// Everything in the wide tree; `None` where nothing has an area.
    fn wide(&mut self, tree: &Tree) -> Option<u32> {
        let mut done: Vec<Option<u32>> = vec![None; tree.nodes.len()];
        // Children come after their parents.
        for i in (0..tree.nodes.len()).rev() {
            let node = &tree.nodes[i];
            let mut open = Vec::with_capacity(WIDTH);
            for slot in 0..WIDTH {
                let corner = |side: usize| Vec3::from_array([0, 1, 2].map(|k| node.planes[side + k].0[slot]));
                let slab = [corner(0), corner(3)];
                // An unused slot is inside out.
                if slab[0].cmple(slab[1]).all() {
                    let link = node.children[slot];
                    open.extend(if link & LEAF == 0 {
                        done[link as usize]
                    } else {
                        self.packet(tree.packets[(link & !LEAF) as usize].triangles, slab)
                    });
                }
            }
            done[i] = self.join_all(open);
        }
        done.first().copied().flatten()
    }

    /// The triangles of a packet, as far as they are inside of its box.
    fn packet(&mut self, triangles: [u32; WIDTH], [low, high]: [Vec3; 2]) -> Option<u32> {
        let mut open = Vec::with_capacity(WIDTH);
        for triangle in triangles.into_iter().filter(|t| *t != u32::MAX) {
            let Some(corners) = corners(self.scene, triangle) else { continue };
            let whole = bounds(corners);
            let clipped = [whole[0].max(low), whole[1].min(high)];
            let bounds = if clipped[0].cmple(clipped[1]).all() { clipped } else { whole };
            let cost = half_area(bounds) * TRIANGLE_COST;
            let parts = Parts::Triangle(triangle);
            open.push(self.push(Branch { bounds, parts, count: 1, leaf: true, leaves: 1, height: 0, cost }));
        }
        self.join_all(open)
    }

    /// All branches below `top` (itself included) for which `wanted` holds, not looking below them, in order.
    fn below(&self, top: u32, wanted: impl Fn(&Branch) -> bool) -> Vec<u32> {
        let (mut open, mut found) = (vec![top], vec![]);
        while let Some(n) = open.pop() {
            let branch = &self.branches[n as usize];
            match branch.parts {
                Parts::Two(a, b) if !wanted(branch) => open.extend([b, a]),
                _ => found.push(n),
            }
        }
        found
    }

    /// The leaves below `top` as a tree of the least height: halves along the axis on which their centres spread most.
    fn balanced(&mut self, top: u32) -> u32 {
        let leaves = self.below(top, |b| b.leaf);
        self.halves(leaves)
    }

    /// As deep as the logarithm of the number of leaves.
    fn halves(&mut self, mut leaves: Vec<u32>) -> u32 {
        if let [leaf] = leaves[..] {
            return leaf;
        }
        let centre = |n: u32| {
            let [low, high] = self.branches[n as usize].bounds;
            low * 0.5 + high * 0.5
        };
        let spread = leaves.iter().fold(NOWHERE, |b, n| union(b, [centre(*n); 2]));
        let axis = (spread[1] - spread[0]).max_position();
        leaves.sort_by(|a, b| centre(*a)[axis].total_cmp(&centre(*b)[axis]));
        let second = leaves.split_off(leaves.len() / 2);
        let (a, b) = (self.halves(leaves), self.halves(second));
        let (first, second) = (&self.branches[a as usize], &self.branches[b as usize]);
        let branch = Branch {
            bounds: union(first.bounds, second.bounds),
            parts: Parts::Two(a, b),
            count: first.count + second.count,
            leaf: false,
            leaves: first.leaves + second.leaves,
            height: 1 + first.height.max(second.height),
            cost: 0.0,
        };
        self.push(branch)
    }
}

/// `⌈log₂ n⌉` for `n ≥ 1`: the height of a balanced tree of so many leaves.
const fn least_height(leaves: u32) -> u32 {
    u32::BITS - (leaves - 1).leading_zeros()
}

struct Emit<'a> {
    arena: Arena<'a>,
    nodes: Vec<FlatNode>,
    triangles: Vec<FlatTriangle>,
    /// Bounds of the leaf of each triangle.
    pieces: Vec<[Vec3; 2]>,
    depth: u32,
}

impl Emit<'_> {
    fn run(&mut self, root: u32) {
        if self.arena.branches[root as usize].leaf {
            (self.nodes[0].child_0, self.depth) = (self.leaf(root), 1);
            return;
        }
        // Branch, its node, and how high it may be.
        let mut open = vec![(root, 0_usize, STACK)];
        while let Some((branch, node, room)) = open.pop() {
            let branch = self.fitted(branch, room);
            self.depth = self.depth.max(STACK - room + 1);
            let Parts::Two(a, b) = self.arena.branches[branch as usize].parts else { continue };
            let mut link = |part: u32| {
                if self.arena.branches[part as usize].leaf {
                    return self.leaf(part);
                }
                self.nodes.push(NO_CHILDREN);
                open.push((part, self.nodes.len() - 1, room - 1));
                self.nodes.len() as u32 - 1
            };
            let links = [link(a), link(b)];
            [self.nodes[node].child_0, self.nodes[node].child_1] = links;
        }
    }

    /// The branch, or a balanced one of the same leaves where it would not fit below `room` levels.
    fn fitted(&mut self, branch: u32, room: u32) -> u32 {
        let of = |n: u32| &self.arena.branches[n as usize];
        // Below a branch that is too high, one part may still be made to fit as long as each could be balanced.
        let fits = |n: u32| least_height(of(n).leaves) < room;
        let stays = match of(branch).parts {
            Parts::Two(a, b) => of(branch).height <= room || fits(a) && fits(b),
            Parts::Triangle(_) => true,
        };
        if stays { branch } else { self.arena.balanced(branch) }
    }

    /// Writes a leaf; returns the link to it.
    fn leaf(&mut self, branch: u32) -> u32 {
        let mut members: Vec<u32> = self
            .arena
            .below(branch, |_| false)
            .into_iter()
            .filter_map(|n| match self.arena.branches[n as usize].parts {
                Parts::Triangle(triangle) => Some(triangle),
                Parts::Two(..) => None,
            })
            .collect();
        // Two pieces of one split triangle may meet again.
        members.sort_unstable();
        members.dedup();
        let first = self.triangles.len() as u32;
        for (i, triangle) in members.iter().enumerate() {
            let last = i + 1 == members.len();
            self.triangles.push(FlatTriangle::new(self.arena.scene, *triangle, last));
            self.pieces.push(self.arena.branches[branch as usize].bounds);
        }
        first | LEAF
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Leaves of single triangles in a chain, as high as there are leaves.
    fn chain(leaves: u32) -> (Arena<'static>, u32) {
        /// Triangles without vertices: only their numbers matter.
        static SCENE: std::sync::LazyLock<Scene> = std::sync::LazyLock::new(|| {
            let mut scene = Scene::default();
            scene.mesh.triangles = vec![[0; 3]; 100_000];
            scene
        });
        let mut arena = Arena { scene: &SCENE, branches: vec![] };
        let leaf = |arena: &mut Arena<'_>, i: u32| {
            let at = Vec3::splat(i as f32);
            let (bounds, parts) = ([at, at + 1.0], Parts::Triangle(i));
            arena.push(Branch { bounds, parts, count: 1, leaf: true, leaves: 1, height: 0, cost: 1.0 })
        };
        let mut top = leaf(&mut arena, 0);
        for i in 1..leaves {
            let (a, b) = (leaf(&mut arena, i), top);
            let branch = Branch {
                bounds: union(arena.branches[a as usize].bounds, arena.branches[b as usize].bounds),
                parts: Parts::Two(a, b),
                count: i + 1,
                leaf: false,
                leaves: i + 1,
                height: i,
                cost: 1.0,
            };
            top = arena.push(branch);
        }
        (arena, top)
    }

    #[test]
    fn no_tree_is_deeper_than_the_stack() {
        for leaves in [2, 3, 48, 49, 50, 1000, 100_000] {
            let (arena, root) = chain(leaves);
            let mut emit =
                Emit { arena, nodes: vec![NO_CHILDREN], triangles: vec![], pieces: vec![], depth: 0 };
            emit.run(root);
            assert_eq!(emit.triangles.len(), leaves as usize);
            assert_eq!(emit.nodes.len(), leaves as usize - 1);
            // Depths as a traversal would find them.
            let mut deepest = 0;
            let mut open = vec![(0_u32, 1_u32)];
            while let Some((n, depth)) = open.pop() {
                deepest = deepest.max(depth);
                let node = &emit.nodes[n as usize];
                for child in [node.child_0, node.child_1] {
                    assert!(child > n, "children come after their parents");
                    if child & LEAF == 0 {
                        open.push((child, depth + 1));
                    }
                }
            }
            assert_eq!(deepest, emit.depth);
            assert_eq!(deepest, (leaves - 1).min(STACK), "chains keep their shape while there is room");
            let mut members: Vec<u32> = emit.triangles.iter().map(|t| t.index).collect();
            members.sort_unstable();
            assert!(members.into_iter().eq(0..leaves));
        }
    }

    #[test]
    fn least_heights() {
        let heights = [1, 2, 3, 4, 5, 1 << 20, (1 << 20) + 1, u32::MAX].map(least_height);
        assert_eq!(heights, [0, 1, 2, 2, 3, 20, 21, 32]);
    }
}
