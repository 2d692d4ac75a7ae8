// A binary tree over triangles for rays, as it lies in memory.
// Twin: crates/accel/src/flat.rs, which builds it.

/// An inner node: the boxes of its two children and where these are. Node 0 is the root.
struct AccelNode {
    lower_0: vec3<f32>,
    /// 0: nothing; below ACCEL_LEAF the index of a node; else ACCEL_LEAF + the index of a leaf's first triangle.
    child_0: u32,
    upper_0: vec3<f32>,
    child_1: u32,
    lower_1: vec3<f32>,
    upper_1: vec3<f32>,
}

/// A triangle of a leaf; those of one leaf follow each other.
struct AccelTriangle {
    a: vec3<f32>,
    /// Index among the scene's triangles.
    index: u32,
    b: vec3<f32>,
    /// ACCEL_MASKED | ACCEL_LAST | ACCEL_VOID.
    flags: u32,
    c: vec3<f32>,
}

/// What a ray hits: (1−u−v)·a + u·b + v·c, at `t` lengths of its direction.
struct AccelHit {
    t: f32,
    u: f32,
    v: f32,
    /// Index among the scene's triangles, ACCEL_NONE or ACCEL_UNFINISHED.
    triangle: u32,
}

const ACCEL_LEAF: u32 = 0x80000000u;

/// The triangle's material has an alpha mask.
const ACCEL_MASKED: u32 = 1u;
/// The last triangle of its leaf.
const ACCEL_LAST: u32 = 2u;
/// No ray hits it: it has no area.
const ACCEL_VOID: u32 = 4u;

/// Nothing is hit.
const ACCEL_NONE: u32 = 0xffffffffu;
/// The ray crosses more boxes and triangles than ACCEL_ROUNDS: what it hits is not known.
const ACCEL_UNFINISHED: u32 = 0xfffffffeu;

/// Entries of the traversal's stack: no tree is deeper.
const ACCEL_STACK: u32 = 48u;
/// Boxes and triangles that a ray may look at. Software renderers end an invocation's loops silently after 65 535 rounds of all
/// of them together.
const ACCEL_ROUNDS: u32 = 65000u;
