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
    pub(crate) pad0: u32,
    pub(crate) image_width: u32,
    pub(crate) image_height: u32,
    pub(crate) pad1: u32,
    pub(crate) pad2: u32,
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
    pub(crate) maps: u32,
    pub(crate) per_map: u32,
    pub(crate) first: u32,
    pub(crate) count: u32,
    pub(crate) first_receiver: u32,
    pub(crate) receivers: u32,
    pub(crate) pad0: u32,
    pub(crate) pad1: u32,
}

/// As `compact.wgsl` declares it.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct CompactUniform {
    pub(crate) entries: u32,
    pub(crate) runs: u32,
    pub(crate) nodes: u32,
    pub(crate) chunks: u32,
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
    pub(crate) maps: u32,
    pub(crate) branches: u32,
    pub(crate) tau: f32,
}

/// As `traverse.wgsl` declares it.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct TraverseUniform {
    pub(crate) branches: u32,
    pub(crate) area_scale: f32,
    pub(crate) pad0: u32,
    pub(crate) pad1: u32,
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

/// All buffers of a frame; every intermediate result can be read back.
#[derive(Debug)]
pub struct Resources {
    /// The maps.
    pub rsm: rsm::gpu::Resources,
    /// `array<Patch>`: the patches of all maps.
    pub patches: Buffer,
    /// `array<f32, 1>`: the reference irradiance, W/m².
    pub reference: Buffer,
    /// `array<Branch>`: the tree of all maps.
    pub tree: Buffer,
    /// `array<Vpl>`: the clusters, one slot per patch.
    pub clusters: Buffer,
    /// `array<Block>`: blocks of the camera's pixels.
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
    /// `array<vec4<f32>>`: irradiance of all blocks, W/m², pixels first.
    pub irradiance: Buffer,
    /// `array<vec4<f32>>`: indirect radiance that leaves each pixel of the camera, W/(sr·m²), and 0.
    pub image: Buffer,
    runs_buffer: Buffer,
    order: Buffer,
    light_order: Buffer,
    refine_uniform: Buffer,
    clusters_uniform: Buffer,
    tree_uniform: Buffer,
    traverse_uniform: Buffer,
    splat_uniform: Buffer,
    view_uniform: Buffer,
    pub(super) splat: Option<SplatResources>,
    /// Nodes of each level of the camera's and of a map's pyramid.
    pub(super) levels: Vec<u64>,
    pub(super) light_levels: Vec<u64>,
    pub(super) coarsest: usize,
    pub(super) runs: u32,
    pub(super) light_slots: u32,
    pub(super) branches: u32,
    pub(super) mips_groups: Vec<BindGroup>,
    pub(super) refine_group: BindGroup,
    pub(super) stencil_group: BindGroup,
    pub(super) count_group: BindGroup,
    pub(super) scan_group: BindGroup,
    pub(super) write_group: BindGroup,
    pub(super) arguments_group: BindGroup,
    pub(super) lights_group: BindGroup,
    pub(super) patch_groups: Vec<Vec<BindGroup>>,
    pub(super) reference_group: BindGroup,
    pub(super) clusters_group: BindGroup,
    pub(super) tree_group: BindGroup,
    pub(super) traverse_group: BindGroup,
    pub(super) pull_groups: Vec<BindGroup>,
    pub(super) push_groups: Vec<BindGroup>,
    pub(super) shade_group: BindGroup,
    per_map_branches: u32,
    maps: u32,
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
        let patch_count = if options.has_patches() { maps as u64 * light_layout.len() as u64 } else { 0 };
        let light_slots = index("the patches", if basic { patch_count } else { 0 })?;
        let per_map_branches = links.order.len() as u32;
        let branches = index("the tree", maps as u64 * u64::from(per_map_branches))?;

        let patches = empty_storage_buffer::<Patch>(device, "light patches", patch_count)?;
        let reference = empty_storage_buffer::<f32>(device, "reference irradiance", 1)?;
        let tree = empty_storage_buffer::<Branch>(device, "light tree", u64::from(branches))?;
        let clusters = empty_storage_buffer::<Vpl>(device, "light clusters", u64::from(light_slots))?;
        let blocks = empty_storage_buffer::<Block>(device, "blocks", layout.len() as u64)?;
        let needs = empty_storage_buffer::<u32>(device, "needs", nodes - pixels)?;
        let states = empty_storage_buffer::<u32>(device, "states", nodes)?;
        let slots = empty_storage_buffer::<u32>(device, "fragment slots", nodes)?;
        let fragment_nodes = empty_storage_buffer::<u32>(device, "fragment nodes", pixels)?;
        let positions = empty_storage_buffer::<Vec3Pad>(device, "fragment positions", pixels)?;
        let normals = empty_storage_buffer::<Vec3Pad>(device, "fragment normals", pixels)?;
        let cuts = empty_storage_buffer::<u32>(device, "cuts", pixels.div_ceil(TILE as u64))?;
        let irradiance = empty_storage_buffer::<Vec3Pad>(device, "irradiance of blocks", nodes)?;
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

        let source_level = light_layout.levels[level_of_cells(&light_layout, SOURCE_CELLS)];
        let receiver_level = layout.levels[level_of_cells(layout, RECEIVER_CELLS)];
        let sources = SourcesUniform {
            maps: if options.has_patches() { maps as u32 } else { 0 },
            per_map: light_layout.len() as u32,
            first: source_level.offset,
            count: source_level.len() as u32,
            first_receiver: receiver_level.offset,
            receivers: receiver_level.len() as u32,
            pad0: 0,
            pad1: 0,
        };
        let sources_uniform = uniform_buffer(device, "sources", &sources);
        let refine_uniform = uniform_buffer(device, "refine", &RefineUniform::default());
        let clusters_uniform = uniform_buffer(device, "clusters", &ClustersUniform::default());
        let tree_uniform = uniform_buffer(device, "tree", &TreeUniform::default());
        let traverse_uniform = uniform_buffer(device, "traverse", &TraverseUniform::default());
        let splat_uniform = uniform_buffer(device, "splat", &SplatUniform::default());
        let view_uniform = uniform_buffer(device, "splat view", &ViewUniform::zeroed());
        let compact_uniform = CompactUniform { entries, runs, nodes: nodes as u32, chunks: gather.chunks() };
        let compact_uniform = uniform_buffer(device, "compact", &compact_uniform);
        let table = uniform_buffer(device, "block levels", &level_table(layout, [coarsest, 0], nodes as u32));
        let light_table = level_table(&light_layout, range, light_slots);
        let light_table = uniform_buffer(device, "patch levels", &light_table);
        let slot_uniform = uniform_buffer(device, "light slots", &[capacity, 0, 0, 0]);

        let pair = |label, fine: Option<usize>, coarse: usize, layout: &PyramidLayout, base: u32, image| {
            uniform_buffer(device, label, &level_pair(layout, fine, coarse, base, image))
        };
        let bind = |kernel: &indirect_gpu::Kernel, resources: &[(u32, &Buffer)]| {
            let resources: Vec<_> = resources.iter().map(|(i, b)| (*i, b.as_entire_binding())).collect();
            kernel.bind(device, 0, &resources)
        };
        let count = layout.levels.len();
        let below = |level: usize| level.checked_sub(1);
        let pairs: Vec<Buffer> =
            (0..count).map(|l| pair("block level", below(l), l, layout, 0, size)).collect();
        let mips_groups = (0..count)
            .map(|l| match l {
                0 => bind(&technique.mips_leaf, &[(1, &camera.position), (2, &camera.normal), (3, &blocks)]),
                _ => bind(&technique.mips_parent, &[(0, &pairs[l]), (3, &blocks)]),
            })
            .collect();
        let pull_groups = pairs
            .iter()
            .map(|p| {
                let fragment = [(3, &slots), (4, &gather.irradiance)];
                let node = [(0, p), (1, &blocks), (2, &states), (5, &irradiance)];
                bind(&technique.pull, &[&node[..], &fragment].concat())
            })
            .collect();
        let push_groups = pairs[1..]
            .iter()
            .map(|p| bind(&technique.push, &[(0, p), (1, &blocks), (2, &states), (5, &irradiance)]))
            .collect();
        let patch_groups = if options.has_patches() {
            let map = |(i, m): (u32, &rsm::gpu::MapResources)| {
                let base = i * light_layout.len() as u32;
                (0..light_layout.levels.len())
                    .map(|l| {
                        let p = pair("patch level", below(l), l, &light_layout, base, map_size);
                        match l {
                            0 => bind(
                                &technique.patches_leaf,
                                &[
                                    (0, &p),
                                    (1, &m.surface.position),
                                    (2, &m.surface.normal),
                                    (3, &m.texels),
                                    (4, &patches),
                                ],
                            ),
                            _ => bind(&technique.patches_parent, &[(0, &p), (4, &patches)]),
                        }
                    })
                    .collect()
            };
            (0..).zip(&rsm.maps).map(map).collect()
        } else {
            Vec::new()
        };
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
                    (2, &blocks),
                    (3, &needs),
                    (5, &sources_uniform),
                    (6, &patches),
                    (7, &reference),
                ],
            ),
            stencil_group: bind(&technique.stencil, &[(0, &table), (2, &blocks), (3, &needs), (4, &states)]),
            count_group: bind(
                &technique.compact_count,
                &[(0, &compact_uniform), (1, &order), (2, &states), (3, &runs_buffer)],
            ),
            scan_group: bind(
                &technique.compact_scan,
                &[(0, &compact_uniform), (3, &runs_buffer), (9, &totals)],
            ),
            write_group: bind(
                &technique.compact_write,
                &[
                    (0, &compact_uniform),
                    (1, &order),
                    (2, &states),
                    (3, &runs_buffer),
                    (4, &blocks),
                    (5, &positions),
                    (6, &normals),
                    (7, &slots),
                    (8, &fragment_nodes),
                ],
            ),
            arguments_group: bind(
                &technique.compact_arguments,
                &[(0, &compact_uniform), (9, &totals), (10, &gather.count)],
            ),
            lights_group: bind(
                &technique.compact_lights,
                &[(0, light_buffer), (1, &gather.vpls), (2, &gather.count), (3, &slot_uniform)],
            ),
            reference_group: bind(
                &technique.reference_irradiance,
                &[(2, &blocks), (5, &sources_uniform), (6, &patches), (7, &reference)],
            ),
            clusters_group: bind(
                &technique.clusters,
                &[(0, &light_table), (1, &clusters_uniform), (2, &patches), (3, &clusters)],
            ),
            tree_group: bind(
                &technique.tree,
                &[
                    (0, &light_table),
                    (1, &tree_uniform),
                    (2, &patches),
                    (3, &light_order),
                    (4, &reference),
                    (5, &tree),
                ],
            ),
            traverse_group: bind(
                &technique.traverse,
                &[
                    (0, &traverse_uniform),
                    (1, &tree),
                    (2, &positions),
                    (3, &normals),
                    (4, &totals),
                    (5, &gather.irradiance),
                    (6, &cuts),
                ],
            ),
            shade_group: bind(&technique.shade, &[(0, &camera.albedo), (1, &irradiance), (2, &image)]),
            levels: layout.levels.iter().map(|l| l.len() as u64).collect(),
            light_levels: light_layout.levels.iter().map(|l| l.len() as u64).collect(),
            mips_groups,
            patch_groups,
            pull_groups,
            push_groups,
            rsm,
            patches,
            reference,
            tree,
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
            image,
            runs_buffer,
            order,
            light_order,
            refine_uniform,
            clusters_uniform,
            tree_uniform,
            traverse_uniform,
            splat_uniform,
            view_uniform,
            splat,
            coarsest,
            runs,
            light_slots,
            branches,
            per_map_branches,
            maps: maps as u32,
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
            maps: self.maps,
            branches: self.per_map_branches,
            tau: params.tau,
        };
        queue.write_buffer(&self.tree_uniform, 0, bytemuck::bytes_of(&tree));
        let traverse = TraverseUniform { branches: self.branches, area_scale, pad0: 0, pad1: 0 };
        queue.write_buffer(&self.traverse_uniform, 0, bytemuck::bytes_of(&traverse));
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
            &self.patches,
            &self.reference,
            &self.tree,
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
            &self.image,
            &self.runs_buffer,
            &self.order,
            &self.light_order,
        ];
        let splat = self.splat.as_ref().map_or(0, |s| s.bytes);
        own.map(Buffer::size).iter().sum::<u64>() + self.rsm.bytes() + self.gather.bytes() + splat
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

fn level_pair(
    layout: &PyramidLayout,
    fine: Option<usize>,
    coarse: usize,
    base: u32,
    image: [u32; 2],
) -> LevelPair {
    let c = layout.levels[coarse];
    let f = fine.map(|l| layout.levels[l]);
    LevelPair {
        fine_offset: base + f.map_or(0, |l| l.offset),
        fine_width: f.map_or(0, |l| l.size[0]),
        fine_height: f.map_or(0, |l| l.size[1]),
        level: coarse as u32,
        coarse_offset: base + c.offset,
        coarse_width: c.size[0],
        coarse_height: c.size[1],
        image_width: image[0],
        image_height: image[1],
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
                pad0,
                image_width,
                image_height,
                pad1,
                pad2
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
            "Sources" = SourcesUniform { maps, per_map, first, count, first_receiver, receivers, pad0, pad1 }
        );
        assert_layout!(
            IMAGE_SPACE_RADIOSITY_COMPACT,
            "Compact" = CompactUniform { entries, runs, nodes, chunks }
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
        assert_layout!(IMAGE_SPACE_RADIOSITY_TREE, "Tree" = TreeUniform { bound, maps, branches, tau });
        assert_layout!(
            IMAGE_SPACE_RADIOSITY_TRAVERSE,
            "Traverse" = TraverseUniform { branches, area_scale, pad0, pad1 }
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
