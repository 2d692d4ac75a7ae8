// From an image in a storage buffer to a texture of half floats. Needs core/grid.wgsl. Host: indirect_gpu::ImageExport.

@group(0) @binding(0) var<uniform> export_size: vec2<u32>;
@group(0) @binding(1) var<storage, read> image: array<vec4<f32>>;
@group(0) @binding(2) var export_texture: texture_storage_2d<rgba16float, write>;

/// The largest half float: what is brighter would become infinite.
const EXPORT_LARGEST: f32 = 65504.0;

@compute @workgroup_size(64)
fn export_texels(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i >= export_size.x * export_size.y {
        return;
    }
    let radiance = min(image[i].xyz, vec3<f32>(EXPORT_LARGEST));
    textureStore(export_texture, vec2<u32>(i % export_size.x, i / export_size.x), vec4<f32>(radiance, 1.0));
}
