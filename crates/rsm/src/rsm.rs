use glam::DVec3;
use indirect_core::settings::BadOption;
use indirect_core::{GBuffer, View};

use crate::layout::{Node, Texel};

/// Most texels along each side of a map.
pub const MAX_RESOLUTION: u32 = 8192;

/// Reflective shadow maps: what all lights of a scene see, and what they send there. No map in the default.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Rsm {
    /// Texels along each side of each map.
    pub resolution: u32,
    /// The maps, in the order of [`views`](crate::views::views).
    pub maps: Vec<Map>,
}

/// One map: a light's view of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// Index into [`Scene::lights`](indirect_core::Scene::lights).
    pub light: usize,
    /// The window through which the light looks.
    pub view: View,
    /// What it sees there.
    pub surface: GBuffer,
    /// The light in each texel, row-major.
    pub texels: Vec<Texel>,
    /// Bounds and sums over the lit texels.
    pub pyramid: Pyramid,
}

impl Map {
    /// Sum of the flux that falls onto surfaces, W, in f64.
    #[must_use]
    pub fn incident(&self) -> DVec3 {
        self.texels.iter().map(|t| t.incident.as_dvec3()).sum()
    }

    /// Sum of the reflected flux, W, in f64.
    #[must_use]
    pub fn reflected(&self) -> DVec3 {
        self.texels.iter().map(|t| t.reflected.as_dvec3()).sum()
    }
}

impl Rsm {
    /// Whether maps that the caller brings are those that a technique's options ask for.
    ///
    /// # Errors
    /// [`BadOption`] where `resolution`, the option of that name, is not theirs.
    pub fn check(&self, resolution: u32) -> Result<(), BadOption> {
        if self.resolution == resolution {
            return Ok(());
        }
        let wanted = format_args!("that of the maps, {}", self.resolution);
        Err(BadOption::new("resolution", resolution, wanted))
    }

    /// Sum of the reflected flux over all maps, W.
    #[must_use]
    pub fn reflected(&self) -> DVec3 {
        self.maps.iter().map(Map::reflected).sum()
    }

    /// Bytes that the maps hold.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let map = |m: &Map| {
            m.surface.bytes()
                + m.texels.len() * size_of::<Texel>()
                + m.pyramid.nodes.len() * size_of::<Node>()
        };
        self.maps.iter().map(map).sum()
    }
}

impl Default for Pyramid {
    /// That of a map of one texel, unlit.
    fn default() -> Self {
        Self { layout: PyramidLayout::new([1, 1]), nodes: vec![Node::EMPTY] }
    }
}

/// The nodes of a map's mip pyramid in one array, level 0 (one node per texel) first, each level row-major.
#[derive(Debug, Clone, PartialEq)]
pub struct Pyramid {
    /// Where the levels lie.
    pub layout: PyramidLayout,
    /// All nodes.
    pub nodes: Vec<Node>,
}

impl Pyramid {
    /// The single node of the last level: sums and bounds over the whole map.
    #[must_use]
    pub fn top(&self) -> Node {
        self.nodes.last().copied().unwrap_or(Node::EMPTY)
    }

    /// The nodes of one level, row-major.
    #[must_use]
    pub fn level(&self, level: usize) -> &[Node] {
        let l = self.layout.levels[level];
        &self.nodes[l.offset as usize..][..l.len()]
    }
}

/// One level of a [`PyramidLayout`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Level {
    /// Index of its first node.
    pub offset: u32,
    /// Width and height, nodes.
    pub size: [u32; 2],
}

impl Level {
    /// Number of nodes.
    #[must_use]
    #[allow(clippy::len_without_is_empty, reason = "a level always has a node")]
    pub const fn len(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }
}

/// Sizes and offsets of the levels of a pyramid over a map of any size: each level halves the one below, rounded up, down
/// to a single node.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PyramidLayout {
    /// Level 0 first.
    pub levels: Vec<Level>,
}

impl PyramidLayout {
    /// The levels above a map of `size` texels, both at least 1.
    #[must_use]
    pub fn new(size: [u32; 2]) -> Self {
        let mut levels = vec![Level { offset: 0, size }];
        let mut last = levels[0];
        while last.len() > 1 {
            last = Level { offset: last.offset + last.len() as u32, size: last.size.map(|n| n.div_ceil(2)) };
            levels.push(last);
        }
        Self { levels }
    }

    /// Number of nodes of all levels.
    #[must_use]
    #[allow(clippy::len_without_is_empty, reason = "a pyramid always has a node")]
    pub fn len(&self) -> usize {
        self.levels.iter().map(Level::len).sum()
    }
}
