use bytemuck::{Pod, Zeroable};
use indirect_core::{Light, View};
use indirect_gpu::wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindingResource, Buffer, BufferDescriptor, BufferUsages,
    Device, Extent3d, Queue, TextureDescriptor, TextureDimension, TextureUsages, TextureView,
    TextureViewDescriptor,
};
use indirect_gpu::{
    GBufferTarget, GpuError, Vec3Pad, ViewUniform, empty_storage_buffer, storage_buffer, uniform_buffer,
};
use rsm::views::MapView;
use rsm::{PyramidLayout, Vpl, gpu::GatherResources};

use super::{ImageSpaceRadiosity, RUN, splat_format};
use crate::{
    Bound, Error, Lights, Method, Params, TILE,
    layout::{Block, Branch, Patch},
    levels::{Links, RECEIVER_CELLS, SOURCE_CELLS, level_of_cells, z_order},
};

/// Byte of [`Resources::totals`] at which the arguments of the traversal, of the splat and of the gather lie.
pub(super) const TRAVERSE_ARGUMENTS: u64 = 16;
pub(super) const SPLAT_ARGUMENTS: u64 = 32;
pub(super) const GATHER_ARGUMENTS: u64 = 48;

/// As `layout.wgsl` declares it.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct LevelPair {
    pub(crate) fine_offset: u32,
    pub(crate) fine_width: u32,
    pub(crate) fine_height: u32,
    pub(crate) level: u32,
    pub(crate) coarse_offset: u32,
    pub(crate) coarse_width: u32,
    pub(crate) coarse_height: u32,
    pub(crate) first: u32,
    pub(crate) image_width: u32,
    pub(crate) image_height: u32,
    pub(crate) pad0: u32,
    pub(crate) pad1: u32,
}

/// As `layout.wgsl` declares it.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct MapIndex {
    pub(crate) map: u32,
    pub(crate) first_branch: u32,
    pub(crate) pad0: u32,
    pub(crate) pad1: u32,
}

/// As `levels.wgsl` declares it.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct LevelTable {
    pub(crate) levels: [[u32; 4]; 16],
    pub(crate) count: u32,
    pub(crate) coarsest: u32,
    pub(crate) finest: u32,
    pub(crate) nodes: u32,
}

/// As `refine.wgsl` declares it.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct RefineUniform {
    pub(crate) depth: f32,
    pub(crate) versine: f32,
    pub(crate) margin: f32,
    pub(crate) bend: f32,
}

/// As `sources.wgsl` declares it.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct SourcesUniform {
    pub(crate) first: u32,
    pub(crate) first_receiver: u32,
    pub(crate) receivers: u32,
    pub(crate) pad0: u32,
}

/// As `compact.wgsl` declares it.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct CompactUniform {
    pub(crate) entries: u32,
    pub(crate) runs: u32,
    pub(crate) nodes: u32,
    pub(crate) chunks: u32,
    pub(crate) first: u32,
    pub(crate) pad0: u32,
    pub(crate) pad1: u32,
    pub(crate) pad2: u32,
}

/// As `clusters.wgsl` declares it.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct ClustersUniform {
    pub(crate) depth: f32,
    pub(crate) versine: f32,
    pub(crate) pad0: f32,
    pub(crate) pad1: f32,
}

/// As `tree.wgsl` declares it.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct TreeUniform {
    pub(crate) bound: u32,
    pub(crate) per_map: u32,
    pub(crate) tau: f32,
    pub(crate) pad0: u32,
}

/// As `traverse.wgsl` declares it.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct TraverseUniform {
    pub(crate) first: u32,
    pub(crate) end: u32,
    pub(crate) area_scale: f32,
    pub(crate) pad0: u32,
}

/// As `splat.wgsl` declares it.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct SplatUniform {
    pub(crate) size: [u32; 2],
    pub(crate) area_scale: f32,
    pub(crate) cutoff: f32,
}

/// What only the splats need.
#[derive(Debug)]
pub(super) struct SplatResources {
    pub(super) target: TextureView,
    pub(super) group: BindGroup,
    pub(super) resolve_group: BindGroup,
    pub(super) texels: u32,
    pub(super) size: [u32; 2],
    bytes: u64,
}

/// What a storage binding may hold on any device, bytes.
const PART: u64 = 128 << 20;

/// A part of the tree: the branches of as many maps as a storage binding holds.
#[derive(Debug)]
pub(super) struct Part {
    /// `array<Branch>`.
    pub(super) branches: Buffer,
    /// First branch, and one past the last.
    pub(super) range: [u32; 2],
    uniform: Buffer,
    pub(super) group: BindGroup,
}

/// All buffers of a frame; every intermediate result can be read back.
#[derive(Debug)]
pub struct Resources {
    /// The maps.
    pub rsm: rsm::gpu::Resources,
    /// `array<Patch>`: the patches of each map, level 1 first.
    pub patches: Vec<Buffer>,
    /// `array<Patch>`: the coarsest of all maps.
    pub sources: Buffer,
    /// `array<f32, 1>`: the reference irradiance, W/m².
    pub reference: Buffer,
    pub(super) parts: Vec<Part>,
    /// `array<Vpl>`: the clusters, one slot per patch.
    pub clusters: Buffer,
    /// `array<Block>`: blocks of the camera's pixels, level 1 first.
    pub blocks: Buffer,
    /// `array<u32>`: 1 per block that needs subdivision, level 1 first.
    pub needs: Buffer,
    /// `array<u32>`: the [`state`](crate::layout::state) of each block.
    pub states: Buffer,
    /// `array<u32>`: the fragment of each valid block.
    pub slots: Buffer,
    /// `array<u32>`: the block of each fragment.
    pub fragment_nodes: Buffer,
    /// `array<vec4<f32>>`: world position of each fragment.
    pub positions: Buffer,
    /// `array<vec4<f32>>`: unit normal of each fragment.
    pub normals: Buffer,
    /// Number of fragments, then arguments of indirect calls.
    pub totals: Buffer,
    /// The list of lights, and the irradiance that they, or cuts, cast on fragments.
    pub gather: GatherResources,
    /// `array<u32>`: lights in the cut of each tile.
    pub cuts: Buffer,
    /// `array<vec4<f32>>`: irradiance of the pixels, W/m².
    pub irradiance: Buffer,
    /// `array<vec4<f32>>`: irradiance of the blocks, W/m², level 1 first.
    pub coarse_irradiance: Buffer,
    /// `array<vec4<f32>>`: indirect radiance that leaves each pixel of the camera, W/(sr·m²), and 0.
    pub image: Buffer,
    runs_buffer: Buffer,
    order: Buffer,
    light_order: Buffer,
    refine_uniform: Buffer,
    clusters_uniform: Buffer,
    tree_uniform: Buffer,
    splat_uniform: Buffer,
    view_uniform: Buffer,
    pub(super) splat: Option<SplatResources>,
    /// Nodes of each level of the camera's and of a map's pyramid.
    pub(super) levels: Vec<u64>,
    pub(super) light_levels: Vec<u64>,
    pub(super) coarsest: usize,
    pub(super) runs: u32,
    /// Of each map.
    pub(super) branches: u32,
    pub(super) mips_groups: Vec<BindGroup>,
    pub(super) refine_group: BindGroup,
    pub(super) stencil_group: BindGroup,
    pub(super) count_group: BindGroup,
    pub(super) scan_group: BindGroup,
    pub(super) write_group: BindGroup,
    pub(super) arguments_group: BindGroup,
    pub(super) points_group: BindGroup,
    pub(super) lights_group: BindGroup,
    /// Of each map, for its levels and for the coarsest of them.
    pub(super) patch_groups: Vec<(Vec<BindGroup>, BindGroup)>,
    pub(super) reference_group: BindGroup,
    pub(super) clusters_groups: Vec<BindGroup>,
    pub(super) tree_groups: Vec<BindGroup>,
    pub(super) pull_groups: Vec<BindGroup>,
    pub(super) push_groups: Vec<BindGroup>,
    pub(super) shade_group: BindGroup,
    size: [u32; 2],
}

impl Resources {
    /// Buffers for `maps` maps, as many as [`rsm::views::views`] returns, and the pixels of `camera`, whose buffers they refer to
    /// from now on.
    ///
    /// # Errors
    /// [`Error::Gpu`] where a buffer exceeds the device's limits.
    pub fn new(
        device: &Device,
        technique: &ImageSpaceRadiosity,
        maps: usize,
        camera: &GBufferTarget,
    ) -> Result<Self, Error> {
        let options = technique.options();
        let size = camera.size();
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let index = |what, needed: u64| {
            let (limit, available) = ("32-bit index", u64::from(u32::MAX));
            u32::try_from(needed).map_err(|_| GpuError::Limit { what, limit, needed, available })
        };
        // The maps' own gather is not used: a camera of one pixel keeps it small.
        let pixel = GBufferTarget::new(device, [1, 1], 1)?;
        let rsm = technique.rsm.resources(device, maps, &pixel)?;

        let layout = &PyramidLayout::new(size);
        let coarsest = (options.coarsest_block as usize).min(layout.levels.len() - 1);
        let nodes = u64::from(node_count(layout, coarsest));
        let entries = layout.len() as u32;
        let runs = entries.div_ceil(RUN);

        let map_size = [options.resolution; 2];
        let light_layout = PyramidLayout::new(map_size);
        let level = |cells| level_of_cells(&light_layout, cells);
        let (range, hierarchical, basic) = match options.lights {
            Lights::Flat(_) => ([0, 0], false, false),
            Lights::Basic { coarsest, finest } => ([level(coarsest), level(finest)], false, true),
            Lights::Hierarchical { coarsest, finest } => ([level(coarsest), level(finest)], true, false),
        };
        let links = Links::new(map_size, if hierarchical { range[1] } else { light_layout.levels.len() });
        let light_nodes = light_layout.len() as u64;
        let light_slots = index("the patches", if basic { maps as u64 * light_nodes } else { 0 })?;
        let branches = links.order.len() as u32;
        index("the tree", maps as u64 * u64::from(branches))?;
        let source_level = light_layout.levels[level_of_cells(&light_layout, SOURCE_CELLS)];
        let source_count = if options.has_patches() { maps as u64 * source_level.len() as u64 } else { 0 };

        let texels = light_layout.levels[0].len() as u64;
        let patch_maps = if options.has_patches() { maps } else { 0 };
        let patches = (0..patch_maps)
            .map(|_| empty_storage_buffer::<Patch>(device, "light patches", light_nodes - texels));
        let patches = patches.collect::<Result<Vec<_>, _>>()?;
        let sources = empty_storage_buffer::<Patch>(device, "light sources", source_count)?;
        let reference = empty_storage_buffer::<f32>(device, "reference irradiance", 1)?;
        let clusters = empty_storage_buffer::<Vpl>(device, "light clusters", u64::from(light_slots))?;
        let blocks = empty_storage_buffer::<Block>(device, "blocks", layout.len() as u64 - pixels)?;
        let needs = empty_storage_buffer::<u32>(device, "needs", nodes - pixels)?;
        let states = empty_storage_buffer::<u32>(device, "states", nodes)?;
        let slots = empty_storage_buffer::<u32>(device, "fragment slots", nodes)?;
        let fragment_nodes = empty_storage_buffer::<u32>(device, "fragment nodes", pixels)?;
        let positions = empty_storage_buffer::<Vec3Pad>(device, "fragment positions", pixels)?;
        let normals = empty_storage_buffer::<Vec3Pad>(device, "fragment normals", pixels)?;
        let cuts = empty_storage_buffer::<u32>(device, "cuts", pixels.div_ceil(TILE as u64))?;
        let irradiance = empty_storage_buffer::<Vec3Pad>(device, "irradiance of pixels", pixels)?;
        let coarse_irradiance =
            empty_storage_buffer::<Vec3Pad>(device, "irradiance of blocks", nodes - pixels)?;
        let image = empty_storage_buffer::<Vec3Pad>(device, "indirect light", pixels)?;
        let runs_buffer = empty_storage_buffer::<u32>(device, "runs", u64::from(runs))?;
        let order = storage_buffer(device, "block order", &z_order(layout))?;
        let entries_of_links =
            (0..links.order.len()).map(|i| [links.order[i], links.next[i], links.child[i], 0]);
        let light_order: Vec<[u32; 4]> = entries_of_links.collect();
        let light_order = storage_buffer(device, "patch links", &light_order)?;
        let (light_buffer, capacity) = match options.lights {
            Lights::Flat(selection) => {
                let count = selection.slot_count(maps, options.resolution);
                (&rsm.slots, index("the VPL slots", count as u64)?)
            }
            Lights::Basic { .. } => (&clusters, light_slots),
            Lights::Hierarchical { .. } => (&clusters, 0),
        };
        let receivers = index("the fragments", pixels)?;
        let gather =
            GatherResources::new(device, &technique.gather, capacity, &positions, &normals, receivers)?;
        let totals = device.create_buffer(&BufferDescriptor {
            label: Some("fragment totals"),
            size: GATHER_ARGUMENTS + 12 * u64::from(gather.chunks()),
            usage: BufferUsages::STORAGE
                | BufferUsages::INDIRECT
                | BufferUsages::COPY_SRC
                | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });

        let receiver_level = layout.levels[level_of_cells(layout, RECEIVER_CELLS)];
        let source_params = SourcesUniform {
            first: pixels as u32,
            first_receiver: receiver_level.offset,
            receivers: receiver_level.len() as u32,
            pad0: 0,
        };
        let source_params = uniform_buffer(device, "sources", &source_params);
        let refine_uniform = uniform_buffer(device, "refine", &RefineUniform::default());
        let clusters_uniform = uniform_buffer(device, "clusters", &ClustersUniform::default());
        let tree_uniform = uniform_buffer(device, "tree", &TreeUniform::default());
        let splat_uniform = uniform_buffer(device, "splat", &SplatUniform::default());
        let view_uniform = uniform_buffer(device, "splat view", &ViewUniform::zeroed());
        let compact_uniform = CompactUniform {
            entries,
            runs,
            nodes: nodes as u32,
            chunks: gather.chunks(),
            first: pixels as u32,
            ..CompactUniform::default()
        };
        let compact_uniform = uniform_buffer(device, "compact", &compact_uniform);
        let table = uniform_buffer(device, "block levels", &level_table(layout, [coarsest, 0], nodes as u32));
        let light_table = level_table(&light_layout, range, light_layout.len() as u32);
        let light_table = uniform_buffer(device, "patch levels", &light_table);
        let slot_uniform = uniform_buffer(device, "light slots", &[capacity, 0, 0, 0]);

        let pairs = |layout: &PyramidLayout| -> Vec<Buffer> {
            let pair = |level| uniform_buffer(device, "level", &level_pair(layout, level));
            (0..layout.levels.len()).map(pair).collect()
        };
        let bind = |kernel: &indirect_gpu::Kernel, resources: &[(u32, &Buffer)]| {
            let resources: Vec<_> = resources.iter().map(|(i, b)| (*i, b.as_entire_binding())).collect();
            kernel.bind(device, 0, &resources)
        };
        let pixel = [(10, &camera.position), (11, &camera.normal)];
        let block = [(12, &blocks)];
        let block_pairs = pairs(layout);
        let mips_groups = block_pairs[1..]
            .iter()
            .map(|p| bind(&technique.mips_parent, &[&pixel[..], &[(0, p), (1, &blocks)]].concat()))
            .collect();
        let levels = [(1, &states), (4, &irradiance), (5, &coarse_irradiance)];
        let pull_groups = block_pairs
            .iter()
            .map(|p| {
                let own = [(0, p), (2, &slots), (3, &gather.irradiance)];
                bind(&technique.pull, &[&pixel[..], &block, &levels, &own].concat())
            })
            .collect();
        let push_groups = block_pairs[1..]
            .iter()
            .map(|p| bind(&technique.push, &[&block[..], &levels, &[(0, p)]].concat()))
            .collect();
        // As many maps as a binding of any device holds.
        let per_part = (PART / (u64::from(branches) * size_of::<Branch>() as u64)).max(1);
        let tree_maps = if hierarchical { maps as u64 } else { 0 };
        let parts = (0..tree_maps)
            .step_by(per_part as usize)
            .map(|map| {
                let range = [map, (map + per_part).min(tree_maps)].map(|m| m as u32 * branches);
                let count = u64::from(range[1] - range[0]);
                let part = empty_storage_buffer::<Branch>(device, "light tree", count)?;
                let uniform = uniform_buffer(device, "traverse", &TraverseUniform::default());
                let group = bind(
                    &technique.traverse,
                    &[
                        (0, &uniform),
                        (1, &part),
                        (2, &positions),
                        (3, &normals),
                        (4, &totals),
                        (5, &gather.irradiance),
                        (6, &cuts),
                    ],
                );
                Ok(Part { branches: part, range, uniform, group })
            })
            .collect::<Result<Vec<_>, GpuError>>()?;
        let light_pairs = pairs(&light_layout);
        let indices: Vec<_> = (0..maps as u32)
            .map(|map| {
                let first_branch = parts.get((u64::from(map) / per_part) as usize).map_or(0, |p| p.range[0]);
                uniform_buffer(device, "map", &MapIndex { map, first_branch, pad0: 0, pad1: 0 })
            })
            .collect();
        let texel = |m: usize| {
            let map = &rsm.maps[m];
            [(10, &map.surface.position), (11, &map.surface.normal), (12, &map.texels)]
        };
        let source_pair = &light_pairs[level_of_cells(&light_layout, SOURCE_CELLS)];
        let patch_groups = (0..patch_maps)
            .map(|m| {
                let (texel, own) = (texel(m), [(1, &patches[m])]);
                let parent = |p| bind(&technique.patches_parent, &[&texel[..], &own, &[(0, p)]].concat());
                let rest = [(0, source_pair), (2, &indices[m]), (3, &sources)];
                let sources = bind(&technique.patches_sources, &[&texel[..], &own, &rest].concat());
                (light_pairs[1..].iter().map(parent).collect(), sources)
            })
            .collect();
        let clusters_groups = (0..if basic { maps } else { 0 })
            .map(|m| {
                let own = [
                    (0, &light_table),
                    (1, &clusters_uniform),
                    (2, &patches[m]),
                    (3, &clusters),
                    (4, &indices[m]),
                ];
                bind(&technique.clusters, &[&texel(m)[..], &own].concat())
            })
            .collect();
        let tree_groups = (0..tree_maps as usize)
            .map(|m| {
                let own = [
                    (0, &light_table),
                    (1, &tree_uniform),
                    (2, &patches[m]),
                    (3, &light_order),
                    (4, &reference),
                    (5, &parts[m / per_part as usize].branches),
                    (6, &indices[m]),
                ];
                bind(&technique.tree, &[&texel(m)[..], &own].concat())
            })
            .collect();
        let splat = match options.method {
            Method::Gather => None,
            Method::Splat => {
                // As square as the list of fragments allows.
                let width = (pixels as f64).sqrt().ceil() as u32;
                let target_size = [width, index("the fragments", pixels.div_ceil(u64::from(width)))?];
                let target = (&positions, &normals, &gather.irradiance);
                Some(splat_resources(
                    device,
                    technique,
                    target_size,
                    target,
                    &gather,
                    [&splat_uniform, &reference, &view_uniform],
                ))
            }
            Method::BoundedSplat => {
                let target = (&camera.position, &camera.normal, &irradiance);
                Some(splat_resources(
                    device,
                    technique,
                    size,
                    target,
                    &gather,
                    [&splat_uniform, &reference, &view_uniform],
                ))
            }
        };
        Ok(Self {
            refine_group: bind(
                &technique.refine,
                &[
                    (0, &table),
                    (1, &refine_uniform),
                    (12, &blocks),
                    (3, &needs),
                    (6, &sources),
                    (7, &reference),
                ],
            ),
            stencil_group: bind(
                &technique.stencil,
                &[&pixel[..], &block, &[(0, &table), (3, &needs), (4, &states)]].concat(),
            ),
            count_group: bind(
                &technique.compact_count,
                &[(0, &compact_uniform), (1, &order), (2, &states), (3, &runs_buffer)],
            ),
            scan_group: bind(
                &technique.compact_scan,
                &[(0, &compact_uniform), (3, &runs_buffer), (8, &totals)],
            ),
            write_group: bind(
                &technique.compact_write,
                &[
                    (0, &compact_uniform),
                    (1, &order),
                    (2, &states),
                    (3, &runs_buffer),
                    (6, &slots),
                    (7, &fragment_nodes),
                ],
            ),
            arguments_group: bind(
                &technique.compact_arguments,
                &[(0, &compact_uniform), (8, &totals), (13, &gather.count)],
            ),
            points_group: {
                let own = [
                    (0, &compact_uniform),
                    (4, &positions),
                    (5, &normals),
                    (7, &fragment_nodes),
                    (9, &totals),
                ];
                bind(&technique.compact_points, &[&pixel[..], &block, &own].concat())
            },
            lights_group: bind(
                &technique.compact_lights,
                &[(0, light_buffer), (1, &gather.vpls), (2, &gather.count), (3, &slot_uniform)],
            ),
            reference_group: {
                let own = [(5, &source_params), (6, &sources), (7, &reference)];
                bind(&technique.reference_irradiance, &[&pixel[..], &block, &own].concat())
            },
            shade_group: bind(&technique.shade, &[(0, &camera.albedo), (1, &irradiance), (2, &image)]),
            levels: layout.levels.iter().map(|l| l.len() as u64).collect(),
            light_levels: light_layout.levels.iter().map(|l| l.len() as u64).collect(),
            mips_groups,
            patch_groups,
            clusters_groups,
            tree_groups,
            parts,
            pull_groups,
            push_groups,
            rsm,
            patches,
            sources,
            reference,
            clusters,
            blocks,
            needs,
            states,
            slots,
            fragment_nodes,
            positions,
            normals,
            totals,
            gather,
            cuts,
            irradiance,
            coarse_irradiance,
            image,
            runs_buffer,
            order,
            light_order,
            refine_uniform,
            clusters_uniform,
            tree_uniform,
            splat_uniform,
            view_uniform,
            splat,
            coarsest,
            runs,
            branches,
            size,
        })
    }

    /// Sets what changes from frame to frame: lights, their views, the camera's view, parameters. Call it before the first
    /// [`ImageSpaceRadiosity::encode`], and again when something changes.
    ///
    /// # Errors
    /// [`Error::Rsm`] where `views` do not fit, [`Error::BadOption`] where `params` are out of range.
    pub fn prepare(
        &mut self,
        queue: &Queue,
        lights: &[Light],
        views: &[MapView],
        camera: &View,
        params: &Params,
    ) -> Result<(), Error> {
        params.validate()?;
        let rsm_params = rsm::Params { form: params.form, seed: params.seed };
        self.rsm.prepare(queue, lights, views, &rsm_params)?;
        self.gather.prepare(queue, params.form);
        let area_scale = params.form.area_scale();
        let refine = RefineUniform {
            depth: params.blocks.depth,
            versine: params.blocks.versine(),
            margin: params.margin,
            bend: params.bend,
        };
        queue.write_buffer(&self.refine_uniform, 0, bytemuck::bytes_of(&refine));
        let (depth, versine) = (params.patches.depth, params.patches.versine());
        let clusters = ClustersUniform { depth, versine, pad0: 0.0, pad1: 0.0 };
        queue.write_buffer(&self.clusters_uniform, 0, bytemuck::bytes_of(&clusters));
        let tree = TreeUniform {
            bound: match params.bound {
                Bound::Error => 0,
                Bound::ContributionAsPrinted => 1,
            },
            per_map: self.branches,
            tau: params.tau,
            pad0: 0,
        };
        queue.write_buffer(&self.tree_uniform, 0, bytemuck::bytes_of(&tree));
        for part in &self.parts {
            let [first, end] = part.range;
            let traverse = TraverseUniform { first, end, area_scale, pad0: 0 };
            queue.write_buffer(&part.uniform, 0, bytemuck::bytes_of(&traverse));
        }
        if let Some(splat) = &self.splat {
            let uniform = SplatUniform { size: splat.size, area_scale, cutoff: params.cutoff };
            queue.write_buffer(&self.splat_uniform, 0, bytemuck::bytes_of(&uniform));
            let view = ViewUniform::new(camera, self.size, 0);
            queue.write_buffer(&self.view_uniform, 0, bytemuck::bytes_of(&view));
            // Six vertices per bounded splat; the pass copies the number of lights.
            queue.write_buffer(&self.totals, SPLAT_ARGUMENTS, bytemuck::cast_slice(&[6_u32, 0, 0, 0]));
        }
        Ok(())
    }

    /// Nodes of the levels that have a state.
    pub(super) fn nodes(&self) -> u64 {
        self.levels[..=self.coarsest].iter().sum()
    }

    /// GPU memory, bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let own = [
            &self.sources,
            &self.reference,
            &self.clusters,
            &self.blocks,
            &self.needs,
            &self.states,
            &self.slots,
            &self.fragment_nodes,
            &self.positions,
            &self.normals,
            &self.totals,
            &self.cuts,
            &self.irradiance,
            &self.coarse_irradiance,
            &self.image,
            &self.runs_buffer,
            &self.order,
            &self.light_order,
        ];
        let splat = self.splat.as_ref().map_or(0, |s| s.bytes);
        let lists = self.patches.iter().chain(self.parts.iter().map(|p| &p.branches));
        let lists = lists.map(Buffer::size).sum::<u64>();
        own.map(Buffer::size).iter().sum::<u64>() + lists + self.rsm.bytes() + self.gather.bytes() + splat
    }
}

/// Number of nodes of the levels `0..=coarsest`.
fn node_count(layout: &PyramidLayout, coarsest: usize) -> u32 {
    let last = layout.levels[coarsest];
    last.offset + last.len() as u32
}

fn level_table(layout: &PyramidLayout, [coarsest, finest]: [usize; 2], nodes: u32) -> LevelTable {
    let mut table = LevelTable {
        count: layout.levels.len() as u32,
        coarsest: coarsest as u32,
        finest: finest as u32,
        nodes,
        ..LevelTable::default()
    };
    // A side of 2¹⁵ texels, more than any device has, makes 16 levels.
    for (entry, l) in table.levels.iter_mut().zip(&layout.levels) {
        *entry = [l.offset, l.size[0], l.size[1], 0];
    }
    table
}

/// A level and the finer one below it; level 0 has none.
fn level_pair(layout: &PyramidLayout, level: usize) -> LevelPair {
    let coarse = layout.levels[level];
    let fine = level.checked_sub(1).map(|l| layout.levels[l]);
    let image = layout.levels[0];
    LevelPair {
        fine_offset: fine.map_or(0, |l| l.offset),
        fine_width: fine.map_or(0, |l| l.size[0]),
        fine_height: fine.map_or(0, |l| l.size[1]),
        level: level as u32,
        coarse_offset: coarse.offset,
        coarse_width: coarse.size[0],
        coarse_height: coarse.size[1],
        first: image.len() as u32,
        image_width: image.size[0],
        image_height: image.size[1],
        ..LevelPair::default()
    }
}

fn splat_resources(
    device: &Device,
    technique: &ImageSpaceRadiosity,
    size: [u32; 2],
    (positions, normals, sums): (&Buffer, &Buffer, &Buffer),
    gather: &GatherResources,
    [params, reference, view]: [&Buffer; 3],
) -> SplatResources {
    let format = splat_format(device);
    let texture = device.create_texture(&TextureDescriptor {
        label: Some("splats"),
        size: Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format,
        usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    let target = texture.create_view(&TextureViewDescriptor::default());
    let mut entries = vec![(0, params), (1, &gather.vpls), (2, positions), (3, normals)];
    if technique.options().method == Method::BoundedSplat {
        entries.extend([(4, reference), (5, view)]);
    }
    let entries: Vec<_> = entries
        .into_iter()
        .map(|(binding, b)| BindGroupEntry { binding, resource: b.as_entire_binding() })
        .collect();
    let group = device.create_bind_group(&BindGroupDescriptor {
        label: Some("splat"),
        layout: &technique.splat.get_bind_group_layout(0),
        entries: &entries,
    });
    let resolve = [
        (0, params.as_entire_binding()),
        (6, BindingResource::TextureView(&target)),
        (7, sums.as_entire_binding()),
    ];
    let resolve_group = technique.splat_resolve.bind(device, 0, &resolve);
    let texels = size[0] * size[1];
    let bytes = u64::from(texels) * u64::from(format.block_copy_size(None).unwrap_or(16));
    SplatResources { target, group, resolve_group, texels, size, bytes }
}

#[cfg(test)]
mod tests {
    use super::*;
    use indirect_gpu::shaders::{
        IMAGE_SPACE_RADIOSITY_CLUSTERS, IMAGE_SPACE_RADIOSITY_COMPACT, IMAGE_SPACE_RADIOSITY_MIPS,
        IMAGE_SPACE_RADIOSITY_REFINE, IMAGE_SPACE_RADIOSITY_SPLAT, IMAGE_SPACE_RADIOSITY_TRAVERSE,
        IMAGE_SPACE_RADIOSITY_TREE,
    };
    use testkit::{assert_layout, layout::check_constant};

    #[test]
    fn structs_lie_in_memory_as_in_wgsl() {
        assert_layout!(
            IMAGE_SPACE_RADIOSITY_MIPS,
            "Block" = Block { position, depth_min, normal, depth_max, versine, pixels, mixed, radius }
        );
        assert_layout!(
            IMAGE_SPACE_RADIOSITY_MIPS,
            "LevelPair" = LevelPair {
                fine_offset,
                fine_width,
                fine_height,
                level,
                coarse_offset,
                coarse_width,
                coarse_height,
                first,
                image_width,
                image_height,
                pad0,
                pad1
            }
        );
        assert_layout!(
            IMAGE_SPACE_RADIOSITY_REFINE,
            "LevelTable" = LevelTable { levels, count, coarsest, finest, nodes }
        );
        assert_layout!(
            IMAGE_SPACE_RADIOSITY_REFINE,
            "Refine" = RefineUniform { depth, versine, margin, bend }
        );
        assert_layout!(
            IMAGE_SPACE_RADIOSITY_REFINE,
            "Sources" = SourcesUniform { first, first_receiver, receivers, pad0 }
        );
        assert_layout!(
            IMAGE_SPACE_RADIOSITY_COMPACT,
            "Compact" = CompactUniform { entries, runs, nodes, chunks, first, pad0, pad1, pad2 }
        );
        assert_layout!(
            IMAGE_SPACE_RADIOSITY_CLUSTERS,
            "Clusters" = ClustersUniform { depth, versine, pad0, pad1 }
        );
        assert_layout!(
            IMAGE_SPACE_RADIOSITY_TREE,
            "Patch" = Patch { position, area, normal, radius, flux, versine, relief, pad0, pad1, pad2 }
        );
        assert_layout!(
            IMAGE_SPACE_RADIOSITY_TREE,
            "Branch" = Branch { position, area, normal, reach, flux, next, child, pad0, pad1, pad2 }
        );
        assert_layout!(IMAGE_SPACE_RADIOSITY_TREE, "MapIndex" = MapIndex { map, first_branch, pad0, pad1 });
        assert_layout!(IMAGE_SPACE_RADIOSITY_TREE, "Tree" = TreeUniform { bound, per_map, tau, pad0 });
        assert_layout!(
            IMAGE_SPACE_RADIOSITY_TRAVERSE,
            "Traverse" = TraverseUniform { first, end, area_scale, pad0 }
        );
        assert_layout!(IMAGE_SPACE_RADIOSITY_SPLAT, "Splat" = SplatUniform { size, area_scale, cutoff });
    }

    #[test]
    fn constants_are_those_of_the_shaders() {
        use crate::layout::state;
        check_constant(&IMAGE_SPACE_RADIOSITY_COMPACT, "RUN", RUN).unwrap();
        check_constant(&IMAGE_SPACE_RADIOSITY_COMPACT, "CHUNK", rsm::gpu::CHUNK).unwrap();
        check_constant(&IMAGE_SPACE_RADIOSITY_TRAVERSE, "TILE", TILE as u32).unwrap();
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
}
