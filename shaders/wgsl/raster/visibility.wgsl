// Draws the number of the nearest triangle of each texel; both faces are seen. The alpha test runs only in
// `visibility_masked`. Needs core/{view,texture,scene,surface}.wgsl. Host: indirect_gpu::Raster.
// Vertices are pulled from storage buffers, three per triangle: their number is the triangle's, without a feature.

@group(1) @binding(0) var<uniform> view: View;

struct VisibilityVertex {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) triangle: u32,
}

@vertex
fn visibility_vertex(@builtin(vertex_index) index: u32) -> VisibilityVertex {
    let triangle = index / 3u;
    let vertex = scene_triangles[triangle][index % 3u];
    return VisibilityVertex(view_clip(view, scene_position(vertex)), triangle);
}

@fragment
fn visibility(in: VisibilityVertex) -> @location(0) u32 {
    return in.triangle;
}

@fragment
fn visibility_masked(in: VisibilityVertex) -> @location(0) u32 {
    let triangle = scene_triangles[in.triangle];
    if scene_materials[triangle.w].alpha_cutoff > 0.0 {
        // `position.xy` is the texel's centre in the targets.
        let hit = view_barycentrics(
            view,
            in.position.xy - vec2<f32>(view.tile),
            scene_position(triangle.x),
            scene_position(triangle.y),
            scene_position(triangle.z),
        );
        if !surface_is_solid(triangle, hit.xyz) {
            discard;
        }
    }
    return in.triangle;
}
