//! Indirect radiance as a picture.

use indirect_gpu::wgpu::{
    self, BindGroup, Buffer, BufferUsages, CommandEncoder, Device, Queue, RenderPipeline, TextureFormat,
    TextureView,
};

/// Draws an image to a target.
#[derive(Debug)]
pub struct Display {
    pipeline: RenderPipeline,
    group: BindGroup,
    settings: Buffer,
    size: [u32; 2],
    encode: bool,
}

impl Display {
    /// For `image`, `array<vec4<f32>>` of `size` pixels, on targets of `format`.
    #[must_use]
    pub fn new(device: &Device, format: TextureFormat, image: &Buffer, size: [u32; 2]) -> Self {
        let shader = device.create_shader_module(wgpu::include_wgsl!("display.wgsl"));
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("display"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &shader,
                entry_point: Some("vertex"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &shader,
                entry_point: Some("fragment"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let settings = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("display settings"),
            size: 16,
            usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("display"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: settings.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: image.as_entire_binding() },
            ],
        });
        Self { pipeline, group, settings, size, encode: !format.is_srgb() }
    }

    /// Encodes the picture.
    pub fn encode(&self, queue: &Queue, encoder: &mut CommandEncoder, target: &TextureView, exposure: f32) {
        let [width, height] = self.size;
        let settings = [width, height, exposure.to_bits(), u32::from(self.encode)];
        queue.write_buffer(&self.settings, 0, bytemuck::cast_slice(&settings));
        let ops =
            wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store };
        let attachment =
            wgpu::RenderPassColorAttachment { view: target, depth_slice: None, resolve_target: None, ops };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(attachment)],
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.draw(0..3, 0..1);
    }
}
