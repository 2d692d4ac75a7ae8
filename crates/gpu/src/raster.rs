use indirect_core::{GBuffer, NO_TRIANGLE, View};
use indirect_shaders::{RESOLVE, VISIBILITY};
use wgpu::{
    BindGroup, BindingResource, Buffer, CommandEncoder, CompareFunction, Device, Queue, RenderPipeline,
    ShaderStages, TextureFormat, TextureUsages, TextureView,
};

use crate::layout::{Vec3Pad, ViewUniform};
use crate::{
    GpuError, Kernel, Named, PassTimer, Plan, SceneBuffers, Uniforms, bind_group, bind_group_layout, buffers,
    named, read_buffer, scene_layout, shader_module, workgroups_2d,
};

const ID_FORMAT: TextureFormat = TextureFormat::R32Uint;
const DEPTH_FORMAT: TextureFormat = TextureFormat::Depth32Float;

buffers! {
    /// Buffers of a [`GBufferTarget`].
    struct GBufferBuffers for [u32; 2] {
        /// World position and view depth.
        gbuffer_position: [Vec3Pad] = texels;
        /// Unit shading normal, turned to the side that is seen, and 0.
        gbuffer_normal: [Vec3Pad] = texels;
        /// Lambertian albedo and 0.
        gbuffer_albedo: [Vec3Pad] = texels;
        /// Index of the triangle.
        gbuffer_triangle: [u32] = texels;
    }
}

fn texels(size: &[u32; 2]) -> u64 {
    u64::from(size[0]) * u64::from(size[1])
}

/// What a view sees, in storage buffers, row-major, top row first.
///
/// Where nothing is seen `triangle` is [`NO_TRIANGLE`] and everything else 0. A clone refers to the same memory.
#[derive(Debug, Clone)]
pub struct GBufferTarget {
    /// World position and view depth, `array<vec4<f32>>`.
    pub position: Buffer,
    /// Unit shading normal, turned to the side that is seen, and 0, `array<vec4<f32>>`.
    pub normal: Buffer,
    /// Lambertian albedo and 0, `array<vec4<f32>>`.
    pub albedo: Buffer,
    /// Index of the triangle, `array<u32>`.
    pub triangle: Buffer,
    size: [u32; 2],
    drawn: Option<Drawn>,
}

/// What a [`Raster`] needs to draw one.
#[derive(Debug, Clone)]
struct Drawn {
    views: Uniforms<ViewUniform>,
    /// Which of the views it is.
    index: usize,
    attachments: Attachments,
    tile: [u32; 2],
    visibility_group: BindGroup,
    resolve_group: BindGroup,
}

impl GBufferTarget {
    /// What an image of `size` texels will allocate.
    #[must_use]
    pub fn plan(size: [u32; 2]) -> Plan {
        Self::plan_of_many(size, 1)
    }

    /// What `count` images of `size` texels will allocate, see [`Self::many`].
    #[must_use]
    pub fn plan_of_many(size: [u32; 2], count: usize) -> Plan {
        let mut plan = Plan::new();
        for grid in grids(size, count) {
            plan = plan.and(Attachments::plan(grid.texels(size)));
            plan.uniforms::<ViewUniform>("view", grid.count);
            for _ in 0..grid.count {
                plan = plan.and(GBufferBuffers::plan(&size));
            }
        }
        plan
    }

    /// Buffers for an image of `size` texels.
    ///
    /// # Errors
    /// [`GpuError::EmptySize`], and [`GpuError::Limit`] where the device has no textures or buffers of that size.
    pub fn new(device: &Device, size: [u32; 2]) -> Result<Self, GpuError> {
        Self::check(device, size, 1)?;
        let views = Uniforms::new(device, "view", 1);
        Self::within(device, size, Attachments::new(device, size), [0, 0], (views, 0))
    }

    /// Buffers for `count` images of `size` texels, which share render targets where those have room: one render pass draws them.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn many(device: &Device, size: [u32; 2], count: usize) -> Result<Vec<Self>, GpuError> {
        Self::check(device, size, count)?;
        let mut targets = Vec::with_capacity(count);
        for grid in grids(size, count) {
            let attachments = Attachments::new(device, grid.texels(size));
            let views = Uniforms::new(device, "view", grid.count);
            for i in 0..grid.count as u32 {
                let tile = [i % grid.columns * size[0], i / grid.columns * size[1]];
                let view = (views.clone(), i as usize);
                targets.push(Self::within(device, size, attachments.clone(), tile, view)?);
            }
        }
        Ok(targets)
    }

    /// What [`Self::imported`] will allocate.
    #[must_use]
    pub fn plan_imported(size: [u32; 2]) -> Plan {
        GBufferBuffers::plan(&size)
    }

    /// Buffers for an image of `size` texels that no [`Raster`] draws: a [`GBufferImport`](crate::GBufferImport) fills them, or the
    /// caller, in whose shaders they are storage buffers like any other. A [`Raster`] passes it over.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn imported(device: &Device, size: [u32; 2]) -> Result<Self, GpuError> {
        Self::check_size(size)?;
        let b = GBufferBuffers::new(device, &size)?;
        Ok(Self::of(b, size, None))
    }

    /// The caller's own buffers, which it fills itself: position and view depth, unit normal, Lambertian albedo, each
    /// `array<vec4<f32>>`, and `array<u32>` of triangles, [`NO_TRIANGLE`] where nothing is seen. All of them 0 there.
    ///
    /// # Errors
    /// [`GpuError::EmptySize`], [`GpuError::Size`] for a buffer that does not hold `size` texels, [`GpuError::Usage`] for one without
    /// `STORAGE`.
    pub fn from_buffers(size: [u32; 2], buffers: [Buffer; 4]) -> Result<Self, GpuError> {
        Self::check_size(size)?;
        let bytes = [16, 16, 16, 4];
        let names = ["gbuffer_position", "gbuffer_normal", "gbuffer_albedo", "gbuffer_triangle"];
        for ((buffer, bytes), what) in buffers.iter().zip(bytes).zip(names) {
            if buffer.size() < bytes * texels(&size) {
                let found = [(buffer.size() / bytes) as u32, 1];
                return Err(GpuError::Size { what, needed: size, found });
            }
            let needed = wgpu::BufferUsages::STORAGE;
            if !buffer.usage().contains(needed) {
                return Err(GpuError::Usage { what, needed, found: buffer.usage() });
            }
        }
        let [gbuffer_position, gbuffer_normal, gbuffer_albedo, gbuffer_triangle] = buffers;
        let buffers = GBufferBuffers { gbuffer_position, gbuffer_normal, gbuffer_albedo, gbuffer_triangle };
        Ok(Self::of(buffers, size, None))
    }

    fn of(b: GBufferBuffers, size: [u32; 2], drawn: Option<Drawn>) -> Self {
        Self {
            position: b.gbuffer_position,
            normal: b.gbuffer_normal,
            albedo: b.gbuffer_albedo,
            triangle: b.gbuffer_triangle,
            size,
            drawn,
        }
    }

    fn check_size([width, height]: [u32; 2]) -> Result<(), GpuError> {
        if width == 0 || height == 0 {
            return Err(GpuError::EmptySize { what: "a G-buffer", width, height });
        }
        Ok(())
    }

    fn check(device: &Device, size: [u32; 2], count: usize) -> Result<(), GpuError> {
        Self::check_size(size)?;
        Self::plan_of_many(size, count).check(&device.limits())
    }

    fn within(
        device: &Device,
        size: [u32; 2],
        attachments: Attachments,
        tile: [u32; 2],
        (views, index): (Uniforms<ViewUniform>, usize),
    ) -> Result<Self, GpuError> {
        let b = GBufferBuffers::new(device, &size)?;
        let mut names = b.named();
        names.push(("view", views.binding(index)));
        names.push(("triangles", BindingResource::TextureView(&attachments.ids)));
        let group = |module: &indirect_shaders::Module, entry, stages| {
            let entry = module.entry_point(entry);
            let bindings = entry.map_or(&[][..], |e| e.bindings).iter().filter(|b| b.group == 1);
            let layout = bind_group_layout(device, 1, entry.as_slice(), stages);
            bind_group(device, &layout, "G-buffer", bindings, &[&names])
        };
        let visibility_group = group(&VISIBILITY, "visibility_masked", VISIBILITY_STAGES)?;
        let resolve_group = group(&RESOLVE, "resolve", ShaderStages::COMPUTE)?;
        let drawn = Drawn { views, index, attachments, tile, visibility_group, resolve_group };
        Ok(Self::of(b, size, Some(drawn)))
    }

    /// Sets what will be seen, from the next submission on; nothing to do where no [`Raster`] draws it.
    pub fn prepare(&self, queue: &Queue, view: &View) {
        Self::prepare_many(queue, [(self, view)]);
    }

    /// [`Self::prepare`] of several, those that are made by [`Self::many`] in as few writes as there are sets of render targets.
    pub fn prepare_many<'a>(queue: &Queue, views: impl IntoIterator<Item = (&'a Self, &'a View)>) {
        let drawn = views.into_iter().filter_map(|(t, view)| Some((t.size, t.drawn.as_ref()?, view)));
        let mut run: Option<(&Drawn, Vec<ViewUniform>)> = None;
        for (size, drawn, view) in drawn {
            let uniform = ViewUniform { tile: drawn.tile, ..ViewUniform::new(view, size, 0) };
            match &mut run {
                Some((first, values))
                    if first.views.is(&drawn.views) && drawn.index == first.index + values.len() =>
                {
                    values.push(uniform);
                }
                _ => {
                    if let Some((first, values)) = run.replace((drawn, vec![uniform])) {
                        first.views.write(queue, first.index, &values);
                    }
                }
            }
        }
        if let Some((first, values)) = run {
            first.views.write(queue, first.index, &values);
        }
    }

    /// Width and height, texels.
    #[must_use]
    pub const fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Its buffers as techniques bind them: `positions`, `normals`, `albedos`, `triangles`.
    #[must_use]
    pub fn named(&self) -> [Named<'_>; 4] {
        [
            named("positions", &self.position),
            named("normals", &self.normal),
            named("albedos", &self.albedo),
            named("triangles", &self.triangle),
        ]
    }

    /// Its buffers by the names under which shaders write them.
    pub(crate) fn results(&self) -> [Named<'_>; 4] {
        [
            named("gbuffer_position", &self.position),
            named("gbuffer_normal", &self.normal),
            named("gbuffer_albedo", &self.albedo),
            named("gbuffer_triangle", &self.triangle),
        ]
    }

    /// GPU memory, bytes, of an image that shares no render targets.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        if self.drawn.is_some() { Self::plan(self.size) } else { Self::plan_imported(self.size) }.bytes()
    }

    /// The image as the CPU has it. Submits and blocks.
    ///
    /// # Errors
    /// [`GpuError::ReadBack`].
    pub fn read(&self, device: &Device, queue: &Queue) -> Result<GBuffer, GpuError> {
        let position: Vec<Vec3Pad> = read_buffer(device, queue, &self.position)?;
        let normal: Vec<Vec3Pad> = read_buffer(device, queue, &self.normal)?;
        let albedo: Vec<Vec3Pad> = read_buffer(device, queue, &self.albedo)?;
        let vectors = |v: &[Vec3Pad]| v.iter().map(|v| v.vec3()).collect();
        Ok(GBuffer {
            size: self.size,
            triangle: read_buffer(device, queue, &self.triangle)?,
            depth: position.iter().map(|v| v.w).collect(),
            position: vectors(&position),
            normal: vectors(&normal),
            albedo: vectors(&albedo),
        })
    }

    /// Overwrites the image.
    pub fn write(&self, queue: &Queue, g: &GBuffer) {
        let pad = |v: &[glam::Vec3]| v.iter().map(|v| Vec3Pad::new(*v, 0.0)).collect::<Vec<_>>();
        let position = g.position.iter().zip(&g.depth).map(|(p, depth)| Vec3Pad::new(*p, *depth));
        let position: Vec<_> = position.collect();
        queue.write_buffer(&self.position, 0, bytemuck::cast_slice(&position));
        queue.write_buffer(&self.normal, 0, bytemuck::cast_slice(&pad(&g.normal)));
        queue.write_buffer(&self.albedo, 0, bytemuck::cast_slice(&pad(&g.albedo)));
        queue.write_buffer(&self.triangle, 0, bytemuck::cast_slice(&g.triangle));
    }
}

/// Render targets of one or several views: triangle numbers and depth.
#[derive(Debug, Clone)]
struct Attachments {
    ids: TextureView,
    depth: TextureView,
}

impl Attachments {
    fn plan(size: [u32; 2]) -> Plan {
        let mut plan = Plan::new();
        plan.texture("visibility", size, 4);
        plan.texture("depth", size, 4);
        plan
    }

    fn new(device: &Device, [width, height]: [u32; 2]) -> Self {
        let attachment = |label, format, usage| {
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: usage | TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            });
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        };
        Self {
            ids: attachment("visibility", ID_FORMAT, TextureUsages::TEXTURE_BINDING),
            depth: attachment("depth", DEPTH_FORMAT, TextureUsages::empty()),
        }
    }
}

/// Views that share render targets, in rows of `columns`.
struct Grid {
    count: usize,
    columns: u32,
}

impl Grid {
    /// Width and height of the render targets.
    fn texels(&self, [width, height]: [u32; 2]) -> [u32; 2] {
        [self.columns * width, (self.count as u32).div_ceil(self.columns) * height]
    }
}

/// Side that render targets of several views do not exceed: what any WebGPU device has.
const LARGEST_SHARED: u32 = 8192;

/// `count` views of `size` texels in as few and as square render targets as there can be.
fn grids([width, height]: [u32; 2], count: usize) -> Vec<Grid> {
    let along = |side: u32| (LARGEST_SHARED / side.max(1)).max(1);
    let most = along(width) as usize * along(height) as usize;
    let mut grids = Vec::new();
    let mut left = count;
    while left > 0 {
        let here = left.min(most);
        // The fewest columns that need no more rows than there is room for, and make a square or less.
        let least = (here as u32).div_ceil(along(height));
        let columns = (here as f64).sqrt().ceil() as u32;
        grids.push(Grid { count: here, columns: columns.max(least).min(along(width)) });
        left -= here;
    }
    grids
}

const VISIBILITY_STAGES: ShaderStages = ShaderStages::VERTEX_FRAGMENT;

/// What a [`View`] sees, for cameras and light's maps alike: the GPU twin of `indirect_accel::cast::gbuffer`.
///
/// A visibility pass draws triangle numbers and reversed depth, a compute pass resolves them to a [`GBufferTarget`].
#[derive(Debug, Clone)]
pub struct Raster {
    opaque: RenderPipeline,
    masked: RenderPipeline,
    resolve: Kernel,
}

impl Raster {
    /// Builds the pipelines.
    #[must_use]
    pub fn new(device: &Device) -> Self {
        let shader = shader_module(device, &VISIBILITY);
        let scene = scene_layout(device);
        let entry = VISIBILITY.entry_point("visibility_masked");
        let view = bind_group_layout(device, 1, entry.as_slice(), VISIBILITY_STAGES);
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("visibility"),
            bind_group_layouts: &[Some(&scene), Some(&view)],
            ..Default::default()
        });
        let pipeline = |fragment| {
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(fragment),
                layout: Some(&layout),
                vertex: wgpu::VertexState {
                    module: &shader,
                    entry_point: Some("visibility_vertex"),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    buffers: &[],
                },
                primitive: wgpu::PrimitiveState::default(),
                depth_stencil: Some(wgpu::DepthStencilState {
                    format: DEPTH_FORMAT,
                    depth_write_enabled: Some(true),
                    depth_compare: Some(CompareFunction::Greater),
                    stencil: wgpu::StencilState::default(),
                    bias: wgpu::DepthBiasState::default(),
                }),
                multisample: wgpu::MultisampleState::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &shader,
                    entry_point: Some(fragment),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    targets: &[Some(ID_FORMAT.into())],
                }),
                multiview_mask: None,
                cache: None,
            })
        };
        Self {
            opaque: pipeline("visibility"),
            masked: pipeline("visibility_masked"),
            resolve: Kernel::with_shared(device, &RESOLVE, "resolve", &scene),
        }
    }

    /// Encodes, under the name `name`, what the views of `targets` see of `scene`; [`GBufferTarget::prepare`] sets them.
    pub fn encode<'a>(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        name: &'static str,
        scene: &SceneBuffers,
        targets: impl IntoIterator<Item = &'a GBufferTarget, IntoIter: Clone>,
    ) {
        let targets = targets.into_iter().filter_map(|t| t.drawn.as_ref().map(|drawn| (t.size, drawn)));
        let pipeline = if scene.is_masked() { &self.masked } else { &self.opaque };
        let mut rest = targets.clone().peekable();
        if rest.peek().is_none() {
            return;
        }
        while let Some((size, first)) = rest.next() {
            let pass = wgpu::RenderPassDescriptor {
                label: None,
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &first.attachments.ids,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(BACKGROUND),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &first.attachments.depth,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(0.0),
                        store: wgpu::StoreOp::Discard,
                    }),
                    stencil_ops: None,
                }),
                timestamp_writes: None,
                occlusion_query_set: None,
                multiview_mask: None,
            };
            timer.render(encoder, name, &pass, |pass| {
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, scene.group(), &[]);
                let draw = |pass: &mut wgpu::RenderPass<'_>, [width, height]: [u32; 2], target: &Drawn| {
                    let [x, y] = target.tile;
                    pass.set_viewport(x as f32, y as f32, width as f32, height as f32, 0.0, 1.0);
                    pass.set_scissor_rect(x, y, width, height);
                    pass.set_bind_group(1, &target.visibility_group, &[]);
                    pass.draw(0..3 * scene.triangles(), 0..1);
                };
                draw(pass, size, first);
                // Those that share the render targets.
                while let Some((size, next)) = rest.next_if(|t| t.1.attachments.ids == first.attachments.ids)
                {
                    draw(pass, size, next);
                }
            });
        }
        timer.compute(encoder, name, |pass| {
            for (size, target) in targets {
                self.resolve.set(pass, [scene.group(), &target.resolve_group].into_iter());
                let [x, y, z] = workgroups_2d(size, [8, 8]);
                pass.dispatch_workgroups(x, y, z);
            }
        });
    }
}

const BACKGROUND: wgpu::Color = wgpu::Color { r: NO_TRIANGLE as f64, g: 0.0, b: 0.0, a: 0.0 };

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shared_targets_have_room_for_all_and_little_more() {
        for side in [1, 45, 512, 2048, 3000, 8192, 10_000] {
            for count in [0, 1, 2, 6, 7, 24, 100] {
                let grids = grids([side; 2], count);
                assert_eq!(grids.iter().map(|g| g.count).sum::<usize>(), count);
                for g in &grids {
                    let [w, h] = g.texels([side; 2]);
                    assert!(w.max(h) <= LARGEST_SHARED.max(side), "{side} {count}: {w}×{h}");
                    let cells = (w / side * (h / side)) as usize;
                    assert!(cells >= g.count && cells < g.count + g.columns as usize, "{side} {count}");
                }
            }
        }
    }
}
