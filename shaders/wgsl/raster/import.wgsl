// From the textures of a renderer's G-buffer to ours. Needs core/{grid,view,octahedral}.wgsl. Host: indirect_gpu::GBufferImport.
// Twin: indirect_gpu::import_texel.

const IMPORT_NO_TRIANGLE: u32 = 0xffffffffu;
/// A surface that is no triangle of a scene that we know.
const IMPORT_FOREIGN: u32 = 0xfffffffeu;
const IMPORT_DEPTH_VIEW: u32 = 1u;
const IMPORT_NORMAL_UNORM: u32 = 1u;
const IMPORT_NORMAL_OCTAHEDRAL: u32 = 2u;
const IMPORT_NORMAL_OCTAHEDRAL_UNORM: u32 = 3u;

struct Import {
    view: View,
    /// How far the image is shifted off the view's axis, in NDC.
    offset: vec2<f32>,
    /// View depth from NDC depth z: scale / (z - shift), or (z - shift) / scale where the view is orthographic.
    scale: f32,
    shift: f32,
    /// NDC depth where nothing was drawn.
    background: f32,
    /// 0 NDC depth, 1 view depth.
    depth: u32,
    /// 0 components, 1 components from [0, 1], 2 octahedral, 3 octahedral from [0, 1].
    normal: u32,
    /// 1 where normals are along the view's axes, right, up and backward.
    view_space: u32,
    /// 1 where the albedo's components are encoded as sRGB.
    srgb: u32,
}

@group(0) @binding(0) var<uniform> import_settings: Import;
@group(0) @binding(1) var import_depth: texture_2d<f32>;
@group(0) @binding(2) var import_normal: texture_2d<f32>;
@group(0) @binding(3) var import_albedo: texture_2d<f32>;
@group(0) @binding(4) var<storage, read_write> gbuffer_position: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read_write> gbuffer_normal: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read_write> gbuffer_albedo: array<vec4<f32>>;
@group(0) @binding(7) var<storage, read_write> gbuffer_triangle: array<u32>;

fn import_linear(c: vec3<f32>) -> vec3<f32> {
    return select(pow((c + 0.055) / 1.055, vec3<f32>(2.4)), c / 12.92, c <= vec3<f32>(0.04045));
}

/// The normal of a texel along the axes of the world, of length 1; 0 where it has none.
fn import_normal_of(s: Import, texel: vec3<f32>) -> vec3<f32> {
    var n = texel;
    if s.normal == IMPORT_NORMAL_UNORM || s.normal == IMPORT_NORMAL_OCTAHEDRAL_UNORM {
        n = n * 2.0 - 1.0;
    }
    if s.normal == IMPORT_NORMAL_OCTAHEDRAL || s.normal == IMPORT_NORMAL_OCTAHEDRAL_UNORM {
        n = octahedral_decode(clamp(n.xy, vec2<f32>(-1.0), vec2<f32>(1.0)));
    }
    let squared = dot(n, n);
    // Also false where it is not a number.
    if !(squared > 1e-6 && squared < 1e6) {
        return vec3<f32>(0.0);
    }
    n = n / sqrt(squared);
    if s.view_space != 0u {
        n = s.view.right * n.x + s.view.up * n.y - s.view.forward * n.z;
    }
    return n;
}

/// View depth of a texel; 0 or less, or not a number, where it sees nothing.
fn import_view_depth(s: Import, z: f32) -> f32 {
    if s.depth == IMPORT_DEPTH_VIEW {
        return z;
    }
    if z == s.background {
        return 0.0;
    }
    if s.view.orthographic != 0u {
        return (z - s.shift) / s.scale;
    }
    return s.scale / (z - s.shift);
}

@compute @workgroup_size(64)
fn import_texels(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let s = import_settings;
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i >= s.view.size.x * s.view.size.y {
        return;
    }
    let at = vec2<u32>(i % s.view.size.x, i / s.view.size.x);
    let depth = import_view_depth(s, textureLoad(import_depth, at, 0).x);
    let normal = import_normal_of(s, textureLoad(import_normal, at, 0).xyz);
    if !(depth > 0.0 && depth < 1e30) || all(normal == vec3<f32>(0.0)) {
        gbuffer_triangle[i] = IMPORT_NO_TRIANGLE;
        gbuffer_position[i] = vec4<f32>(0.0);
        gbuffer_normal[i] = vec4<f32>(0.0);
        gbuffer_albedo[i] = vec4<f32>(0.0);
        return;
    }
    // The pixel at which the view, which has no jitter, sees the point.
    let pixel = vec2<f32>(at) + 0.5 - vec2<f32>(s.offset.x, -s.offset.y) * 0.5 * vec2<f32>(s.view.size);
    let plane = view_plane_point(s.view, pixel);
    let lateral = (s.view.right * plane.x + s.view.up * plane.y) * select(depth, 1.0, s.view.orthographic != 0u);
    var albedo = clamp(textureLoad(import_albedo, at, 0).xyz, vec3<f32>(0.0), vec3<f32>(1.0));
    if s.srgb != 0u {
        albedo = import_linear(albedo);
    }
    gbuffer_triangle[i] = IMPORT_FOREIGN;
    gbuffer_position[i] = vec4<f32>(s.view.origin + (s.view.forward * depth + lateral), depth);
    gbuffer_normal[i] = vec4<f32>(normal, 0.0);
    gbuffer_albedo[i] = vec4<f32>(albedo, 0.0);
}
