//! `pyramid`: bounds and sums over the lit texels of a map, level by level.

use glam::Vec3;
use indirect_core::{GBuffer, math::versine_of_sum};
use rayon::prelude::*;

use crate::{
    layout::{Node, Texel},
    rsm::{Pyramid, PyramidLayout},
};

/// The mip pyramid of one map.
#[must_use]
pub fn pyramid(surface: &GBuffer, texels: &[Texel]) -> Pyramid {
    let layout = PyramidLayout::new(surface.size);
    let mut nodes = Vec::with_capacity(layout.len());
    (0..texels.len())
        .into_par_iter()
        .map(|i| leaf(surface.depth[i], surface.normal[i], &texels[i]))
        .collect_into_vec(&mut nodes);
    for pair in layout.levels.windows(2) {
        let (fine, coarse) = (pair[0], pair[1]);
        let children = &nodes[fine.offset as usize..];
        let width = coarse.size[0];
        let level: Vec<Node> = (0..coarse.len() as u32)
            .into_par_iter()
            .with_min_len(1024)
            .map(|i| parent(children, fine.size, i % width, i / width))
            .collect();
        nodes.extend(level);
    }
    Pyramid { layout, nodes }
}

/// The node of one texel. What is not finite counts as unlit: one such texel would be in every sum above it.
fn leaf(depth: f32, normal: Vec3, texel: &Texel) -> Node {
    if texel.incident.max_element() <= 0.0 || !texel.incident.is_finite() || !texel.reflected.is_finite() {
        return Node::EMPTY;
    }
    Node {
        reflected: texel.reflected,
        depth_min: depth,
        incident: texel.incident,
        depth_max: depth,
        cone_axis: normal,
        cone_versine: 0.0,
    }
}

/// The node above the up to four children at `(2x, 2y)…(2x+1, 2y+1)`.
fn parent(children: &[Node], size: [u32; 2], x: u32, y: u32) -> Node {
    let mut node = Node::EMPTY;
    let mut axis = Vec3::ZERO;
    let x_end = (2 * x + 2).min(size[0]);
    let y_end = (2 * y + 2).min(size[1]);
    for cy in 2 * y..y_end {
        for cx in 2 * x..x_end {
            let child = &children[(cy * size[0] + cx) as usize];
            node.reflected += child.reflected;
            node.incident += child.incident;
            node.depth_min = node.depth_min.min(child.depth_min);
            node.depth_max = node.depth_max.max(child.depth_max);
            axis += child.cone_axis;
        }
    }
    if node.depth_min > node.depth_max {
        return node;
    }
    let length = axis.dot(axis).sqrt();
    if length < 1e-3 {
        // Normals that cancel: no axis is better than another, the cone is everything.
        node.cone_axis = Vec3::Z;
        node.cone_versine = 2.0;
        return node;
    }
    node.cone_axis = axis * (1.0 / length);
    for cy in 2 * y..y_end {
        for cx in 2 * x..x_end {
            let child = &children[(cy * size[0] + cx) as usize];
            if child.depth_min <= child.depth_max {
                let offset = child.cone_axis - node.cone_axis;
                // |a − b|²/2 is 1 − cos of the angle between unit vectors, without its cancellation.
                let versine = versine_of_sum(0.5 * offset.dot(offset), child.cone_versine);
                node.cone_versine = node.cone_versine.max(versine);
            }
        }
    }
    node
}
