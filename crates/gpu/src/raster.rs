use indirect_core::{GBuffer, NO_TRIANGLE, View};
use indirect_shaders::{RESOLVE, VISIBILITY};
use wgpu::{
    Buffer, CommandEncoder, CompareFunction, Device, Queue, RenderPipeline, TextureFormat, TextureUsages,
    TextureView,
};

use crate::kernel::bind_group;
use crate::layout::{Vec3Pad, ViewUniform};
use crate::{
    GpuError, Kernel, PassTimer, SceneBuffers, empty_storage_buffer, read_buffer, shader_module,
    uniform_buffer, workgroups_2d,
};

const ID_FORMAT: TextureFormat = TextureFormat::R32Uint;
const DEPTH_FORMAT: TextureFormat = TextureFormat::Depth32Float;

/// What views see, in storage buffers: `layers` images of one size, one after the other, each row-major, top row first.
///
/// Where nothing is seen `triangle` is [`NO_TRIANGLE`] and everything else 0.
#[derive(Debug)]
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
    layers: u32,
    ids: TextureView,
    depth: TextureView,
}

impl GBufferTarget {
    /// Buffers for `layers` images of `size` texels.
    ///
    /// # Errors
    /// [`GpuError::EmptySize`], and [`GpuError::Limit`] where the device has no textures or buffers of that size.
    pub fn new(device: &Device, size: [u32; 2], layers: u32) -> Result<Self, GpuError> {
        let [width, height] = size;
        if width == 0 || height == 0 || layers == 0 {
            return Err(GpuError::EmptySize { what: "a G-buffer", width, height });
        }
        let (limit, available) = ("max_texture_dimension_2d", device.limits().max_texture_dimension_2d);
        let needed = width.max(height);
        if needed > available {
            let (needed, available) = (needed.into(), available.into());
            return Err(GpuError::Limit { what: "a G-buffer's side", limit, needed, available });
        }
        let count = u64::from(width) * u64::from(height) * u64::from(layers);
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
        Ok(Self {
            position: empty_storage_buffer::<Vec3Pad>(device, "G-buffer position", count)?,
            normal: empty_storage_buffer::<Vec3Pad>(device, "G-buffer normal", count)?,
            albedo: empty_storage_buffer::<Vec3Pad>(device, "G-buffer albedo", count)?,
            triangle: empty_storage_buffer::<u32>(device, "G-buffer triangle", count)?,
            size,
            layers,
            ids: attachment("visibility", ID_FORMAT, TextureUsages::TEXTURE_BINDING),
            depth: attachment("depth", DEPTH_FORMAT, TextureUsages::empty()),
        })
    }

    /// Width and height of one layer, texels.
    #[must_use]
    pub const fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Number of layers.
    #[must_use]
    pub const fn layers(&self) -> u32 {
        self.layers
    }

    /// GPU memory, bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let attachments = u64::from(self.size[0]) * u64::from(self.size[1]) * 8;
        [&self.position, &self.normal, &self.albedo, &self.triangle].map(Buffer::size).iter().sum::<u64>()
            + attachments
    }

    /// The layers as the CPU has them. Submits and blocks.
    ///
    /// # Errors
    /// [`GpuError::ReadBack`].
    pub fn read(&self, device: &Device, queue: &Queue) -> Result<Vec<GBuffer>, GpuError> {
        let position: Vec<Vec3Pad> = read_buffer(device, queue, &self.position)?;
        let normal: Vec<Vec3Pad> = read_buffer(device, queue, &self.normal)?;
        let albedo: Vec<Vec3Pad> = read_buffer(device, queue, &self.albedo)?;
        let triangle: Vec<u32> = read_buffer(device, queue, &self.triangle)?;
        let texels = self.size[0] as usize * self.size[1] as usize;
        let vectors = |v: &[Vec3Pad]| v.iter().map(|v| v.vec3()).collect();
        Ok((0..self.layers as usize)
            .map(|layer| {
                let layer = layer * texels..(layer + 1) * texels;
                GBuffer {
                    size: self.size,
                    triangle: triangle[layer.clone()].to_vec(),
                    depth: position[layer.clone()].iter().map(|v| v.w).collect(),
                    position: vectors(&position[layer.clone()]),
                    normal: vectors(&normal[layer.clone()]),
                    albedo: vectors(&albedo[layer]),
                }
            })
            .collect())
    }
}

/// What a [`View`] sees, for cameras and light's maps alike: the GPU twin of `indirect_accel::cast::gbuffer`.
///
/// A visibility pass draws triangle numbers and reversed depth, a compute pass resolves them to a [`GBufferTarget`].
#[derive(Debug)]
pub struct Raster {
    device: Device,
    opaque: RenderPipeline,
    masked: RenderPipeline,
    resolve: Kernel,
}

impl Raster {
    /// Builds the pipelines.
    #[must_use]
    pub fn new(device: &Device) -> Self {
        let shader = shader_module(device, &VISIBILITY);
        let pipeline = |fragment| {
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(fragment),
                layout: None,
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
            device: device.clone(),
            opaque: pipeline("visibility"),
            masked: pipeline("visibility_masked"),
            resolve: Kernel::new(device, &RESOLVE, "resolve", &[]),
        }
    }

    /// Encodes both passes for what `view` sees of `scene`, into one layer of `target`. The target's other layers keep
    /// their contents; one command buffer may fill them all.
    ///
    /// # Errors
    /// [`GpuError::Limit`] where `target` has no such layer.
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        scene: &SceneBuffers,
        view: &View,
        target: &GBufferTarget,
        layer: u32,
    ) -> Result<(), GpuError> {
        if layer >= target.layers {
            let (needed, available) = (u64::from(layer) + 1, target.layers.into());
            return Err(GpuError::Limit { what: "a view", limit: "number of layers", needed, available });
        }
        let device = &self.device;
        let view = ViewUniform::new(view, target.size, layer * target.size[0] * target.size[1]);
        // A buffer per call: a shared one would hold the last view only when several are encoded before one submit.
        let view = uniform_buffer(device, "view", &view);
        let view = (0, view.as_entire_binding());
        let bindings = scene.bindings();
        let (pipeline, used): (_, &[usize]) =
            if scene.is_masked() { (&self.masked, &[0, 1, 2, 3, 4]) } else { (&self.opaque, &[0, 1, 4]) };
        let layout = |group| pipeline.get_bind_group_layout(group);
        let used: Vec<_> = used.iter().map(|i| bindings[*i].clone()).collect();
        let scene_group = bind_group(device, &layout(0), "visibility scene", &used);
        let view_group = bind_group(device, &layout(1), "visibility view", core::slice::from_ref(&view));
        let background = wgpu::Color { r: NO_TRIANGLE.into(), g: 0.0, b: 0.0, a: 0.0 };
        let pass = wgpu::RenderPassDescriptor {
            label: None,
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &target.ids,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(background), store: wgpu::StoreOp::Store },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &target.depth,
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
        timer.render(encoder, "visibility", &pass, |pass| {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &scene_group, &[]);
            pass.set_bind_group(1, &view_group, &[]);
            pass.draw(0..3 * scene.triangles(), 0..1);
        });
        let scene_group = self.resolve.bind(device, 0, &bindings);
        let outputs = [&target.position, &target.normal, &target.albedo, &target.triangle];
        let mut resources = vec![view, (1, wgpu::BindingResource::TextureView(&target.ids))];
        resources.extend((2..).zip(outputs.map(Buffer::as_entire_binding)));
        let view_group = self.resolve.bind(device, 1, &resources);
        let workgroups = workgroups_2d(target.size, [8, 8]);
        self.resolve.dispatch(encoder, timer, &[&scene_group, &view_group], workgroups);
        Ok(())
    }
}
