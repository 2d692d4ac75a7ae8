// A point of a triangle as light transport sees it. Needs core/scene.wgsl.
// Twin: indirect_core::Scene::{surface, albedo, is_solid}, indirect_core::math::normalize_or.

struct Surface {
    position: vec3<f32>,
    geometric_normal: vec3<f32>,
    shading_normal: vec3<f32>,
    albedo: vec3<f32>,
}

/// `v / |v|`, or `fallback` where `v` is zero, not finite or too small.
fn normalize_or(v: vec3<f32>, fallback: vec3<f32>) -> vec3<f32> {
    let m = max(abs(v.x), max(abs(v.y), abs(v.z)));
    // By its bits: WGSL may assume that NaN and infinity do not occur.
    let exponent = bitcast<vec3<u32>>(v) & vec3<u32>(0x7f800000u);
    if !(m > 0.0) || any(exponent == vec3<u32>(0x7f800000u)) {
        return fallback;
    }
    return normalize(v / m);
}

/// Texture coordinate at barycentric weights `w` of the corners.
fn surface_uv(triangle: vec4<u32>, w: vec3<f32>) -> vec2<f32> {
    let stride = scene_info.vertex_stride;
    let a = triangle.x * stride;
    let b = triangle.y * stride;
    let c = triangle.z * stride;
    // Not `dot`, whose order is the driver's: large coordinates keep the CPU's rounding.
    let u = scene_vertices[a].w * w.x + scene_vertices[b].w * w.y + scene_vertices[c].w * w.z;
    let v = scene_vertices[a + 1u].w * w.x + scene_vertices[b + 1u].w * w.y + scene_vertices[c + 1u].w * w.z;
    return vec2<f32>(u, v);
}

/// Lambertian albedo: base colour × vertex colour × (1 − metallic).
fn surface_albedo(triangle: vec4<u32>, w: vec3<f32>) -> vec3<f32> {
    let m = scene_materials[triangle.w];
    let uv = surface_uv(triangle, w);
    var albedo = m.base_color;
    if m.base_color_texture.first_texel != NO_TEXTURE {
        albedo *= texture_sample(m.base_color_texture, uv).xyz;
    }
    var metallic = m.metallic;
    if m.metallic_roughness_texture.first_texel != NO_TEXTURE {
        metallic *= texture_sample(m.metallic_roughness_texture, uv).z;
    }
    albedo *= scene_color(triangle.x) * w.x + scene_color(triangle.y) * w.y + scene_color(triangle.z) * w.z;
    return albedo * (1.0 - metallic);
}

/// Whether the alpha test keeps the point.
fn surface_is_solid(triangle: vec4<u32>, w: vec3<f32>) -> bool {
    let m = scene_materials[triangle.w];
    if m.alpha_cutoff <= 0.0 {
        return true;
    }
    var alpha = m.base_alpha;
    if m.base_color_texture.first_texel != NO_TEXTURE {
        alpha *= texture_sample(m.base_color_texture, surface_uv(triangle, w)).w;
    }
    return alpha >= m.alpha_cutoff;
}

/// The surface at barycentric weights `w` of the corners of a triangle.
fn surface_at(triangle: vec4<u32>, w: vec3<f32>) -> Surface {
    let a = scene_position(triangle.x);
    let b = scene_position(triangle.y);
    let c = scene_position(triangle.z);
    let stride = scene_info.vertex_stride;
    var s: Surface;
    s.position = a * w.x + b * w.y + c * w.z;
    s.geometric_normal = normalize_or(cross(b - a, c - a), vec3<f32>(0.0));
    let n = scene_vertices[triangle.x * stride + 1u].xyz * w.x
        + scene_vertices[triangle.y * stride + 1u].xyz * w.y
        + scene_vertices[triangle.z * stride + 1u].xyz * w.z;
    let shading = normalize_or(n, s.geometric_normal);
    s.shading_normal = select(shading, -shading, dot(shading, s.geometric_normal) < 0.0);
    s.albedo = surface_albedo(triangle, w);
    return s;
}
