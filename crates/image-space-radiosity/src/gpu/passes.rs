#[cfg(feature = "cpu")]
use glam::Vec3;
#[cfg(feature = "cpu")]
use indirect_gpu::Vec3Pad;
use indirect_gpu::shaders::{
    FILTER_SHADE, IMAGE_SPACE_RADIOSITY_CLUSTERS as CLUSTERS, IMAGE_SPACE_RADIOSITY_COMPACT as COMPACT,
    IMAGE_SPACE_RADIOSITY_MIPS as MIPS, IMAGE_SPACE_RADIOSITY_PATCHES as PATCHES,
    IMAGE_SPACE_RADIOSITY_REFINE as REFINE, IMAGE_SPACE_RADIOSITY_SHADOWS as SHADOWS,
    IMAGE_SPACE_RADIOSITY_TRAVERSE as TRAVERSE_MAPS, IMAGE_SPACE_RADIOSITY_TREE as TREE,
    IMAGE_SPACE_RADIOSITY_UPSAMPLE as UPSAMPLE, RSM_TRAVERSE as TRAVERSE,
};
use indirect_gpu::{GpuError, Named, Pass, named};

use super::buffers::{GATHER_ARGUMENTS, Part, TRAVERSE_ARGUMENTS};
use crate::output::ImageSpaceRadiosity;

pub(super) type Build<'a> = indirect_technique::gpu::Build<'a, ImageSpaceRadiosity>;

/// Each map with what kernels bind that look at its texels: them, and the part that holds its patches.
fn maps<'a>(b: &Build<'a>) -> impl Iterator<Item = Vec<Named<'a>>> {
    let of_part = |part: &'a Part| part.maps.clone().map(move |map| (part, map));
    let buffers = b.buffers;
    buffers.parts.iter().flat_map(of_part).map(|(part, map)| {
        let mut own = buffers.rsm.maps[map].named();
        own.extend(part.buffers.named());
        own.push(named("map_index", &buffers.map_indices[map]));
        own
    })
}

pub(crate) fn patches(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    let (levels, source) = (&b.sizes.pyramids.texels.levels, b.sizes.pyramids.source_level());
    let pair = |level: usize| named("pair", &b.buffers.patch_levels[level]);
    let of_map = |pass: &mut Pass, entry, level: usize| {
        maps(b).try_for_each(|mut own| {
            own.push(pair(level));
            b.compute(pass, (&PATCHES, entry), levels[level].len() as u64, &own)
        })
    };
    let of_part = |pass: &mut Pass, entry, level: usize| {
        b.buffers.parts.iter().try_for_each(|part| {
            let own = [&part.buffers.named()[..], &[pair(level)]].concat();
            b.compute(pass, (&PATCHES, entry), (part.maps.len() * levels[level].len()) as u64, &own)
        })
    };
    if levels.len() > 1 {
        of_map(pass, "patches_texels", 1)?;
    }
    (2..levels.len()).try_for_each(|level| of_part(pass, "patches_parent", level))?;
    if source > 0 {
        of_part(pass, "patches_sources", source)
    } else {
        of_map(pass, "patches_source_texels", 0)
    }
}

pub(crate) fn mips(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    let levels = b.sizes.pyramids.pixels.levels.iter().zip(&b.buffers.block_levels).skip(1);
    levels.into_iter().try_for_each(|(l, pair)| {
        b.compute(pass, (&MIPS, "mips_parent"), l.len() as u64, &[named("pair", pair)])
    })
}

pub(crate) fn sources(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    b.compute(pass, (&REFINE, "reference_irradiance"), 1, &[])
}

pub(crate) fn vpls(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    let vpls = b.buffers.vpls.as_ref();
    vpls.map_or(Ok(()), |vpls| vpls.draw(b.pipelines, pass, &b.buffers.rsm))
}

pub(crate) fn clusters(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    maps(b).try_for_each(|mut own| {
        own.push(named("table", &b.buffers.own.patch_table));
        b.compute(pass, (&CLUSTERS, "clusters"), b.sizes.map_nodes(), &own)
    })
}

pub(crate) fn tree(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    if b.buffers.list_traversal().is_some() {
        let own = [named("branches", &b.buffers.own.list_branches)];
        return b.compute(pass, (&TREE, "tree_list"), b.sizes.list_branches(), &own);
    }
    let (branches, coarse) = (b.sizes.branches(), b.sizes.coarse_branches());
    for part in &b.buffers.parts {
        let mut own = part.buffers.named();
        own.push(named("table", &b.buffers.own.patch_table));
        b.compute(pass, (&TREE, "tree"), part.maps.len() as u64 * coarse, &own)?;
    }
    if branches > coarse {
        maps(b).try_for_each(|mut own| {
            own.push(named("table", &b.buffers.own.patch_table));
            b.compute(pass, (&TREE, "tree_texels"), branches - coarse, &own)
        })?;
    }
    Ok(())
}

pub(crate) fn shadows(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    let Some(atlas) = &b.buffers.atlas else { return Ok(()) };
    if b.buffers.list_traversal().is_none() {
        maps(b).try_for_each(|mut own| {
            own.push(named("table", &b.buffers.own.patch_table));
            b.compute(pass, (&SHADOWS, "shadow_lights"), b.sizes.shadow_cells(), &own)
        })?;
    }
    let [vpls, count] = b.buffers.shadow_list();
    let list = [named("vpls", vpls), named("count", count)];
    atlas.splat(b.pipelines, pass, &list)?;
    atlas.pull(b.pipelines, pass, &list)?;
    atlas.push(b.pipelines, pass, &list)
}

pub(crate) fn refine(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    let (nodes, table) = (b.sizes.nodes(), [named("table", &b.buffers.own.block_table)]);
    b.compute(pass, (&REFINE, "refine"), nodes - b.sizes.pixels(), &table)?;
    b.compute(pass, (&REFINE, "stencil"), nodes, &table)
}

pub(crate) fn compact(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    let (runs, totals) = (b.sizes.runs(), &b.buffers.own.totals);
    b.compute(pass, (&COMPACT, "compact_count"), runs, &[])?;
    b.compute(pass, (&COMPACT, "compact_scan"), 1, &[])?;
    b.compute(pass, (&COMPACT, "compact_write"), runs, &[])?;
    b.compute(pass, (&COMPACT, "compact_arguments"), b.sizes.chunks(), &[])?;
    let own = [named("fragment_count", totals)];
    b.compute_indirect(pass, (&COMPACT, "compact_points"), (totals, TRAVERSE_ARGUMENTS), &own)
}

pub(crate) fn gather(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    let own = &b.buffers.own;
    let fragments = [
        named("positions", &own.fragment_positions),
        named("normals", &own.fragment_normals),
        named("irradiance", &own.gathered),
    ];
    b.buffers.list.gather_indirect(b.pipelines, pass, (&own.totals, GATHER_ARGUMENTS), &fragments)
}

pub(crate) fn traverse(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    let own = &b.buffers.own;
    let fragments = [
        named("positions", &own.fragment_positions),
        named("normals", &own.fragment_normals),
        named("receiver_count", &own.totals),
        named("irradiance", &own.gathered),
    ];
    let arguments = (&own.totals, TRAVERSE_ARGUMENTS);
    let module = if b.buffers.atlas.is_some() { &TRAVERSE_MAPS } else { &TRAVERSE };
    let walk = |pass: &mut Pass, tree: &[Named<'_>]| {
        let shadows = [named("shadow_vpls", b.buffers.shadow_lights())];
        let names = [&fragments[..], &shadows, tree].concat();
        b.compute_indirect(pass, (module, "traverse"), arguments, &names)
    };
    if let Some(traversal) = b.buffers.list_traversal() {
        return walk(pass, &[named("branches", &own.list_branches), named("traversal", traversal)]);
    }
    b.buffers.parts.iter().try_for_each(|part| walk(pass, &part.buffers.named()))
}

/// Whether fragments have the same light but for rounding: where they do not, another texel of a shadow map was asked.
#[cfg(feature = "cpu")]
pub(crate) fn same_answers(cpu: &[Vec3], gpu: &[Vec3Pad]) -> Vec<bool> {
    /// Beyond this share two values are not the same one rounded twice.
    const SAME: f32 = 1e-4;
    let same = |(a, b): (&Vec3, &Vec3Pad)| (*a - b.vec3()).abs().max_element() <= SAME * a.max_element();
    cpu.iter().zip(gpu).map(same).collect()
}

pub(crate) fn pull(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    (0..=b.sizes.pyramids.block)
        .try_for_each(|level| upsample(b, pass, level, if level == 0 { "pull_pixels" } else { "pull" }))
}

pub(crate) fn push(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    // Level by level down to the pixels.
    (1..=b.sizes.pyramids.block)
        .rev()
        .try_for_each(|level| upsample(b, pass, level, if level == 1 { "push_pixels" } else { "push" }))
}

/// One thread for each node of a level.
fn upsample(b: &Build<'_>, pass: &mut Pass, level: usize, entry: &'static str) -> Result<(), GpuError> {
    let nodes = b.sizes.pyramids.pixels.levels[level].len() as u64;
    b.compute(pass, (&UPSAMPLE, entry), nodes, &[named("pair", &b.buffers.block_levels[level])])
}

pub(crate) fn shade(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    b.compute(pass, (&FILTER_SHADE, "shade"), b.sizes.pixels(), &[])
}
