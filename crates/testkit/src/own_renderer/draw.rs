//! The renderer itself: wgpu and nothing of this workspace but the read-back.

use glam::{Mat4, Vec3};
use half::f16;
use indirect_core::Image;
use indirect_gpu::read_buffer;
use indirect_gpu::wgpu::{
    self, BindGroup, Buffer, BufferUsages, CommandEncoder, Device, Extent3d, Queue, RenderPipeline,
    TextureFormat, TextureUsages, TextureView,
};

use super::frame::{Frame, INSTANCES, SIZE, albedo};

const DEPTH: TextureFormat = TextureFormat::Depth32Float;
const NORMAL: TextureFormat = TextureFormat::Rgb10a2Unorm;
const ALBEDO: TextureFormat = TextureFormat::Rgba8UnormSrgb;
const INDIRECT: TextureFormat = TextureFormat::Rgba16Float;

/// A renderer with a G-buffer.
#[derive(Debug)]
pub struct Renderer {
    /// Its device.
    pub device: Device,
    /// Its queue.
    pub queue: Queue,
    /// Depth, reversed.
    pub depth: TextureView,
    /// Normals `n · ½ + ½`.
    pub normal: TextureView,
    /// Albedo, sRGB.
    pub albedo: TextureView,
    /// Where it wants indirect light, half floats.
    pub indirect: TextureView,
    pipeline: RenderPipeline,
    camera: Buffer,
    instances: Buffer,
    group: BindGroup,
}

impl Renderer {
    /// A renderer on a device.
    #[must_use]
    pub fn new(device: &Device, queue: &Queue) -> Self {
        let texture = |format, usage| {
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            });
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        };
        let drawn = TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING;
        let shader = device.create_shader_module(wgpu::include_wgsl!("draw.wgsl"));
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: None,
            vertex: wgpu::VertexState {
                module: &shader,
                entry_point: Some("vertex"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &shader,
                entry_point: Some("fragment"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(NORMAL.into()), Some(ALBEDO.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let buffer = |size, usage| {
            let usage = usage | BufferUsages::COPY_DST;
            device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let camera = buffer(64, BufferUsages::UNIFORM);
        let instances = buffer(80 * INSTANCES as u64, BufferUsages::STORAGE);
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: camera.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: instances.as_entire_binding() },
            ],
        });
        Self {
            device: device.clone(),
            queue: queue.clone(),
            depth: texture(DEPTH, drawn),
            normal: texture(NORMAL, drawn),
            albedo: texture(ALBEDO, drawn),
            indirect: texture(INDIRECT, TextureUsages::STORAGE_BINDING | TextureUsages::COPY_SRC),
            pipeline,
            camera,
            instances,
            group,
        }
    }

    /// Draws the G-buffer of a frame.
    pub fn draw(&self, encoder: &mut CommandEncoder, frame: &Frame) {
        self.queue.write_buffer(&self.camera, 0, bytemuck::bytes_of(&frame.clip_from_world.to_cols_array()));
        let mut data: Vec<[f32; 20]> = Vec::new();
        for (i, world) in frame.instances.iter().enumerate() {
            let mut row = [0.0; 20];
            row[..16].copy_from_slice(&Mat4::from(*world).to_cols_array());
            row[16..19].copy_from_slice(&albedo(i).to_array());
            data.push(row);
        }
        self.queue.write_buffer(&self.instances, 0, bytemuck::cast_slice(&data));
        let color = |view| {
            let ops = wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                store: wgpu::StoreOp::Store,
            };
            Some(wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops })
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[color(&self.normal), color(&self.albedo)],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.draw(0..6, 0..INSTANCES as u32);
    }

    /// What the technique left in `indirect`. Submits and blocks.
    ///
    /// # Errors
    /// [`GpuError::ReadBack`](indirect_gpu::GpuError::ReadBack).
    pub fn read_indirect(&self) -> Result<Image, indirect_gpu::GpuError> {
        // Rows of a copy begin at multiples of 256 bytes; 8 bytes a texel.
        let row = (8 * SIZE[0]).next_multiple_of(256);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(row * SIZE[1]),
            usage: BufferUsages::COPY_DST | BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_texture_to_buffer(
            self.indirect.texture().as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row),
                    rows_per_image: None,
                },
            },
            Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
        );
        self.queue.submit([encoder.finish()]);
        let texels: Vec<[u16; 4]> = read_buffer(&self.device, &self.queue, &buffer)?;
        let value = |h| f16::from_bits(h).to_f32();
        let pixels = texels
            .chunks(row as usize / 8)
            .flat_map(|r| &r[..SIZE[0] as usize])
            .map(|&[r, g, b, _]| Vec3::new(value(r), value(g), value(b)));
        Ok(Image { size: SIZE, pixels: pixels.collect() })
    }
}
