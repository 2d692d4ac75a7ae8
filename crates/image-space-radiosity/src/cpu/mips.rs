//! `mips`: mean and bounds of blocks of the camera's pixels, level by level (§3.2.1, figure 2 b, c).

use glam::Vec3;
use indirect_core::{GBuffer, math::versine_of_sum};
use rayon::prelude::*;
use rsm::PyramidLayout;

use super::blocks::pixel;
use crate::layout::Block;

/// The blocks of the levels `1..` of `layout`, which is that of the camera's size.
#[must_use]
pub fn mips(camera: &GBuffer, layout: &PyramidLayout) -> Vec<Block> {
    let first = camera.len();
    let mut blocks = Vec::with_capacity(layout.len() - first);
    for (level, pair) in (1..).zip(layout.levels.windows(2)) {
        let (fine, coarse) = (pair[0], pair[1]);
        let (width, fine_width) = (coarse.size[0], fine.size[0]);
        let nodes = (0..coarse.len() as u32).into_par_iter().with_min_len(1024);
        let at = |i: u32| [i % width, i / width];
        let nodes: Vec<Block> = if level == 1 {
            let child = |x, y| pixel(camera, (y * fine_width + x) as usize);
            nodes.map(|i| parent(child, fine.size, at(i), level, camera.size)).collect()
        } else {
            let children = &blocks[fine.offset as usize - first..];
            let child = |x, y| children[(y * fine_width + x) as usize];
            nodes.map(|i| parent(child, fine.size, at(i), level, camera.size)).collect()
        };
        blocks.extend(nodes);
    }
    blocks
}

/// The block of the up to four children at `(2x, 2y)…(2x+1, 2y+1)`.
fn parent(
    child: impl Fn(u32, u32) -> Block,
    size: [u32; 2],
    [x, y]: [u32; 2],
    level: u32,
    image: [u32; 2],
) -> Block {
    let mut block = Block::EMPTY;
    let mut axis = Vec3::ZERO;
    let x_end = (2 * x + 2).min(size[0]);
    let y_end = (2 * y + 2).min(size[1]);
    for cy in 2 * y..y_end {
        for cx in 2 * x..x_end {
            let child = child(cx, cy);
            block.depth_min = block.depth_min.min(child.depth_min);
            block.depth_max = block.depth_max.max(child.depth_max);
            block.pixels += child.pixels;
            axis += child.normal;
        }
    }
    if block.pixels == 0 {
        return block;
    }
    let covered = side(x, level, image[0]) * side(y, level, image[1]);
    block.mixed = u32::from(block.pixels < covered);
    let length = axis.dot(axis).sqrt();
    let cancelled = length < 1e-3;
    // Normals that cancel: no axis is better than another, the cone is everything.
    block.normal = if cancelled { Vec3::Z } else { axis * (1.0 / length) };
    for cy in 2 * y..y_end {
        for cx in 2 * x..x_end {
            let child = child(cx, cy);
            block.position += child.position * (child.pixels as f32 / block.pixels as f32);
        }
    }
    for cy in 2 * y..y_end {
        for cx in 2 * x..x_end {
            let child = child(cx, cy);
            if child.pixels > 0 {
                let v = child.position - block.position;
                block.radius = block.radius.max(v.dot(v).sqrt() + child.radius);
                let offset = child.normal - block.normal;
                let versine = versine_of_sum(0.5 * offset.dot(offset), child.versine);
                block.versine = block.versine.max(versine);
            }
        }
    }
    if cancelled {
        block.versine = 2.0;
    }
    block
}

/// Pixels along one side of a block that lie inside the image.
fn side(i: u32, level: u32, size: u32) -> u32 {
    ((i + 1) << level).min(size) - (i << level)
}
