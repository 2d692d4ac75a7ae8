// A scene's triangles, materials and texels as storage buffers. Needs core/texture.wgsl.
// Twin: indirect_core::Scene; uploaded and laid out by indirect_gpu::SceneBuffers.

struct Material {
    base_color: vec3<f32>,
    metallic: f32,
    base_alpha: f32,
    /// Texels of less alpha are holes; negative where the material is opaque.
    alpha_cutoff: f32,
    base_color_texture: TextureRef,
    metallic_roughness_texture: TextureRef,
}

struct SceneInfo {
    /// `vec4`s per vertex: (position, u), (normal, v) and, where it is 3, (colour, 0).
    vertex_stride: u32,
    triangles: u32,
}

const NO_TRIANGLE: u32 = 0xffffffffu;

@group(0) @binding(0) var<storage, read> scene_vertices: array<vec4<f32>>;
/// Three vertices and a material.
@group(0) @binding(1) var<storage, read> scene_triangles: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> scene_materials: array<Material>;
/// RGBA as two pairs of 16-bit unsigned normalized numbers.
@group(0) @binding(3) var<storage, read> scene_texels: array<vec2<u32>>;
@group(0) @binding(4) var<uniform> scene_info: SceneInfo;

fn scene_position(vertex: u32) -> vec3<f32> {
    return scene_vertices[vertex * scene_info.vertex_stride].xyz;
}

/// Linear vertex colour, white where the scene has none.
fn scene_color(vertex: u32) -> vec3<f32> {
    if scene_info.vertex_stride < 3u {
        return vec3<f32>(1.0);
    }
    return scene_vertices[vertex * scene_info.vertex_stride + 2u].xyz;
}
