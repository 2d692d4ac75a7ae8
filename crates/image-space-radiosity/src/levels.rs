use rsm::PyramidLayout;

/// Neighbouring fragments that share one cut through the lights.
pub const TILE: usize = 8;

/// The levels of a pyramid and an order of its nodes in which every node is followed by its children.
///
/// The order is the only thing that walks the pyramid: the quadtree over an image of any size, ragged at right and bottom,
/// becomes a list that needs no stack.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Levels {
    /// Sizes and offsets, level 0 first.
    pub layout: PyramidLayout,
    /// Nodes, as indices into the pyramid, parents before children, neighbours near each other (Z order).
    pub order: Vec<u32>,
    /// For each entry of `order`, the entry that follows when its children are skipped.
    pub next: Vec<u32>,
}

impl Levels {
    /// The levels `finest..` of the pyramid over `size` texels, both sides at least 1.
    ///
    /// `finest` is cut down to the last level.
    #[must_use]
    pub fn new(size: [u32; 2], finest: usize) -> Self {
        let layout = PyramidLayout::new(size);
        let mut levels = Self { layout, order: Vec::new(), next: Vec::new() };
        let top = levels.layout.levels.len() - 1;
        levels.visit(top, finest.min(top), 0, 0);
        levels
    }

    fn visit(&mut self, level: usize, finest: usize, x: u32, y: u32) {
        let [width, height] = self.layout.levels[level].size;
        if x >= width || y >= height {
            return;
        }
        let here = self.order.len();
        self.order.push(self.layout.levels[level].offset + y * width + x);
        self.next.push(0);
        if level > finest {
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                self.visit(level - 1, finest, 2 * x + dx, 2 * y + dy);
            }
        }
        self.next[here] = self.order.len() as u32;
    }

    /// The first level with at most `cells` nodes along its longer side.
    #[must_use]
    pub fn level_of_cells(layout: &PyramidLayout, cells: u32) -> usize {
        let fits = |size: [u32; 2]| size[0].max(size[1]) <= cells.max(1);
        layout.levels.iter().position(|l| fits(l.size)).unwrap_or(layout.levels.len() - 1)
    }
}

/// Level and place of a node of a pyramid, from its index.
#[must_use]
pub(crate) fn place(layout: &PyramidLayout, node: u32) -> (usize, u32, u32) {
    let level = layout.levels.iter().rposition(|l| l.offset <= node).unwrap_or(0);
    let l = layout.levels[level];
    let i = node - l.offset;
    (level, i % l.size[0], i / l.size[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_node_is_met_once_and_skipping_leaves_its_subtree() {
        for size in [[1, 1], [7, 3], [16, 16], [1, 9], [65, 33]] {
            let levels = Levels::new(size, 0);
            let mut sorted = levels.order.clone();
            sorted.sort_unstable();
            assert!(sorted.iter().copied().eq(0..levels.layout.len() as u32), "{size:?}");
            for (i, &node) in levels.order.iter().enumerate() {
                let (level, x, y) = place(&levels.layout, node);
                for (k, &other) in levels.order.iter().enumerate() {
                    let (l, ox, oy) = place(&levels.layout, other);
                    let below = l <= level && (ox >> (level - l), oy >> (level - l)) == (x, y);
                    assert_eq!(below, (i..levels.next[i] as usize).contains(&k), "{size:?} {node} {other}");
                }
            }
        }
    }

    #[test]
    fn a_finest_level_ends_the_order() {
        let levels = Levels::new([16, 8], 2);
        assert_eq!(levels.order.len(), 1 + 2 + 4 * 2);
        assert_eq!(Levels::new([5, 5], 9).order.len(), 1);
        assert_eq!(Levels::level_of_cells(&levels.layout, 16), 0);
        assert_eq!(Levels::level_of_cells(&levels.layout, 5), 2);
        assert_eq!(Levels::level_of_cells(&levels.layout, 0), 4);
    }
}
