//! What holds for any image and any maps: each pixel lies in one fragment, each texel counts once.
#![cfg(feature = "cpu")]
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use common::{noise_gbuffer, noise_rsm, random};
use glam::Vec3;
use image_space_radiosity::layout::state;
use image_space_radiosity::{
    Bound, Branch, Links, Patch, SOURCE_CELLS, Thresholds, cpu, level_of_cells, place,
};
use proptest::prelude::*;
use rsm::PyramidLayout;

fn sum(vpls: impl IntoIterator<Item = Vec3>) -> glam::DVec3 {
    vpls.into_iter().map(|f| f.as_dvec3()).sum()
}

/// How often each texel of each map of `resolution²` texels lies beneath the patches `(map, node)`.
fn coverage(
    layout: &PyramidLayout,
    maps: usize,
    nodes: impl IntoIterator<Item = (usize, usize)>,
) -> Vec<u32> {
    let [width, height] = layout.levels[0].size;
    let mut count = vec![0; maps * layout.levels[0].len()];
    for (map, node) in nodes {
        let (level, x, y) = place(layout, node as u32);
        for ty in (y << level)..((y + 1) << level).min(height) {
            for tx in (x << level)..((x + 1) << level).min(width) {
                count[map * layout.levels[0].len() + (ty * width + tx) as usize] += 1;
            }
        }
    }
    count
}

/// The patches of all levels of each map.
fn all_patches(rsm: &rsm::Rsm, layout: &PyramidLayout) -> Vec<Vec<Patch>> {
    let of_map = |map: &rsm::Map| {
        let stored = cpu::patches(map, layout);
        (0..layout.len()).map(|i| cpu::Patches::new(map, &stored).at(i)).collect()
    };
    rsm.maps.iter().map(of_map).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn each_surface_pixel_lies_in_exactly_one_valid_block(
        (w, h, seed) in (1_u32..80, 1_u32..80, any::<u32>()),
        (empty, depth, normal) in (0.0_f32..1.0, 0.0_f32..1.0, 0.0_f32..3.0),
        (coarsest, margin, bend) in (0_usize..7, 0.0_f32..4.0, 0.0_f32..2.0),
    ) {
        let g = noise_gbuffer([w, h], seed, empty);
        let layout = &PyramidLayout::new([w, h]);
        let coarsest = coarsest.min(layout.levels.len() - 1);
        let stored = cpu::mips(&g, layout);
        let blocks = cpu::Blocks::new(&g, &stored);
        let rsm = noise_rsm(8, 1, seed, 0.3);
        let light_layout = PyramidLayout::new([8, 8]);
        let patches = cpu::patches(&rsm.maps[0], &light_layout);
        let maps = [cpu::Patches::new(&rsm.maps[0], &patches)];
        let sources = cpu::sources(&maps, level_of_cells(&light_layout, SOURCE_CELLS), &light_layout);
        let bend = bend * cpu::reference_irradiance(&sources, &blocks, layout);
        let subdivision = cpu::Subdivision { thresholds: Thresholds::new(depth, normal), margin, bend };
        let needs = cpu::refine(&blocks, layout, coarsest, &subdivision, &sources);
        let states = cpu::stencil(&blocks, &needs, layout, coarsest);
        let fragments = cpu::compact(&blocks, &states, layout, coarsest);
        let count = coverage(layout, 1, fragments.nodes.iter().map(|n| (0, *n as usize)));
        for (i, count) in count.into_iter().enumerate() {
            prop_assert_eq!(count, u32::from(g.is_surface(i)), "pixel {}", i);
        }
        for (i, &node) in fragments.nodes.iter().enumerate() {
            prop_assert_eq!(fragments.slots[node as usize], i as u32);
            // A fragment is no mix of surface and background.
            prop_assert_eq!(blocks.at(node as usize).mixed, 0);
        }
        // A state is what brute force says: the chain of needs from the coarsest level down.
        for (i, &found) in states.iter().enumerate() {
            let (level, x, y) = place(layout, i as u32);
            let above = |l: usize| {
                (layout.levels[l].offset + (y >> (l - level)) * layout.levels[l].size[0] + (x >> (l - level))) as usize
            };
            // Pixels need no subdivision.
            let needs = |node: usize| node.checked_sub(layout.levels[0].len()).map_or(0, |block| needs[block]);
            let ancestors_need = (level + 1..=coarsest).all(|l| needs(above(l)) == 1);
            let expected = match (blocks.at(i).pixels, ancestors_need, needs(i)) {
                (0, ..) => state::EMPTY,
                (_, false, _) => state::COVERED,
                (_, true, 0) => state::VALID,
                (_, true, _) => state::SPLIT,
            };
            prop_assert_eq!(found, expected, "node {}", i);
        }
    }

    #[test]
    fn bounds_of_blocks_contain_their_pixels(
        (w, h, seed) in (1_u32..40, 1_u32..40, any::<u32>()), empty in 0.0_f32..1.0,
    ) {
        let g = noise_gbuffer([w, h], seed, empty);
        let layout = PyramidLayout::new([w, h]);
        let stored = cpu::mips(&g, &layout);
        let blocks = cpu::Blocks::new(&g, &stored);
        for (i, b) in (0..layout.len()).map(|i| (i, blocks.at(i))) {
            let (level, x, y) = place(&layout, i as u32);
            let mut pixels = 0;
            let mut mean = glam::DVec3::ZERO;
            let mut all = 0;
            for py in (y << level)..((y + 1) << level).min(h) {
                for px in (x << level)..((x + 1) << level).min(w) {
                    let k = (py * w + px) as usize;
                    all += 1;
                    if g.is_surface(k) {
                        pixels += 1;
                        mean += g.position[k].as_dvec3();
                        prop_assert!(b.depth_min <= g.depth[k] && g.depth[k] <= b.depth_max);
                        // Each level adds a rounding of some 1e-7 to an angle below π.
                        let cos = f64::from(b.normal.dot(g.normal[k]));
                        prop_assert!(1.0 - cos <= f64::from(b.versine) + 1e-5, "{} {}", cos, b.versine);
                    }
                }
            }
            prop_assert_eq!(b.pixels, pixels);
            prop_assert_eq!(b.mixed == 1, pixels > 0 && pixels < all);
            if pixels > 0 {
                let mean = mean / f64::from(pixels);
                prop_assert!((b.position.as_dvec3() - mean).length() < 1e-5 * (1.0 + mean.length()));
            }
        }
    }

    #[test]
    fn every_level_of_patches_has_the_flux_of_the_map(
        (n, maps, seed) in (1_u32..40, 1_u32..4, any::<u32>()), empty in 0.0_f32..1.0,
    ) {
        let rsm = noise_rsm(n, maps, seed, empty);
        let layout = PyramidLayout::new([n, n]);
        for (map, patches) in rsm.maps.iter().zip(all_patches(&rsm, &layout)) {
            let expected = map.reflected();
            for l in &layout.levels {
                let nodes = &patches[l.offset as usize..][..l.len()];
                let found = sum(nodes.iter().map(|p| p.flux));
                // The bound is 1e-3; at most six levels of three additions in f32.
                prop_assert!((found - expected).abs().max_element() <= 1e-5 * expected.max_element());
            }
            // Bounds contain what they bound.
            let slack = |p: &Patch| 1e-5 * (1.0 + p.position.length());
            for (i, p) in patches.iter().enumerate().filter(|(_, p)| p.weight() > 0.0) {
                let (level, x, y) = place(&layout, i as u32);
                for ty in (y << level)..((y + 1) << level).min(n) {
                    for tx in (x << level)..((x + 1) << level).min(n) {
                        let t = &patches[(ty * n + tx) as usize];
                        if t.weight() > 0.0 {
                            let v = t.position - p.position;
                            prop_assert!(v.length() <= p.radius + slack(p));
                            prop_assert!(v.dot(p.normal).abs() <= p.relief + slack(p));
                            prop_assert!(1.0 - p.normal.dot(t.normal) <= p.versine + 1e-5);
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn clusters_count_every_texel_once(
        (n, maps, seed) in (1_u32..40, 1_u32..3, any::<u32>()),
        (empty, depth, normal) in (0.0_f32..1.0, 0.0_f32..1.5, 0.0_f32..3.0),
        (coarsest, finest) in (1_u32..20, 0_u32..40),
    ) {
        let rsm = noise_rsm(n, maps, seed, empty);
        let layout = PyramidLayout::new([n, n]);
        let stored: Vec<_> = rsm.maps.iter().map(|map| cpu::patches(map, &layout)).collect();
        let patches: Vec<_> = rsm.maps.iter().zip(&stored).map(|(m, p)| cpu::Patches::new(m, p)).collect();
        let range = [coarsest, coarsest + finest].map(|c| level_of_cells(&layout, c));
        let slots = cpu::clusters(&patches, &layout, range, Thresholds::new(depth, normal));
        let used = slots.iter().enumerate().filter(|(_, v)| v.flux.element_sum() > 0.0);
        let nodes = used.map(|(i, _)| (i / layout.len(), i % layout.len()));
        check_cut(&rsm, coverage(&layout, maps as usize, nodes), sum(slots.iter().map(|v| v.flux)))?;
    }

    #[test]
    fn cuts_count_every_texel_once(
        (n, maps, seed) in (1_u32..40, 1_u32..3, any::<u32>()),
        (empty, tau, printed) in (0.0_f32..1.0, 0.0_f32..3.0, any::<bool>()),
        (coarsest, finest) in (1_u32..20, 0_u32..40),
    ) {
        let rsm = noise_rsm(n, maps, seed, empty);
        let layout = PyramidLayout::new([n, n]);
        let stored: Vec<_> = rsm.maps.iter().map(|map| cpu::patches(map, &layout)).collect();
        let patches: Vec<_> = rsm.maps.iter().zip(&stored).map(|(m, p)| cpu::Patches::new(m, p)).collect();
        let range = [coarsest, coarsest + finest].map(|c| level_of_cells(&layout, c));
        let links = Links::new(&layout, range[1]);
        let bound = if printed { Bound::ContributionAsPrinted } else { Bound::Error };
        let threshold = tau.powi(4);
        let tree = cpu::tree(&patches, &links, range, cpu::Split::Far { bound, threshold }, None);
        let mut next = random(seed);
        let mut lights = Vec::new();
        for _ in 0..4 {
            let count = 1 + (next() * image_space_radiosity::TILE as f32) as usize;
            let point = |_| Vec3::new(next(), next(), next()) * 20.0 - 5.0;
            let tile: Vec<_> = (0..count).map(point).collect();
            cpu::cut(&tree, &cpu::Tile::new(&tile), &mut lights);
            // The cut does not say which node a light is: walk again, by recursion.
            let mut nodes = Vec::new();
            for map in 0..maps as usize {
                walk(&mut nodes, &Walk { tree: &tree, links: &links, map, tile: &tile }, 0);
            }
            let used: Vec<_> = nodes.iter().filter(|(m, k)| patches[*m].at(*k).weight() > 0.0).collect();
            prop_assert_eq!(lights.len(), used.len());
            for (light, (m, k)) in lights.iter().zip(&used) {
                prop_assert_eq!(light.flux, patches[*m].at(*k).flux);
            }
            let used = used.into_iter().copied();
            check_cut(&rsm, coverage(&layout, maps as usize, used), sum(lights.iter().map(|v| v.flux)))?;
        }
    }
}

struct Walk<'a> {
    tree: &'a [Branch],
    links: &'a Links,
    map: usize,
    tile: &'a [Vec3],
}

/// The cut by recursion over children, without links.
fn walk(nodes: &mut Vec<(usize, usize)>, w: &Walk<'_>, k: usize) {
    let branch = &w.tree[w.map * w.links.order.len() + k];
    let node = w.links.order[k];
    let near = |p: &Vec3| {
        let v = branch.position - *p;
        v.x * v.x + v.y * v.y + v.z * v.z < branch.reach * branch.reach
    };
    if !(branch.reach > 0.0 && w.tile.iter().any(near)) {
        nodes.push((w.map, node as usize));
        return;
    }
    let (level, x, y) = place(&w.links.layout, node);
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let l = w.links.layout.levels[level - 1];
        let (cx, cy) = (2 * x + dx, 2 * y + dy);
        if cx < l.size[0] && cy < l.size[1] {
            let child = l.offset + cy * l.size[0] + cx;
            walk(nodes, w, w.links.order.iter().position(|n| *n == child).unwrap());
        }
    }
}

/// Every texel that reflects once, none twice, and the flux of all of them.
fn check_cut(rsm: &rsm::Rsm, count: Vec<u32>, flux: glam::DVec3) -> Result<(), TestCaseError> {
    let texels = rsm.maps.iter().flat_map(|m| &m.texels);
    for (i, (t, c)) in texels.zip(count).enumerate() {
        if t.reflected.element_sum() > 0.0 {
            prop_assert_eq!(c, 1, "texel {}", i);
        } else {
            prop_assert!(c <= 1, "texel {}", i);
        }
    }
    let expected = rsm.reflected();
    prop_assert!((flux - expected).abs().max_element() <= 1e-5 * expected.max_element());
    Ok(())
}
