use glam::Vec2;
use indirect_core::Scene;

/// What was left out on the way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct LoadStats {
    /// Triangles without area in f32, or with a repeated vertex, that were dropped.
    pub degenerate_triangles: usize,
    /// Primitives of the meshes in the scene that hold points, lines or nothing; each counts once, however often it is placed.
    pub skipped_primitives: usize,
}

/// A scene that passes [`Scene::validate`], and what the reader should know about it.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Loaded {
    /// The scene, with at least one triangle, camera and light or emitter.
    pub scene: Scene,
    /// One line each: what was approximated, replaced or left out.
    pub warnings: Vec<String>,
    /// Counts.
    pub stats: LoadStats,
    /// The second set of texture coordinates (`TEXCOORD_1`) per vertex of the scene, NaN where a primitive has none; empty where no
    /// primitive has one or [`LoadOptions::lightmap_uvs`](crate::LoadOptions::lightmap_uvs) did not ask for it.
    pub lightmap_uvs: Vec<Vec2>,
}

impl From<Scene> for Loaded {
    /// A scene that was built instead of read.
    fn from(scene: Scene) -> Self {
        Self { scene, warnings: Vec::new(), stats: LoadStats::default(), lightmap_uvs: Vec::new() }
    }
}
