// movement: where the surface of each pixel was in the frame before.
// Twin: crates/instant-radiosity/src/cpu/movement.rs.
// Source: thesis §3.5.1.

@group(0) @binding(0) var<uniform> settings: FrameSettings;
@group(0) @binding(1) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> triangles: array<u32>;
@group(0) @binding(3) var<storage, read> mesh_triangles: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read> vertices_now: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> vertices_before: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read_write> before: array<vec4<f32>>;

@compute @workgroup_size(64)
fn movement(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if settings.moving == 0u || i >= settings.width * settings.height {
        return;
    }
    let triangle = triangles[i];
    if triangle >= arrayLength(&mesh_triangles) {
        before[i] = vec4(0.0);
        return;
    }
    let corners = mesh_triangles[triangle];
    let a = vertices_now[corners.x].xyz;
    let p = positions[i].xyz;
    let u = vertices_now[corners.y].xyz - a;
    let v = vertices_now[corners.z].xyz - a;
    let w = p - a;
    let n = cross(u, v);
    let area = dot(n, n);
    if area <= 0.0 {
        before[i] = vec4(p, 0.0);
        return;
    }
    let b = dot(cross(w, v), n) / area;
    let c = dot(cross(u, w), n) / area;
    // What moved, added to the point: nothing is lost where nothing moved.
    let moved = (vertices_before[corners.x].xyz - a) * (1.0 - b - c)
        + (vertices_before[corners.y].xyz - vertices_now[corners.y].xyz) * b
        + (vertices_before[corners.z].xyz - vertices_now[corners.z].xyz) * c;
    before[i] = vec4(p + moved, 0.0);
}
