//! `compact`: the valid blocks as one list of fragments, neighbours near each other.

use rayon::prelude::*;
use rsm::PyramidLayout;

use super::blocks::Blocks;
use crate::{layout::state, output::Fragments};

/// Lists the nodes that are [`state::VALID`], in Z order.
#[must_use]
pub fn compact(blocks: &Blocks<'_>, states: &[u32], layout: &PyramidLayout, coarsest: usize) -> Fragments {
    let count = states.iter().filter(|s| **s == state::VALID).count();
    let (nodes, slots) = (Vec::with_capacity(count), vec![0; states.len()]);
    let mut fragments = Fragments { nodes, slots, ..Fragments::default() };
    let walk = Walk { states, layout };
    // Down from the single node of the last level; levels above the coarsest blocks have no state and are passed through.
    walk.visit(&mut fragments, layout.levels.len() - 1, coarsest, 0, 0);
    let points = fragments.nodes.par_iter().with_min_len(1024).map(|node| blocks.point(*node as usize));
    points.unzip_into_vecs(&mut fragments.positions, &mut fragments.normals);
    fragments
}

struct Walk<'a> {
    states: &'a [u32],
    layout: &'a PyramidLayout,
}

impl Walk<'_> {
    fn visit(&self, fragments: &mut Fragments, level: usize, coarsest: usize, x: u32, y: u32) {
        let l = self.layout.levels[level];
        if x >= l.size[0] || y >= l.size[1] {
            return;
        }
        let node = (l.offset + y * l.size[0] + x) as usize;
        let state = if level > coarsest { state::SPLIT } else { self.states[node] };
        if state == state::VALID {
            fragments.slots[node] = fragments.nodes.len() as u32;
            fragments.nodes.push(node as u32);
        } else if state == state::SPLIT && level > 0 {
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                self.visit(fragments, level - 1, coarsest, 2 * x + dx, 2 * y + dy);
            }
        }
    }
}
