use rsm::PyramidLayout;

use crate::settings::Options;

/// Patches along each side of a map, and blocks along each side of the image, that `sources` looks at.
pub const SOURCE_CELLS: u32 = 4;
/// See [`SOURCE_CELLS`].
pub const RECEIVER_CELLS: u32 = 16;

/// The pyramids over the camera's pixels and over a map's texels, and which of their levels are used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pyramids {
    /// Over the pixels.
    pub pixels: PyramidLayout,
    /// Level of the coarsest blocks.
    pub block: usize,
    /// Over the texels.
    pub texels: PyramidLayout,
    /// Levels of the coarsest and of the finest patches.
    pub range: [usize; 2],
    /// Level of the patches that have shadow maps: not the texels, unless there is no other.
    pub shadow: usize,
}

impl Pyramids {
    /// For an image of `size` pixels.
    #[must_use]
    pub fn new(options: &Options, size: [u32; 2]) -> Self {
        let (pixels, texels) = (PyramidLayout::new(size), PyramidLayout::new([options.resolution; 2]));
        Self {
            block: (options.block as usize).min(pixels.levels.len() - 1),
            range: [options.coarsest, options.finest].map(|cells| level_of_cells(&texels, cells)),
            shadow: level_of_cells(&texels, options.shadow_cells).max(1).min(texels.levels.len() - 1),
            pixels,
            texels,
        }
    }

    /// Number of nodes of the levels that blocks have, the pixels among them.
    #[must_use]
    pub fn nodes(&self) -> usize {
        let last = self.pixels.levels[self.block];
        last.offset as usize + last.len()
    }

    /// The level of patches that stands for the light of a map.
    #[must_use]
    pub fn source_level(&self) -> usize {
        level_of_cells(&self.texels, SOURCE_CELLS)
    }
}

/// The nodes of a pyramid with parents before their children and neighbours near each other (Z order), as indices into the
/// pyramid: the order in which fragments are listed.
#[must_use]
pub fn z_order(layout: &PyramidLayout) -> Vec<u32> {
    let mut order = Vec::with_capacity(layout.len());
    visit(layout, layout.levels.len() - 1, 0, 0, &mut order);
    order
}

fn visit(layout: &PyramidLayout, level: usize, x: u32, y: u32, order: &mut Vec<u32>) {
    let l = layout.levels[level];
    if x < l.size[0] && y < l.size[1] {
        order.push(l.offset + y * l.size[0] + x);
        if level > 0 {
            for (dx, dy) in QUAD {
                visit(layout, level - 1, 2 * x + dx, 2 * y + dy, order);
            }
        }
    }
}

const QUAD: [(u32, u32); 4] = [(0, 0), (1, 0), (0, 1), (1, 1)];

/// The quadtree over a pyramid, of any size and ragged at right and bottom, as a list for a stackless traversal: from a
/// node either to its first child or to the node that follows it and all beneath it.
///
/// Coarse levels come first and siblings lie side by side, so that a traversal touches few cache lines.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Links {
    /// The pyramid.
    pub layout: PyramidLayout,
    /// The node of each entry, as an index into the pyramid.
    pub order: Vec<u32>,
    /// The entry of the first child; 0 where there is none.
    pub child: Vec<u32>,
    /// The entry that follows when the children are skipped; the number of entries at the end.
    pub next: Vec<u32>,
}

impl Links {
    /// The levels `finest..` of a pyramid; `finest` is cut down to the last level.
    #[must_use]
    pub fn new(layout: &PyramidLayout, finest: usize) -> Self {
        let top = layout.levels.len() - 1;
        let finest = finest.min(top);
        let count = layout.levels[finest..].iter().map(rsm::Level::len).sum::<usize>();
        let mut order = vec![layout.levels[top].offset];
        let (mut child, mut next) = (vec![0; count], vec![count as u32; count]);
        // The list grows while it is read: level by level, siblings together.
        for i in 0..count {
            let (level, x, y) = place(layout, order[i]);
            if level > finest {
                let l = layout.levels[level - 1];
                child[i] = order.len() as u32;
                for (cx, cy) in QUAD.map(|(dx, dy)| (2 * x + dx, 2 * y + dy)) {
                    if cx < l.size[0] && cy < l.size[1] {
                        next[order.len()] = order.len() as u32 + 1;
                        order.push(l.offset + cy * l.size[0] + cx);
                    }
                }
                next[order.len() - 1] = next[i];
            }
        }
        Self { layout: layout.clone(), order, child, next }
    }
}

/// The first level with at most `cells` nodes along its longer side.
#[must_use]
pub fn level_of_cells(layout: &PyramidLayout, cells: u32) -> usize {
    let fits = |size: [u32; 2]| size[0].max(size[1]) <= cells.max(1);
    layout.levels.iter().position(|l| fits(l.size)).unwrap_or(layout.levels.len() - 1)
}

/// Level of a node of a pyramid, from its index.
#[inline]
pub(crate) fn level_of(layout: &PyramidLayout, node: u32) -> usize {
    // From the finest, which has three quarters of all nodes.
    layout.levels.iter().skip(1).take_while(|l| l.offset <= node).count()
}

/// Level, column and row of a node of a pyramid, from its index.
#[must_use]
pub fn place(layout: &PyramidLayout, node: u32) -> (usize, u32, u32) {
    let level = level_of(layout, node);
    let l = layout.levels[level];
    let i = node - l.offset;
    (level, i % l.size[0], i / l.size[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZES: [[u32; 2]; 6] = [[1, 1], [7, 3], [16, 16], [1, 9], [65, 33], [2, 1]];

    #[test]
    fn the_blocks_of_a_4k_image_fit_the_default_storage_binding() {
        let layout = PyramidLayout::new([3840, 2160]);
        let blocks = layout.len() - layout.levels[0].len();
        assert_eq!(blocks, 2_764_902);
        assert!(blocks * size_of::<crate::Block>() <= 128 << 20);
    }

    #[test]
    fn every_node_is_listed_once_after_its_parent() {
        for size in SIZES {
            let links = Links::new(&PyramidLayout::new(size), 0);
            for order in [&links.order, &z_order(&links.layout)] {
                let mut sorted = order.clone();
                sorted.sort_unstable();
                assert!(sorted.iter().copied().eq(0..links.layout.len() as u32), "{size:?}");
                let mut seen = vec![false; order.len()];
                for &node in order {
                    seen[node as usize] = true;
                    let (level, x, y) = place(&links.layout, node);
                    if let Some(l) = links.layout.levels.get(level + 1) {
                        assert!(seen[(l.offset + y / 2 * l.size[0] + x / 2) as usize], "{size:?} {node}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_walk_that_always_descends_meets_every_node_and_skipping_leaves_its_subtree() {
        for size in SIZES {
            let links = Links::new(&PyramidLayout::new(size), 0);
            let walk = |skip: usize| {
                let (mut i, mut met) = (0, Vec::new());
                while i < links.order.len() {
                    met.push(links.order[i]);
                    let descend = i != skip && links.child[i] != 0;
                    i = if descend { links.child[i] } else { links.next[i] } as usize;
                }
                met.sort_unstable();
                met
            };
            let all: Vec<u32> = (0..links.layout.len() as u32).collect();
            assert_eq!(walk(usize::MAX), all);
            for skip in 0..links.order.len() {
                let (level, x, y) = place(&links.layout, links.order[skip]);
                let kept = all.iter().copied().filter(|&node| {
                    let (l, ox, oy) = place(&links.layout, node);
                    !(l < level && (ox >> (level - l), oy >> (level - l)) == (x, y))
                });
                assert!(walk(skip).into_iter().eq(kept), "{size:?} {skip}");
            }
        }
    }

    #[test]
    fn a_finest_level_ends_the_list() {
        let links = Links::new(&PyramidLayout::new([16, 8]), 2);
        assert_eq!(links.order.len(), 1 + 2 + 4 * 2);
        assert_eq!(Links::new(&PyramidLayout::new([5, 5]), 9).order.len(), 1);
        assert_eq!([16, 5, 0].map(|cells| level_of_cells(&links.layout, cells)), [0, 2, 4]);
    }
}
