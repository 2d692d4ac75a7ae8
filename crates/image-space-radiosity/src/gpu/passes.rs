use indirect_gpu::shaders::{
    FILTER_SHADE, IMAGE_SPACE_RADIOSITY_CLUSTERS as CLUSTERS, IMAGE_SPACE_RADIOSITY_COMPACT as COMPACT,
    IMAGE_SPACE_RADIOSITY_MIPS as MIPS, IMAGE_SPACE_RADIOSITY_PATCHES as PATCHES,
    IMAGE_SPACE_RADIOSITY_REFINE as REFINE, IMAGE_SPACE_RADIOSITY_TRAVERSE as TRAVERSE,
    IMAGE_SPACE_RADIOSITY_TREE as TREE, IMAGE_SPACE_RADIOSITY_UPSAMPLE as UPSAMPLE,
};
use indirect_gpu::{GpuError, Named, Pass, named};

use super::buffers::{GATHER_ARGUMENTS, TRAVERSE_ARGUMENTS};
use crate::output::ImageSpaceRadiosity;

pub(super) type Build<'a> = indirect_technique::gpu::Build<'a, ImageSpaceRadiosity>;

/// What kernels that look at a map bind: its texels and patches.
fn map_named<'a>(b: &Build<'a>, map: usize) -> Vec<Named<'a>> {
    let mut own = b.buffers.rsm.maps[map].named();
    own.extend(b.buffers.maps[map].named());
    own
}

pub(crate) fn patches(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    let (levels, texels) = (&b.buffers.patch_levels, &b.sizes.pyramids.texels);
    for map in 0..b.buffers.maps.len() {
        let own = map_named(b, map);
        let pair = |level: usize| [&own[..], &[named("pair", &levels[level])]].concat();
        for (level, l) in texels.levels.iter().enumerate().skip(1) {
            b.compute(pass, (&PATCHES, "patches_parent"), l.len() as u64, &pair(level))?;
        }
        b.compute(pass, (&PATCHES, "patches_sources"), 1, &pair(b.sizes.pyramids.source_level()))?;
    }
    Ok(())
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
    (0..b.buffers.maps.len()).try_for_each(|map| {
        let table = [named("table", &b.buffers.own.patch_table)];
        let own = [&map_named(b, map)[..], &table].concat();
        b.compute(pass, (&CLUSTERS, "clusters"), b.sizes.patches(), &own)
    })
}

pub(crate) fn tree(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    for map in 0..b.buffers.maps.len() {
        let Some(part) = b.buffers.part_of(map) else { continue };
        let mut own = map_named(b, map);
        own.extend([named("table", &b.buffers.own.patch_table), named("branches", &part.buffers.branches)]);
        let coarse = b.sizes.coarse_branches();
        b.compute(pass, (&TREE, "tree"), coarse, &own)?;
        b.compute(pass, (&TREE, "tree_texels"), b.sizes.branches() - coarse, &own)?;
    }
    Ok(())
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
    let arguments = (&b.buffers.own.totals, TRAVERSE_ARGUMENTS);
    b.buffers.parts.iter().try_for_each(|part| {
        b.compute_indirect(pass, (&TRAVERSE, "traverse"), arguments, &part.buffers.named())
    })
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
