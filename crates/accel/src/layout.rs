//! The tree as it lies in memory: 8-wide nodes with f32 boxes, and packets of 8 triangles as leaves.

/// Boxes per node and triangles per packet: one AVX register of f32.
pub(crate) const WIDTH: usize = 8;

/// Marks a child that is a packet; the other bits are its index.
pub(crate) const LEAF: u32 = 1 << 31;

/// Eight values, one register.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(32))]
pub(crate) struct Row(pub(crate) [f32; WIDTH]);

/// An inner node: the boxes of its children, structure of arrays.
#[derive(Debug, Clone, PartialEq)]
#[repr(C, align(64))]
pub(crate) struct Node {
    /// Lower x, y, z, then upper x, y, z. An unused slot has the lower bound +∞ and the upper −∞, which no ray enters.
    pub(crate) planes: [Row; 6],
    /// A node index, or a packet index with [`LEAF`] set; 0 in an unused slot.
    pub(crate) children: [u32; WIDTH],
}

impl Node {
    pub(crate) const EMPTY: Self = Self {
        planes: [
            Row([f32::INFINITY; WIDTH]),
            Row([f32::INFINITY; WIDTH]),
            Row([f32::INFINITY; WIDTH]),
            Row([f32::NEG_INFINITY; WIDTH]),
            Row([f32::NEG_INFINITY; WIDTH]),
            Row([f32::NEG_INFINITY; WIDTH]),
        ],
        children: [0; WIDTH],
    };
}

/// A leaf: up to eight triangles, structure of arrays.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(crate) struct Packet {
    /// Coordinates of the three vertices per axis, `vertices[axis][vertex]`; NaN in an unused lane, which no ray hits.
    pub(crate) vertices: [[Row; 3]; 3],
    /// Index into the scene's triangles per lane.
    pub(crate) triangles: [u32; WIDTH],
    /// Bit per lane: the triangle's material has an alpha mask.
    pub(crate) masked: u32,
}

impl Packet {
    pub(crate) const EMPTY: Self =
        Self { vertices: [[Row([f32::NAN; WIDTH]); 3]; 3], triangles: [u32::MAX; WIDTH], masked: 0 };
}

/// The whole acceleration structure. Node 0 is the root, wherever there are triangles at all.
#[derive(Debug, Clone)]
pub(crate) struct Tree {
    pub(crate) nodes: Vec<Node>,
    pub(crate) packets: Vec<Packet>,
    /// Lower and upper corner of all triangles.
    pub(crate) bounds: [[f32; 3]; 2],
    /// Whether any triangle has an alpha mask.
    pub(crate) masked: bool,
    /// Most entries that a traversal's stack can hold.
    pub(crate) stack: usize,
}
