//! `compact`: the valid blocks as one list of fragments, neighbours near each other.

use glam::Vec3;

use crate::{
    layout::{Block, state},
    levels::Levels,
};

/// The valid blocks in Z order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Fragments {
    /// The node of each fragment.
    pub nodes: Vec<u32>,
    /// World position, metres, and unit normal of each fragment.
    pub points: Vec<(Vec3, Vec3)>,
    /// The fragment of each valid node; 0 for any other node.
    pub slots: Vec<u32>,
}

/// Lists the nodes that are [`state::VALID`], in the order of `levels`.
#[must_use]
pub fn compact(blocks: &[Block], states: &[u32], levels: &Levels) -> Fragments {
    let mut fragments = Fragments { slots: vec![0; states.len()], ..Fragments::default() };
    // Levels above the coarsest blocks have no state.
    for &node in levels.order.iter().filter(|n| states.get(**n as usize) == Some(&state::VALID)) {
        let block = &blocks[node as usize];
        fragments.slots[node as usize] = fragments.nodes.len() as u32;
        fragments.nodes.push(node);
        fragments.points.push((block.position, block.normal));
    }
    fragments
}
