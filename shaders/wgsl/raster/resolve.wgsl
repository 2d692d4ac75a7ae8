// From the triangle that a texel sees to the point, normal and albedo that it sees: its ray meets the triangle's plane, as on
// the CPU, so that no interpolator touches a value. Needs core/{view,texture,scene,surface}.wgsl. Host: indirect_gpu::Raster.
// Twin: indirect_accel::cast::gbuffer.

@group(1) @binding(0) var<uniform> view: View;
@group(1) @binding(1) var triangles: texture_2d<u32>;
/// World position and view depth.
@group(1) @binding(2) var<storage, read_write> gbuffer_position: array<vec4<f32>>;
/// Unit shading normal on the side that is seen, and 0.
@group(1) @binding(3) var<storage, read_write> gbuffer_normal: array<vec4<f32>>;
/// Lambertian albedo and 0.
@group(1) @binding(4) var<storage, read_write> gbuffer_albedo: array<vec4<f32>>;
@group(1) @binding(5) var<storage, read_write> gbuffer_triangle: array<u32>;

@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= view.size) {
        return;
    }
    let texel = view.first_texel + id.y * view.size.x + id.x;
    let seen = textureLoad(triangles, view.tile + id.xy, 0).x;
    gbuffer_triangle[texel] = seen;
    if seen == NO_TRIANGLE {
        gbuffer_position[texel] = vec4<f32>(0.0);
        gbuffer_normal[texel] = vec4<f32>(0.0);
        gbuffer_albedo[texel] = vec4<f32>(0.0);
        return;
    }
    let triangle = scene_triangles[seen];
    let pixel = vec2<f32>(id.xy) + 0.5;
    let hit = view_barycentrics(
        view,
        pixel,
        scene_position(triangle.x),
        scene_position(triangle.y),
        scene_position(triangle.z),
    );
    let surface = surface_at(triangle, hit.xyz);
    let away = dot(surface.geometric_normal, view_direction(view, pixel)) > 0.0;
    let normal = select(surface.shading_normal, -surface.shading_normal, away);
    gbuffer_position[texel] = vec4<f32>(surface.position, hit.w);
    gbuffer_normal[texel] = vec4<f32>(normal, 0.0);
    gbuffer_albedo[texel] = vec4<f32>(surface.albedo, 0.0);
}
