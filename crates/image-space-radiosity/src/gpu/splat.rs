use indirect_gpu::shaders::IMAGE_SPACE_RADIOSITY_SPLAT as SPLAT;
use indirect_gpu::wgpu::{
    BindingResource, BlendComponent, BlendFactor, BlendOperation, BlendState, ColorTargetState, ColorWrites,
    Device, Extent3d, Features, FragmentState, MultisampleState, PipelineCompilationOptions,
    PipelineLayoutDescriptor, PrimitiveState, PrimitiveTopology, RenderPipelineDescriptor, ShaderStages,
    TextureDescriptor, TextureDimension, TextureFormat, TextureUsages, TextureView, TextureViewDescriptor,
    VertexState,
};
use indirect_gpu::{GpuError, Pass, bind_group, bind_group_layout, named, shader_module};

use super::{buffers::SPLAT_ARGUMENTS, passes::Build};
use crate::settings::Method;

/// Irradiance on fragments, or on pixels for bounded splats, by blending.
pub(crate) fn splat(b: &Build<'_>, pass: &mut Pass) -> Result<(), GpuError> {
    let (own, device) = (&b.buffers.own, b.pipelines.device());
    let bounded = b.setup.options.method == Method::BoundedSplat;
    let (entries, topology, [positions, normals, sums]) = if bounded {
        // The list of lights is on the GPU only: its length becomes the number of instances.
        pass.copy("totals", (&b.buffers.list.buffers.count, 0), (&own.totals, SPLAT_ARGUMENTS + 4), 4);
        let entries = ["splat_bounded_vertex", "splat_bounded"];
        let buffers = [&b.camera.position, &b.camera.normal, &own.irradiance];
        (entries, PrimitiveTopology::TriangleList, buffers)
    } else {
        let buffers = [&own.fragment_positions, &own.fragment_normals, &own.gathered];
        (["splat_vertex", "splat"], PrimitiveTopology::PointList, buffers)
    };
    let lights = &b.buffers.list.buffers.vpls;
    let drawn = [("vpls", lights), ("positions", positions), ("normals", normals)];
    drawn.iter().for_each(|(name, buffer)| pass.note(name, buffer, false));
    let format = format(device);
    let target = target(device, b.sizes.splats(), format);
    let known: Vec<_> = entries.iter().filter_map(|entry| SPLAT.entry_point(entry)).collect();
    let layout = bind_group_layout(device, 0, &known, ShaderStages::VERTEX_FRAGMENT);
    let mut bindings: Vec<_> = known.iter().flat_map(|e| e.bindings).collect();
    bindings.sort_unstable_by_key(|b| b.binding);
    bindings.dedup();
    let group = bind_group(
        device,
        &layout,
        "splat",
        bindings.into_iter(),
        &[b.named(), &drawn.map(|(name, buffer)| named(name, buffer))],
    )?;

    let shader = shader_module(device, &SPLAT);
    let [vertex, fragment] = entries.map(Some);
    let compilation_options = PipelineCompilationOptions::default();
    let (src_factor, dst_factor) = (BlendFactor::One, BlendFactor::One);
    let add = BlendComponent { src_factor, dst_factor, operation: BlendOperation::Add };
    let blend = Some(BlendState { color: add, alpha: add });
    let layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
        label: Some("splat"),
        bind_group_layouts: &[Some(&layout)],
        ..PipelineLayoutDescriptor::default()
    });
    let pipeline = device.create_render_pipeline(&RenderPipelineDescriptor {
        label: fragment,
        layout: Some(&layout),
        vertex: VertexState {
            module: &shader,
            entry_point: vertex,
            compilation_options: compilation_options.clone(),
            buffers: &[],
        },
        primitive: PrimitiveState { topology, ..PrimitiveState::default() },
        depth_stencil: None,
        multisample: MultisampleState::default(),
        fragment: Some(FragmentState {
            module: &shader,
            entry_point: fragment,
            compilation_options,
            targets: &[Some(ColorTargetState { format, blend, write_mask: ColorWrites::ALL })],
        }),
        multiview_mask: None,
        cache: None,
    });
    pass.draw(&pipeline, group, &target, (&own.totals, SPLAT_ARGUMENTS));

    let [width, height] = b.sizes.splats();
    let texture = ("target_texture", BindingResource::TextureView(&target));
    let texels = u64::from(width) * u64::from(height);
    b.compute(pass, (&SPLAT, "splat_resolve"), texels, &[texture, named("sums", sums)])
}

/// Sums need their digits, but blending 32-bit floats is optional in WebGPU.
fn format(device: &Device) -> TextureFormat {
    if device.features().contains(Features::FLOAT32_BLENDABLE) {
        TextureFormat::Rgba32Float
    } else {
        TextureFormat::Rgba16Float
    }
}

fn target(device: &Device, [width, height]: [u32; 2], format: TextureFormat) -> TextureView {
    let texture = device.create_texture(&TextureDescriptor {
        label: Some("splats"),
        size: Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format,
        usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&TextureViewDescriptor::default())
}
