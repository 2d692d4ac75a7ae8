use core::ops::Range;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use imperfect_shadow_maps::Point;
use imperfect_shadow_maps::gpu::Atlas;
use indirect_core::settings::Settings as _;
use indirect_gpu::wgpu::{Buffer, Device, Queue};
use indirect_gpu::{GpuError, Named, Plan, Vec3Pad, ViewUniform, buffers, uniform_buffer};
use indirect_technique::gpu::{GpuTechnique, Inputs};
use rsm::gpu::{CHUNK, Maps, Traversal, VplList, VplSlots};
use rsm::{Branch, Error, Form, PyramidLayout, TILE, Vpl};

use crate::layout::{Block, Patch};
use crate::levels::{Links, Pyramids, RECEIVER_CELLS, level_of_cells, z_order};
use crate::output::{ImageSpaceRadiosity, Setup};
use crate::settings::{Lights, Method, Options, Params};

/// Nodes that one thread of `compact` treats, as `compact.wgsl` declares it.
const RUN: u64 = 64;

/// What a storage binding may hold on any device, bytes.
const PART: u64 = 128 << 20;

/// Byte of [`FrameBuffers::totals`] at which the arguments of the traversal, of the splat and of the gather lie.
pub(super) const TRAVERSE_ARGUMENTS: u64 = 16;
pub(super) const SPLAT_ARGUMENTS: u64 = 32;
pub(super) const GATHER_ARGUMENTS: u64 = 48;

indirect_core::wgsl_struct! {
    /// A level of a pyramid and the finer one below it.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    pub(crate) struct LevelPair = "LevelPair" {
        fine_offset: u32,
        fine_width: u32,
        fine_height: u32,
        level: u32,
        coarse_offset: u32,
        coarse_width: u32,
        coarse_height: u32,
        first: u32,
        image_width: u32,
        image_height: u32,
        pad0: u32,
        pad1: u32,
    }
}

impl LevelPair {
    /// Level 0 has no finer one.
    fn new(layout: &PyramidLayout, level: usize) -> Self {
        let (image, coarse) = (layout.levels[0], layout.levels[level]);
        let fine = layout.levels[level.saturating_sub(1)];
        Self {
            fine_offset: fine.offset,
            fine_width: fine.size[0],
            fine_height: fine.size[1],
            level: level as u32,
            coarse_offset: coarse.offset,
            coarse_width: coarse.size[0],
            coarse_height: coarse.size[1],
            first: image.len() as u32,
            image_width: image.size[0],
            image_height: image.size[1],
            pad0: 0,
            pad1: 0,
        }
    }
}

indirect_core::wgsl_struct! {
    /// All levels of a pyramid.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    pub(crate) struct LevelTable = "LevelTable" {
        levels: [[u32; 4]; 16],
        count: u32,
        coarsest: u32,
        finest: u32,
        nodes: u32,
    }
}

impl LevelTable {
    fn new(layout: &PyramidLayout, [coarsest, finest]: [usize; 2], nodes: u64) -> Self {
        let (count, coarsest, finest) = (layout.levels.len() as u32, coarsest as u32, finest as u32);
        let mut table = Self { levels: [[0; 4]; 16], count, coarsest, finest, nodes: nodes as u32 };
        // A side of 2¹⁵ texels, more than any device has, makes 16 levels.
        for (entry, l) in table.levels.iter_mut().zip(&layout.levels) {
            *entry = [l.offset, l.size[0], l.size[1], 0];
        }
        table
    }
}

indirect_core::wgsl_struct! {
    /// One map.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    pub(crate) struct MapIndex = "MapIndex" {
        map: u32,
        in_part: u32,
        pad0: u32,
        pad1: u32,
    }
}

indirect_core::wgsl_struct! {
    /// Maps whose patches and branches share buffers.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    pub(crate) struct PartRange = "Part" {
        first_map: u32,
        maps: u32,
        first: u32,
        end: u32,
    }
}

indirect_core::wgsl_struct! {
    /// What may change from frame to frame.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    pub(crate) struct Settings = "Settings" {
        depth: f32,
        versine: f32,
        margin: f32,
        bend: f32,
        patch_depth: f32,
        patch_versine: f32,
        tau: f32,
        bound: u32,
        area_scale: f32,
        cutoff: f32,
        seed: u32,
        shadow_level: u32,
    }
}

/// A level that no map has, within the table: drivers may read ahead what a branch does not.
const NO_LEVEL: u32 = 15;

/// The bound that asks for the same cut for all, as `tree.wgsl` declares it.
const FLAT: u32 = 2;

impl Settings {
    fn new(options: &Options, params: &Params, shadow: usize) -> Self {
        let (blocks, patches) = (params.blocks(), params.patches());
        Self {
            depth: blocks.depth,
            versine: blocks.versine,
            margin: params.margin,
            bend: params.bend,
            patch_depth: patches.depth,
            patch_versine: patches.versine,
            tau: params.tau,
            bound: if options.lights == Lights::Basic { FLAT } else { params.bound as u32 },
            area_scale: params.form.area_scale(),
            cutoff: params.cutoff,
            seed: params.seed,
            shadow_level: if options.has_shadows() { shadow as u32 } else { NO_LEVEL },
        }
    }
}

indirect_core::wgsl_struct! {
    /// Lengths of lists and of the image.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    pub(crate) struct Lengths = "Lengths" {
        pixels: u32,
        nodes: u32,
        entries: u32,
        runs: u32,
        chunks: u32,
        first_receiver: u32,
        receivers: u32,
        branches: u32,
        coarse_branches: u32,
        patches: u32,
        splats: [u32; 2],
    }
}

/// What the lengths of buffers follow from.
#[derive(Debug, Clone)]
pub struct Sizes {
    pub(super) pyramids: Pyramids,
    pub(super) options: Options,
    pub(super) size: [u32; 2],
    maps: usize,
    points: u32,
}

impl Sizes {
    pub(crate) fn pixels(&self) -> u64 {
        self.pyramids.pixels.levels[0].len() as u64
    }

    /// Nodes that have a state.
    pub(super) fn nodes(&self) -> u64 {
        self.pyramids.nodes() as u64
    }

    /// Nodes of the whole pyramid over the pixels.
    fn entries(&self) -> u64 {
        self.pyramids.pixels.len() as u64
    }

    pub(super) fn runs(&self) -> u64 {
        self.entries().div_ceil(RUN)
    }

    /// Nodes of the pyramid over the texels of a map.
    pub(super) fn map_nodes(&self) -> u64 {
        self.pyramids.texels.len() as u64
    }

    pub(super) fn texels(&self) -> u64 {
        self.pyramids.texels.levels[0].len() as u64
    }

    /// Patches of each map, which are no texels.
    pub(super) fn patches(&self) -> u64 {
        self.map_nodes() - self.texels()
    }

    /// Maps that have patches.
    fn patch_maps(&self) -> usize {
        if self.options.has_patches() { self.maps } else { 0 }
    }

    /// Patches of the coarsest lights.
    fn sources(&self) -> u64 {
        let level = self.pyramids.texels.levels[self.pyramids.source_level()];
        self.patch_maps() as u64 * level.len() as u64
    }

    /// Branches of each map.
    pub(super) fn branches(&self) -> u64 {
        if !self.options.has_tree() || self.options.lights == Lights::Flat {
            return 0;
        }
        self.pyramids.texels.levels[self.pyramids.range[1]..].iter().map(|l| l.len() as u64).sum()
    }

    /// Those of them that are no texels.
    pub(super) fn coarse_branches(&self) -> u64 {
        let texels = if self.pyramids.range[1] == 0 { self.texels() } else { 0 };
        self.branches().saturating_sub(texels)
    }

    /// Maps whose branches a storage binding of any device holds, at least one.
    fn maps_per_part(&self) -> usize {
        (PART / (self.map_nodes() * size_of::<Branch>() as u64)).max(1) as usize
    }

    /// The maps of each part.
    fn parts(&self) -> impl Iterator<Item = Range<usize>> {
        let (per_part, all) = (self.maps_per_part(), self.patch_maps());
        (0..all).step_by(per_part).map(move |first| first..(first + per_part).min(all))
    }

    fn part(&self, maps: &Range<usize>) -> PartSizes {
        let maps = maps.len() as u64;
        PartSizes { patches: maps * self.patches(), branches: maps * self.branches() }
    }

    /// Slots of lights that are a list.
    fn light_slots(&self) -> u64 {
        match self.options.lights {
            Lights::Hierarchical => 0,
            Lights::Basic if !self.options.has_clusters() => 0,
            Lights::Basic => self.maps as u64 * self.map_nodes(),
            Lights::Flat => self.options.selection().slot_count(self.maps, self.options.resolution) as u64,
        }
    }

    /// Branches of a list of lights, each of which has a shadow map.
    pub(super) fn list_branches(&self) -> u64 {
        if self.options.has_tree() { self.light_slots() } else { 0 }
    }

    /// Patches of each map that have shadow maps.
    pub(super) fn shadow_cells(&self) -> u64 {
        self.pyramids.texels.levels[self.pyramids.shadow].len() as u64
    }

    /// Those of all maps.
    fn shadow_lights(&self) -> u64 {
        let has = self.options.has_shadows() && self.options.lights != Lights::Flat;
        if has { self.maps as u64 * self.shadow_cells() } else { 0 }
    }

    /// Shadow maps.
    fn tiles(&self) -> u32 {
        u32::try_from(self.shadow_lights() + self.list_branches()).unwrap_or(u32::MAX)
    }

    /// Dispatches of the gather.
    pub(super) fn chunks(&self) -> u64 {
        self.light_slots().div_ceil(CHUNK.into()).max(1)
    }

    /// Width and height of the target of splats; zeros without.
    pub(super) fn splats(&self) -> [u32; 2] {
        match self.options.method {
            Method::Gather => [0, 0],
            Method::BoundedSplat => self.size,
            Method::Splat => {
                // As square as the list of fragments allows.
                let width = (self.pixels() as f64).sqrt().ceil() as u32;
                [width, self.pixels().div_ceil(width.max(1).into()) as u32]
            }
        }
    }
}

buffers! {
    /// Buffers of a frame, beside those of maps and lists.
    pub struct FrameBuffers for Sizes {
        /// The coarsest lights of all maps.
        sources: [Patch] = Sizes::sources;
        /// The reference irradiance, W/m².
        reference: [f32] = |_| 1;
        /// The clusters, one slot per patch of each map.
        cluster_slots: [Vpl] = |s| if s.options.lights == Lights::Basic { s.light_slots() } else { 0 };
        /// Where the shadow maps of patches stand.
        shadow_vpls: [Vpl] = Sizes::shadow_lights;
        /// How many.
        shadow_count: [u32] = |s| u64::from(s.options.has_shadows());
        /// Branches of a list of lights.
        list_branches: [Branch] = Sizes::list_branches;
        /// Node, next branch and first child of each branch of a map.
        links: [[u32; 4]] = Sizes::branches;
        /// Blocks of the camera's pixels, level 1 first.
        blocks: [Block] = |s| s.entries() - s.pixels();
        /// 1 per block that needs subdivision, level 1 first.
        needs: [u32] = |s| s.nodes() - s.pixels();
        /// The [`state`](crate::layout::state) of each node, the pixels first.
        states: [u32] = Sizes::nodes;
        /// Nodes in Z order.
        order: [u32] = Sizes::entries;
        /// Fragments before each run of the order.
        runs: [u32] = Sizes::runs;
        /// The fragment of each valid node; for any other node what a frame before has left.
        slots: [u32] = Sizes::nodes;
        /// The node of each fragment.
        fragment_nodes: [u32] = Sizes::pixels;
        /// World position of each fragment.
        fragment_positions: [Vec3Pad] = Sizes::pixels;
        /// Unit normal of each fragment.
        fragment_normals: [Vec3Pad] = Sizes::pixels;
        /// Number of fragments, then arguments of indirect calls.
        totals: [u32] + INDIRECT = |s| GATHER_ARGUMENTS / 4 + 3 * s.chunks();
        /// Irradiance on each fragment, W/m².
        gathered: [Vec3Pad] = Sizes::pixels;
        /// Lights in the cut of each tile of fragments.
        cuts: [u32] = |s| s.pixels().div_ceil(TILE as u64);
        /// Irradiance of the pixels, W/m².
        irradiance: [Vec3Pad] = Sizes::pixels;
        /// Irradiance of the blocks, W/m², level 1 first.
        coarse_irradiance: [Vec3Pad] = |s| s.nodes() - s.pixels();
        /// Indirect radiance that leaves each pixel, W/(sr·m²), and 0.
        image: [Vec3Pad] = Sizes::pixels;
        /// The pyramid over the pixels.
        block_table: LevelTable;
        /// That over the texels of a map.
        patch_table: LevelTable;
        /// Lengths of lists and of the image.
        lengths: Lengths;
        /// What may change from frame to frame.
        settings: Settings;
        /// The camera's view.
        camera_view: ViewUniform;
    }
}

/// What the lengths of [`PartBuffers`] follow from.
#[derive(Debug, Clone, Copy)]
pub struct PartSizes {
    patches: u64,
    branches: u64,
}

buffers! {
    /// Buffers of the maps of a part, one map after the other.
    pub struct PartBuffers for PartSizes {
        /// Patches, level 1 first.
        patches: [Patch] = |s| s.patches;
        /// Branches of the tree.
        branches: [Branch] = |s| s.branches;
        /// Which.
        part: PartRange;
        /// How they are walked.
        traversal: Traversal;
    }
}

/// As many maps as a storage binding of any device holds the branches of.
#[derive(Debug)]
pub struct Part {
    /// Its maps.
    pub maps: Range<usize>,
    /// The buffers.
    pub buffers: PartBuffers,
    /// Its first branch among all, and the one past its end.
    branches: Range<u32>,
}

/// All buffers.
#[derive(Debug)]
pub struct Buffers {
    /// The maps.
    pub rsm: Maps,
    /// Patches and branches.
    pub parts: Vec<Part>,
    /// A uniform for each map.
    pub(super) map_indices: Vec<Buffer>,
    /// The VPLs of [`Lights::Flat`].
    pub vpls: Option<VplSlots>,
    /// Lights with flux.
    pub list: VplList,
    /// Points of the scene and shadow maps.
    pub atlas: Option<Atlas>,
    /// How the branches of a list of lights are walked, where it has shadow maps.
    list_traversal: Option<Buffer>,
    points: Arc<Vec<Point>>,
    options: Options,
    shadow: usize,
    /// All else.
    pub own: FrameBuffers,
    /// A uniform for each level of the pyramids over the pixels and over the texels of a map.
    pub(super) block_levels: Vec<Buffer>,
    pub(super) patch_levels: Vec<Buffer>,
    size: [u32; 2],
}

impl Buffers {
    /// One light or none per slot, for lights that are a list.
    #[must_use]
    pub fn light_slots(&self) -> &Buffer {
        self.vpls.as_ref().map_or(&self.own.cluster_slots, |vpls| &vpls.buffers.slots)
    }

    /// How the branches of a list of lights are walked, where it has shadow maps.
    pub(crate) fn list_traversal(&self) -> Option<&Buffer> {
        self.list_traversal.as_ref()
    }

    /// The virtual point lights from which shadow maps look, and their number.
    pub(super) fn shadow_list(&self) -> [&Buffer; 2] {
        let list = &self.list.buffers;
        let of_patches = [&self.own.shadow_vpls, &self.own.shadow_count];
        if self.list_traversal.is_some() { [&list.vpls, &list.count] } else { of_patches }
    }

    /// All buffers, those of `old` that do not depend on the size of the image among them.
    fn make(
        device: &Device,
        queue: &Queue,
        s: &Sizes,
        setup: &Setup,
        old: Option<(&Self, &Sizes)>,
    ) -> Result<Self, GpuError> {
        let kept = old.map(|(old, _)| old);
        let Options { resolution, lights, .. } = s.options;
        let write = |buffer: &Buffer, at: u64, bytes: &[u8]| queue.write_buffer(buffer, at, bytes);
        let levels = |layout: &PyramidLayout| -> Vec<Buffer> {
            let pair = |level| uniform_buffer(device, "level", &LevelPair::new(layout, level));
            (0..layout.levels.len()).map(pair).collect()
        };
        let part = |maps: Range<usize>| {
            let buffers = PartBuffers::new(device, &s.part(&maps))?;
            let [first, end] = [maps.start, maps.end].map(|map| map as u32 * s.branches() as u32);
            let part = PartRange { first_map: maps.start as u32, maps: maps.len() as u32, first, end };
            write(&buffers.part, 0, bytemuck::bytes_of(&part));
            Ok(Part { maps, buffers, branches: first..end })
        };
        let map_index = |map: usize| {
            let in_part = (map % s.maps_per_part()) as u32;
            uniform_buffer(device, "map_index", &MapIndex { map: map as u32, in_part, pad0: 0, pad1: 0 })
        };
        let buffers = Self {
            rsm: match kept {
                Some(old) => old.rsm.clone(),
                None => Maps::with(device, resolution, s.maps, s.options.has_pyramids())?,
            },
            map_indices: (0..s.patch_maps()).map(map_index).collect(),
            parts: s.parts().map(part).collect::<Result<_, GpuError>>()?,
            vpls: match kept {
                Some(old) => old.vpls.clone(),
                None => (lights == Lights::Flat)
                    .then(|| VplSlots::new(device, s.options.selection(), resolution, s.maps))
                    .transpose()?,
            },
            list: VplList::new(device, s.light_slots() as u32)?,
            atlas: match kept {
                Some(old) => old.atlas.clone(),
                None => (s.options.has_shadows())
                    .then(|| Atlas::new(device, &s.options.shadow_maps(), s.points, s.tiles()))
                    .transpose()?,
            },
            list_traversal: (s.options.has_shadows() && lights == Lights::Flat)
                .then(|| uniform_buffer(device, "traversal", &Traversal::new(0..0, Form::Disc))),
            points: Arc::clone(&setup.fitted.points),
            options: s.options,
            shadow: s.pyramids.shadow,
            own: match old {
                Some((old, probe)) => old.own.resized(device, s, probe)?,
                None => FrameBuffers::new(device, s)?,
            },
            block_levels: levels(&s.pyramids.pixels),
            patch_levels: levels(&s.pyramids.texels),
            size: s.size,
        };

        let own = &buffers.own;
        let Pyramids { pixels, block, texels, range, .. } = &s.pyramids;
        let table = LevelTable::new(pixels, [*block, 0], s.nodes());
        write(&own.block_table, 0, bytemuck::bytes_of(&table));
        let table = LevelTable::new(texels, *range, s.map_nodes());
        write(&own.patch_table, 0, bytemuck::bytes_of(&table));
        let receivers = pixels.levels[level_of_cells(pixels, RECEIVER_CELLS)];
        let lengths = Lengths {
            pixels: s.pixels() as u32,
            nodes: s.nodes() as u32,
            entries: s.entries() as u32,
            runs: s.runs() as u32,
            chunks: s.chunks() as u32,
            first_receiver: receivers.offset,
            receivers: receivers.len() as u32,
            branches: s.branches() as u32,
            coarse_branches: s.coarse_branches() as u32,
            patches: s.patches() as u32,
            splats: s.splats(),
        };
        write(&own.lengths, 0, bytemuck::bytes_of(&lengths));
        write(&own.order, 0, bytemuck::cast_slice(&z_order(pixels)));
        if let Some(atlas) = &buffers.atlas {
            atlas.prepare(queue, &s.options.shadow_maps());
            atlas.write(queue, &buffers.points);
            write(&own.shadow_count, 0, bytemuck::bytes_of(&(s.shadow_lights() as u32)));
        }
        if s.branches() > 0 {
            let l = Links::new(texels, range[1]);
            let links = (0..l.order.len()).map(|i| [l.order[i], l.next[i], l.child[i], 0]);
            write(&own.links, 0, bytemuck::cast_slice(&links.collect::<Vec<_>>()));
        }
        if s.options.method == Method::BoundedSplat {
            // Six vertices per light; the pass copies the number of lights.
            write(&own.totals, SPLAT_ARGUMENTS, bytemuck::bytes_of(&[6_u32, 0, 0, 0]));
        }
        Ok(buffers)
    }

    /// The virtual point lights from which shadow maps look.
    pub(crate) fn shadow_lights(&self) -> &Buffer {
        self.shadow_list()[0]
    }
}

impl GpuTechnique for ImageSpaceRadiosity {
    type Maps = Maps;

    fn sizes(setup: &Setup, size: [u32; 2], maps: usize) -> Sizes {
        let points = setup.fitted.points.len() as u32;
        Sizes { pyramids: Pyramids::new(&setup.options, size), options: setup.options, size, maps, points }
    }

    fn plan(s: &Sizes) -> Plan {
        let Options { resolution, lights, .. } = s.options;
        let mut plan = Maps::plan_with(resolution, s.maps, s.options.has_pyramids());
        for maps in s.parts() {
            plan = plan.and(PartBuffers::plan(&s.part(&maps)));
        }
        (0..s.patch_maps()).for_each(|_| plan.uniform::<MapIndex>("map_index"));
        if lights == Lights::Flat {
            plan = plan.and(VplSlots::plan(s.options.selection(), resolution, s.maps));
        }
        if s.options.has_shadows() {
            plan = plan.and(Atlas::plan(&s.options.shadow_maps(), s.points, s.tiles()));
            if lights == Lights::Flat {
                plan.uniform::<Traversal>("traversal");
            }
        }
        plan = plan.and(VplList::plan(s.light_slots())).and(FrameBuffers::plan(s));
        for _ in s.pyramids.pixels.levels.iter().chain(&s.pyramids.texels.levels) {
            plan.uniform::<LevelPair>("level");
        }
        plan.index("nodes", s.entries());
        plan.index("branches", s.maps as u64 * s.branches());
        if s.options.method != Method::Gather {
            plan.texture("splats", s.splats(), 16);
        }
        plan
    }

    fn allocate(device: &Device, queue: &Queue, s: &Sizes, setup: &Setup) -> Result<Buffers, GpuError> {
        Buffers::make(device, queue, s, setup, None)
    }

    fn resize(
        old: &Buffers,
        device: &Device,
        queue: &Queue,
        [sizes, probe]: [&Sizes; 2],
        setup: &Setup,
    ) -> Result<Buffers, GpuError> {
        Buffers::make(device, queue, sizes, setup, Some((old, probe)))
    }

    fn maps(buffers: &Buffers) -> &Maps {
        &buffers.rsm
    }

    fn named(buffers: &Buffers) -> Vec<Named<'_>> {
        let mut named = buffers.list.buffers.named();
        named.extend(buffers.own.named());
        named.extend(buffers.atlas.iter().flat_map(|atlas| atlas.buffers.named()));
        named
    }

    fn prepare(b: &mut Buffers, queue: &Queue, inputs: &Inputs<'_>, setup: &Setup) -> Result<(), Error> {
        let params = &setup.params;
        params.validate()?;
        b.rsm.prepare(queue, inputs.lights, inputs.views)?;
        if let Some(vpls) = &b.vpls {
            vpls.prepare(queue, params.seed);
        }
        b.list.prepare(queue, b.size[0] * b.size[1], params.form);
        for part in &b.parts {
            let traversal = Traversal::new(part.branches.clone(), params.form);
            queue.write_buffer(&part.buffers.traversal, 0, bytemuck::bytes_of(&traversal));
        }
        if let Some(uniform) = &b.list_traversal {
            let traversal = Traversal::new(0..b.list.capacity(), params.form);
            queue.write_buffer(uniform, 0, bytemuck::bytes_of(&traversal));
        }
        if let Some(atlas) = b.atlas.as_ref().filter(|_| !Arc::ptr_eq(&b.points, &setup.fitted.points)) {
            atlas.write(queue, &setup.fitted.points);
            b.points = Arc::clone(&setup.fitted.points);
        }
        let settings = Settings::new(&b.options, params, b.shadow);
        queue.write_buffer(&b.own.settings, 0, bytemuck::bytes_of(&settings));
        let view = ViewUniform::new(inputs.camera, b.size, 0);
        queue.write_buffer(&b.own.camera_view, 0, bytemuck::bytes_of(&view));
        Ok(())
    }

    fn image_buffer(buffers: &Buffers) -> &Buffer {
        &buffers.own.image
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Visibility;
    use crate::layout::state;
    use indirect_gpu::shaders::{
        IMAGE_SPACE_RADIOSITY_COMPACT, IMAGE_SPACE_RADIOSITY_MIPS, IMAGE_SPACE_RADIOSITY_REFINE,
        IMAGE_SPACE_RADIOSITY_SHADOWS, IMAGE_SPACE_RADIOSITY_TREE,
    };
    use testkit::layout::{check, check_constant};

    #[test]
    fn structs_lie_in_memory_as_in_wgsl() {
        check::<Settings>(&IMAGE_SPACE_RADIOSITY_SHADOWS).unwrap();
        check::<Block>(&IMAGE_SPACE_RADIOSITY_MIPS).unwrap();
        check::<LevelPair>(&IMAGE_SPACE_RADIOSITY_MIPS).unwrap();
        check::<LevelTable>(&IMAGE_SPACE_RADIOSITY_REFINE).unwrap();
        check::<Settings>(&IMAGE_SPACE_RADIOSITY_REFINE).unwrap();
        check::<Lengths>(&IMAGE_SPACE_RADIOSITY_REFINE).unwrap();
        check::<Patch>(&IMAGE_SPACE_RADIOSITY_TREE).unwrap();
        check::<Branch>(&IMAGE_SPACE_RADIOSITY_TREE).unwrap();
        check::<MapIndex>(&IMAGE_SPACE_RADIOSITY_TREE).unwrap();
        check::<PartRange>(&IMAGE_SPACE_RADIOSITY_TREE).unwrap();
    }

    #[test]
    fn constants_are_those_of_the_shaders() {
        check_constant(&IMAGE_SPACE_RADIOSITY_COMPACT, "RUN", RUN as u32).unwrap();
        check_constant(&IMAGE_SPACE_RADIOSITY_COMPACT, "CHUNK", CHUNK).unwrap();
        check_constant(&IMAGE_SPACE_RADIOSITY_TREE, "FLAT", FLAT).unwrap();
        let states = [
            ("EMPTY", state::EMPTY),
            ("COVERED", state::COVERED),
            ("VALID", state::VALID),
            ("SPLIT", state::SPLIT),
        ];
        for (name, value) in states {
            check_constant(&IMAGE_SPACE_RADIOSITY_REFINE, name, value).unwrap();
        }
    }

    #[test]
    fn default_limits_suffice_for_4k_and_for_twelve_maps_of_512() {
        for (size, resolution, maps) in
            [([3840, 2160], 256, 6), ([1920, 1200], 256, 24), ([1920, 1080], 512, 12)]
        {
            for visibility in [Visibility::Off, Visibility::Maps] {
                let options = Options { resolution, visibility, ..Options::default() };
                let setup = Setup { options, ..Setup::default() };
                let plan = ImageSpaceRadiosity::plan(&ImageSpaceRadiosity::sizes(&setup, size, maps));
                plan.check(&indirect_gpu::wgpu::Limits::default()).unwrap();
            }
        }
    }

    #[test]
    fn parts_hold_every_map_once_within_a_binding() {
        for (resolution, maps, parts) in [(256, 24, 1), (512, 12, 2), (1024, 2, 2), (16, 0, 0)] {
            let options = Options { resolution, ..Options::default() };
            let s = ImageSpaceRadiosity::sizes(&Setup { options, ..Setup::default() }, [1, 1], maps);
            assert!(s.parts().flatten().eq(0..maps));
            assert_eq!(s.parts().count(), parts);
            for part in s.parts() {
                let plan = PartBuffers::plan(&s.part(&part));
                plan.check(&indirect_gpu::wgpu::Limits::default()).unwrap();
            }
        }
    }
}
