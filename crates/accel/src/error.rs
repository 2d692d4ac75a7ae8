/// Why triangles make no [`Accel`](crate::Accel).
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BadTriangles {
    /// An index names no position.
    #[error("triangle {triangle} names position {index} of {positions}")]
    Index {
        /// The triangle.
        triangle: usize,
        /// What it names.
        index: u32,
        /// Number of positions.
        positions: usize,
    },
}

/// Why a tree could not be refitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RefitError {
    /// The scene is another one: its topology differs.
    #[error("the tree is of a scene with {expected} triangles, not {found}: build a new one")]
    Triangles {
        /// Triangles of the scene that the tree is of.
        expected: usize,
        /// Triangles of the scene given.
        found: usize,
    },
    /// Another number of vertices.
    #[error("the tree is of {expected} vertices, not {found}: build a new one")]
    Positions {
        /// Vertices that the tree is of.
        expected: usize,
        /// Vertices given.
        found: usize,
    },
}
