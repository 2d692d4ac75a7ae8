//! Radiance hints as a system of Bevy's render schedule.

use bevy::core_pipeline::{Core3d, Core3dSystems};
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::camera::ExtractedCamera;
use bevy::render::renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery};
use bevy::render::view::{ExtractedView, ViewTarget};
use indirect_accel::{Accel, BuildPreset};
use indirect_core::{MapView, Scene, View};
use indirect_gpu::wgpu;
use indirect_gpu::{GBufferTarget, PassTimer, Pipelines, SceneBuffers};
use radiance_hints::cpu::Fit;
use radiance_hints::gpu::{Inputs, Resources};
use radiance_hints::{Options, Params, RadianceHints, Setup};

/// What does not move: for the lights' maps and for what surrounds the lattice.
#[derive(Resource, Clone)]
pub struct StaticScene(pub Scene);

/// Adds indirect light to every 3D camera.
pub struct HintsPlugin(pub Scene);

impl Plugin for HintsPlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app.insert_resource(StaticScene(self.0.clone())).init_resource::<Made>().add_systems(
            Core3d,
            indirect_light.after(Core3dSystems::MainPass).before(Core3dSystems::EarlyPostProcess),
        );
    }
}

/// Made when the first frame asks for it.
#[derive(Resource, Default)]
struct Made(Option<Hints>);

/// Buffers and passes for one size of the image.
struct Hints {
    pipelines: Pipelines,
    scene: SceneBuffers,
    camera: GBufferTarget,
    setup: Setup,
    views: Vec<MapView>,
    resources: Resources,
    add: Add,
}

impl Hints {
    fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        scene: &Scene,
        size: [u32; 2],
        format: wgpu::TextureFormat,
    ) -> Result<Self, BevyError> {
        let pipelines = Pipelines::new(device);
        let camera = GBufferTarget::new(device, size)?;
        let accel = Accel::build(scene, BuildPreset::Fast);
        let setup = RadianceHints::fit(&accel, Options::default(), Params::default())?;
        let views = rsm::views::views(scene);
        let resources = Resources::new(&pipelines, queue, &setup, views.len(), &camera)?;
        let add = Add::new(device, resources.image(), size, format);
        let scene = SceneBuffers::upload(device, scene)?;
        Ok(Self { pipelines, scene, camera, setup, views, resources, add })
    }
}

fn indirect_light(
    view: ViewQuery<(&ExtractedView, &ViewTarget, &ExtractedCamera)>,
    scene: Res<StaticScene>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    mut made: ResMut<Made>,
    mut context: RenderContext,
) -> Result {
    let (view, target, camera) = view.into_inner();
    let [_, _, width, height] = view.viewport.to_array();
    let (size, format) = ([width, height], target.main_texture_format());
    let (device, queue): (&wgpu::Device, &wgpu::Queue) = (device.wgpu_device(), &queue);
    let hints = match &mut made.0 {
        Some(hints) if hints.camera.size() == size => hints,
        slot => slot.insert(Hints::new(device, queue, &scene.0, size, format)?),
    };
    // Bevy's matrix: right-handed, depth reversed, no far plane.
    let clip_from_world =
        view.clip_from_world.unwrap_or_else(|| view.clip_from_view * view.world_from_view.to_matrix().inverse());
    let seen = View::from_clip(&clip_from_world)?.view;
    hints.camera.prepare(queue, &seen);
    let inputs = Inputs { lights: &scene.0.lights, views: &hints.views, camera: &seen };
    hints.resources.prepare(queue, &inputs, &hints.setup)?;
    hints.add.prepare(queue, camera.exposure);
    let encoder = context.command_encoder();
    let timer = &mut PassTimer::off();
    hints.pipelines.raster().encode(encoder, timer, "camera", &hints.scene, [&hints.camera]);
    hints.resources.encode(encoder, timer, &hints.scene);
    hints.add.encode(encoder, target.main_texture_view());
    Ok(())
}

/// Adds an image to Bevy's.
struct Add {
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    settings: wgpu::Buffer,
    size: [u32; 2],
}

impl Add {
    fn new(device: &wgpu::Device, image: &wgpu::Buffer, size: [u32; 2], format: wgpu::TextureFormat) -> Self {
        let shader = device.create_shader_module(wgpu::include_wgsl!("add.wgsl"));
        let component = wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::One,
            dst_factor: wgpu::BlendFactor::One,
            operation: wgpu::BlendOperation::Add,
        };
        let target = wgpu::ColorTargetState {
            format,
            blend: Some(wgpu::BlendState { color: component, alpha: component }),
            write_mask: wgpu::ColorWrites::ALL,
        };
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("indirect light"),
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
                targets: &[Some(target)],
            }),
            multiview_mask: None,
            cache: None,
        });
        let settings = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("indirect light"),
            size: 16,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("indirect light"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: settings.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: image.as_entire_binding() },
            ],
        });
        Self { pipeline, group, settings, size }
    }

    fn prepare(&self, queue: &wgpu::Queue, scale: f32) {
        let [width, height] = self.size;
        queue.write_buffer(&self.settings, 0, bytemuck::cast_slice(&[width, height, scale.to_bits(), 0]));
    }

    fn encode(&self, encoder: &mut wgpu::CommandEncoder, target: &wgpu::TextureView) {
        let ops = wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store };
        let attachment = wgpu::RenderPassColorAttachment { view: target, depth_slice: None, resolve_target: None, ops };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(attachment)],
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.draw(0..3, 0..1);
    }
}
