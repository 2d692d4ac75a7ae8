//! The passes on wgpu. The caller owns device, queue and encoder; nothing here submits or blocks, but for `twins`, which is
//! for tools.
//!
//! WebGPU's default limits suffice. [`Method::Splat`] and [`Method::BoundedSplat`] blend into 32-bit floats where the device has
//! `FLOAT32_BLENDABLE`, else into 16-bit floats, which lose digits; nothing else asks for an optional feature.
//!
//! The fragments are a compacted list with indirect dispatch rather than a stencil test: the same blocks are found by the same
//! test, and the gather, which is compute, has no rasteriser that a stencil could spare work.

mod resources;
#[cfg(feature = "cpu")]
mod twins;

pub use resources::Resources;
#[cfg(feature = "cpu")]
pub use twins::twins;

use indirect_gpu::shaders::{
    IMAGE_SPACE_RADIOSITY_CLUSTERS, IMAGE_SPACE_RADIOSITY_COMPACT, IMAGE_SPACE_RADIOSITY_MIPS,
    IMAGE_SPACE_RADIOSITY_PATCHES, IMAGE_SPACE_RADIOSITY_REFINE, IMAGE_SPACE_RADIOSITY_SPLAT,
    IMAGE_SPACE_RADIOSITY_TRAVERSE, IMAGE_SPACE_RADIOSITY_TREE, IMAGE_SPACE_RADIOSITY_UPSAMPLE, RSM_COMPACT,
    RSM_SHADE,
};
use indirect_gpu::wgpu::{
    BlendComponent, BlendFactor, BlendOperation, BlendState, Color, ColorTargetState, ColorWrites,
    CommandEncoder, Device, Features, FragmentState, LoadOp, MultisampleState, Operations,
    PipelineCompilationOptions, PrimitiveState, PrimitiveTopology, RenderPassColorAttachment,
    RenderPassDescriptor, RenderPipeline, RenderPipelineDescriptor, StoreOp, TextureFormat, VertexState,
};
use indirect_gpu::{Kernel, PassTimer, SceneBuffers, shader_module, workgroups_1d};
use rsm::gpu::Gather;

use crate::{Error, Lights, Method, Options};

/// Invocations per workgroup of every pass but `compact_scan`.
const WORKGROUP: u32 = 64;

/// Nodes that one thread of `compact` treats, as `compact.wgsl` declares it.
const RUN: u32 = 64;

/// The pipelines of all passes.
#[derive(Debug)]
pub struct ImageSpaceRadiosity {
    options: Options,
    rsm: rsm::gpu::Rsm,
    mips_parent: Kernel,
    refine: Kernel,
    stencil: Kernel,
    compact_count: Kernel,
    compact_scan: Kernel,
    compact_write: Kernel,
    compact_arguments: Kernel,
    compact_points: Kernel,
    compact_lights: Kernel,
    patches_parent: Kernel,
    patches_sources: Kernel,
    clusters: Kernel,
    reference_irradiance: Kernel,
    tree: Kernel,
    gather: Gather,
    traverse: Kernel,
    splat: RenderPipeline,
    splat_resolve: Kernel,
    pull: Kernel,
    push: Kernel,
    shade: Kernel,
}

impl ImageSpaceRadiosity {
    /// Builds the pipelines.
    ///
    /// # Errors
    /// [`Error::BadOption`] where `options` are out of range.
    pub fn new(device: &Device, options: &Options) -> Result<Self, Error> {
        options.validate()?;
        let kernel = |module, entry| Kernel::new(device, module, entry, &[]);
        Ok(Self {
            options: *options,
            rsm: rsm::gpu::Rsm::new(device, &options.rsm())?,
            mips_parent: kernel(&IMAGE_SPACE_RADIOSITY_MIPS, "mips_parent"),
            refine: kernel(&IMAGE_SPACE_RADIOSITY_REFINE, "refine"),
            stencil: kernel(&IMAGE_SPACE_RADIOSITY_REFINE, "stencil"),
            compact_count: kernel(&IMAGE_SPACE_RADIOSITY_COMPACT, "compact_count"),
            compact_scan: kernel(&IMAGE_SPACE_RADIOSITY_COMPACT, "compact_scan"),
            compact_write: kernel(&IMAGE_SPACE_RADIOSITY_COMPACT, "compact_write"),
            compact_arguments: kernel(&IMAGE_SPACE_RADIOSITY_COMPACT, "compact_arguments"),
            compact_points: kernel(&IMAGE_SPACE_RADIOSITY_COMPACT, "compact_points"),
            compact_lights: kernel(&RSM_COMPACT, "compact"),
            patches_parent: kernel(&IMAGE_SPACE_RADIOSITY_PATCHES, "patches_parent"),
            patches_sources: kernel(&IMAGE_SPACE_RADIOSITY_PATCHES, "patches_sources"),
            clusters: kernel(&IMAGE_SPACE_RADIOSITY_CLUSTERS, "clusters"),
            reference_irradiance: kernel(&IMAGE_SPACE_RADIOSITY_REFINE, "reference_irradiance"),
            tree: kernel(&IMAGE_SPACE_RADIOSITY_TREE, "tree"),
            gather: Gather::new(device),
            traverse: kernel(&IMAGE_SPACE_RADIOSITY_TRAVERSE, "traverse"),
            splat: splat_pipeline(device, options.method),
            splat_resolve: kernel(&IMAGE_SPACE_RADIOSITY_SPLAT, "splat_resolve"),
            pull: kernel(&IMAGE_SPACE_RADIOSITY_UPSAMPLE, "pull"),
            push: kernel(&IMAGE_SPACE_RADIOSITY_UPSAMPLE, "push"),
            shade: kernel(&RSM_SHADE, "shade"),
        })
    }

    /// What it was made with.
    #[must_use]
    pub const fn options(&self) -> &Options {
        &self.options
    }

    /// The pipelines of the reflective shadow maps.
    #[must_use]
    pub const fn rsm(&self) -> &rsm::gpu::Rsm {
        &self.rsm
    }

    /// All passes of a frame: from the scene and the views that [`Resources::prepare`] was given to the indirect light of the
    /// camera's pixels in [`Resources::image`].
    ///
    /// # Errors
    /// [`Error::Gpu`] where something exceeds the device's limits.
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        scene: &SceneBuffers,
        resources: &Resources,
    ) -> Result<(), Error> {
        self.rsm.encode_surface(encoder, timer, scene, &resources.rsm)?;
        self.rsm.encode_flux(encoder, timer, &resources.rsm)?;
        if let Lights::Flat(_) = self.options.lights {
            self.rsm.encode_pyramid(encoder, timer, &resources.rsm)?;
            self.rsm.encode_vpls(encoder, timer, &resources.rsm)?;
        }
        self.encode_from_maps(encoder, timer, resources)
    }

    /// The passes of [`Self::encode`] that follow the maps.
    ///
    /// # Errors
    /// As there, like all that follow.
    pub fn encode_from_maps(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        if self.options.has_patches() {
            self.encode_patches(encoder, timer, resources)?;
        }
        self.encode_mips(encoder, timer, resources)?;
        self.encode_sources(encoder, timer, resources);
        match self.options.lights {
            Lights::Flat(_) => {}
            Lights::Basic { .. } => self.encode_clusters(encoder, timer, resources)?,
            Lights::Hierarchical { .. } => self.encode_tree(encoder, timer, resources)?,
        }
        if !matches!(self.options.lights, Lights::Hierarchical { .. }) {
            self.encode_lights(encoder, timer, resources);
        }
        if self.options.method == Method::BoundedSplat {
            self.encode_splat(encoder, timer, resources)?;
        } else {
            self.encode_refine(encoder, timer, resources)?;
            self.encode_compact(encoder, timer, resources)?;
            match (self.options.method, self.options.lights) {
                (Method::Gather, Lights::Hierarchical { .. }) => {
                    self.encode_traverse(encoder, timer, resources);
                }
                (Method::Gather, _) => self.encode_gather(encoder, timer, resources),
                _ => self.encode_splat(encoder, timer, resources)?,
            }
            self.encode_pull(encoder, timer, resources)?;
            self.encode_push(encoder, timer, resources)?;
        }
        self.encode_shade(encoder, timer, resources)
    }

    /// `patches`: lights of all sizes from texels.
    ///
    /// # Errors
    /// See [`Self::encode`].
    pub fn encode_patches(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        let levels = resources.light_levels[1..].iter().map(|n| workgroups_1d(*n, WORKGROUP));
        let levels = levels.collect::<Result<Vec<_>, _>>()?;
        timer.compute(encoder, "patches", |pass| {
            for (groups, sources) in &resources.patch_groups {
                for (group, workgroups) in groups.iter().zip(&levels) {
                    self.patches_parent.record(pass, &[group], *workgroups);
                }
                self.patches_sources.record(pass, &[sources], [1, 1, 1]);
            }
        });
        Ok(())
    }

    /// `sources`: the reference irradiance from patches and blocks.
    pub fn encode_sources(&self, encoder: &mut CommandEncoder, timer: &mut PassTimer, resources: &Resources) {
        timer.compute(encoder, "sources", |pass| {
            self.reference_irradiance.record(pass, &[&resources.reference_group], [1, 1, 1]);
        });
    }

    /// `clusters`: one list of lights from patches.
    ///
    /// # Errors
    /// See [`Self::encode`].
    pub fn encode_clusters(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        let workgroups = workgroups_1d(resources.light_levels.iter().sum(), WORKGROUP)?;
        timer.compute(encoder, "clusters", |pass| {
            for group in &resources.clusters_groups {
                self.clusters.record(pass, &[group], workgroups);
            }
        });
        Ok(())
    }

    /// `compact` of the lights: the slots with flux.
    pub fn encode_lights(&self, encoder: &mut CommandEncoder, timer: &mut PassTimer, resources: &Resources) {
        timer.compute(encoder, "lights", |pass| {
            self.compact_lights.record(pass, &[&resources.lights_group], [1, 1, 1]);
        });
    }

    /// `tree`: the traversal's order from patches.
    ///
    /// # Errors
    /// See [`Self::encode`].
    pub fn encode_tree(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        let workgroups = workgroups_1d(u64::from(resources.branches), WORKGROUP)?;
        timer.compute(encoder, "tree", |pass| {
            for group in &resources.tree_groups {
                self.tree.record(pass, &[group], workgroups);
            }
        });
        Ok(())
    }

    /// `mips`: blocks from pixels.
    ///
    /// # Errors
    /// See [`Self::encode`].
    pub fn encode_mips(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        let levels = resources.levels[1..].iter().map(|n| workgroups_1d(*n, WORKGROUP));
        let levels = levels.collect::<Result<Vec<_>, _>>()?;
        timer.compute(encoder, "mips", |pass| {
            for (group, workgroups) in resources.mips_groups.iter().zip(&levels) {
                self.mips_parent.record(pass, &[group], *workgroups);
            }
        });
        Ok(())
    }

    /// `refine` and `stencil`: what becomes of each block.
    ///
    /// # Errors
    /// See [`Self::encode`].
    pub fn encode_refine(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        let nodes = resources.nodes();
        let blocks = workgroups_1d(nodes - resources.levels[0], WORKGROUP)?;
        let all = workgroups_1d(nodes, WORKGROUP)?;
        timer.compute(encoder, "refine", |pass| {
            self.refine.record(pass, &[&resources.refine_group], blocks);
            self.stencil.record(pass, &[&resources.stencil_group], all);
        });
        Ok(())
    }

    /// `compact`: the valid blocks as fragments, and the arguments of the calls that treat them.
    ///
    /// # Errors
    /// See [`Self::encode`].
    pub fn encode_compact(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        let runs = workgroups_1d(u64::from(resources.runs), WORKGROUP)?;
        let chunks = workgroups_1d(u64::from(resources.gather.chunks()), WORKGROUP)?;
        timer.compute(encoder, "compact", |pass| {
            self.compact_count.record(pass, &[&resources.count_group], runs);
            self.compact_scan.record(pass, &[&resources.scan_group], [1, 1, 1]);
            self.compact_write.record(pass, &[&resources.write_group], runs);
            self.compact_arguments.record(pass, &[&resources.arguments_group], chunks);
            let (group, totals) = (&resources.points_group, &resources.totals);
            self.compact_points.record_indirect(pass, &[group], totals, resources::TRAVERSE_ARGUMENTS);
        });
        Ok(())
    }

    /// `gather`: irradiance on fragments from a list of lights.
    pub fn encode_gather(&self, encoder: &mut CommandEncoder, timer: &mut PassTimer, resources: &Resources) {
        let (totals, offset) = (&resources.totals, resources::GATHER_ARGUMENTS);
        self.gather.encode_indirect(encoder, timer, &resources.gather, totals, offset);
    }

    /// `traverse`: irradiance on fragments from cuts through the tree.
    pub fn encode_traverse(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) {
        timer.compute(encoder, "traverse", |pass| {
            for part in &resources.parts {
                let totals = &resources.totals;
                self.traverse.record_indirect(pass, &[&part.group], totals, resources::TRAVERSE_ARGUMENTS);
            }
        });
    }

    /// `splat`: irradiance on fragments, or on pixels for bounded splats, by blending.
    ///
    /// # Errors
    /// See [`Self::encode`].
    pub fn encode_splat(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        let Some(splat) = &resources.splat else { return Ok(()) };
        let bounded = self.options.method == Method::BoundedSplat;
        if bounded {
            // The list of lights is on the GPU only: its length becomes the number of instances.
            encoder.copy_buffer_to_buffer(&resources.gather.count, 0, &resources.totals, 36, 4);
        }
        let attachment = RenderPassColorAttachment {
            view: &splat.target,
            depth_slice: None,
            resolve_target: None,
            ops: Operations { load: LoadOp::Clear(Color::TRANSPARENT), store: StoreOp::Store },
        };
        let descriptor = RenderPassDescriptor {
            color_attachments: &[Some(attachment)],
            ..RenderPassDescriptor::default()
        };
        timer.render(encoder, "splat", &descriptor, |pass| {
            pass.set_pipeline(&self.splat);
            pass.set_bind_group(0, &splat.group, &[]);
            pass.draw_indirect(&resources.totals, resources::SPLAT_ARGUMENTS);
        });
        let workgroups = workgroups_1d(u64::from(splat.texels), WORKGROUP)?;
        timer.compute(encoder, "splat resolve", |pass| {
            self.splat_resolve.record(pass, &[&splat.resolve_group], workgroups);
        });
        Ok(())
    }

    /// `pull`: irradiance of fragments and of blocks made of them.
    ///
    /// # Errors
    /// See [`Self::encode`].
    pub fn encode_pull(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        self.encode_levels(encoder, timer, resources, true)
    }

    /// `push`: irradiance of all blocks and pixels.
    ///
    /// # Errors
    /// See [`Self::encode`].
    pub fn encode_push(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        self.encode_levels(encoder, timer, resources, false)
    }

    fn encode_levels(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
        pull: bool,
    ) -> Result<(), Error> {
        let levels = resources.levels.iter().map(|n| workgroups_1d(*n, WORKGROUP));
        let levels = levels.collect::<Result<Vec<_>, _>>()?;
        let used = resources.coarsest + 1;
        timer.compute(encoder, "upsample", |pass| {
            if pull {
                for (group, workgroups) in resources.pull_groups.iter().zip(&levels).take(used) {
                    self.pull.record(pass, &[group], *workgroups);
                }
            } else {
                // Level by level down to the pixels.
                let coarser = levels[1..].iter();
                for (group, workgroups) in resources.push_groups.iter().zip(coarser).take(used - 1).rev() {
                    self.push.record(pass, &[group], *workgroups);
                }
            }
        });
        Ok(())
    }

    /// `shade`: radiance from irradiance.
    ///
    /// # Errors
    /// See [`Self::encode`].
    pub fn encode_shade(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &Resources,
    ) -> Result<(), Error> {
        let workgroups = workgroups_1d(resources.levels[0], WORKGROUP)?;
        self.shade.dispatch(encoder, timer, &[&resources.shade_group], workgroups);
        Ok(())
    }
}

/// Format of the splats' target: sums need their digits, but blending 32-bit floats is optional in WebGPU.
fn splat_format(device: &Device) -> TextureFormat {
    if device.features().contains(Features::FLOAT32_BLENDABLE) {
        TextureFormat::Rgba32Float
    } else {
        TextureFormat::Rgba16Float
    }
}

fn splat_pipeline(device: &Device, method: Method) -> RenderPipeline {
    let shader = shader_module(device, &IMAGE_SPACE_RADIOSITY_SPLAT);
    let (vertex, fragment, topology) = match method {
        Method::BoundedSplat => ("splat_bounded_vertex", "splat_bounded", PrimitiveTopology::TriangleList),
        Method::Gather | Method::Splat => ("splat_vertex", "splat", PrimitiveTopology::PointList),
    };
    let add = BlendComponent {
        src_factor: BlendFactor::One,
        dst_factor: BlendFactor::One,
        operation: BlendOperation::Add,
    };
    device.create_render_pipeline(&RenderPipelineDescriptor {
        label: Some(fragment),
        layout: None,
        vertex: VertexState {
            module: &shader,
            entry_point: Some(vertex),
            compilation_options: PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: PrimitiveState { topology, ..PrimitiveState::default() },
        depth_stencil: None,
        multisample: MultisampleState::default(),
        fragment: Some(FragmentState {
            module: &shader,
            entry_point: Some(fragment),
            compilation_options: PipelineCompilationOptions::default(),
            targets: &[Some(ColorTargetState {
                format: splat_format(device),
                blend: Some(BlendState { color: add, alpha: add }),
                write_mask: ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}
