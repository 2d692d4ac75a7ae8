// Vertices of an object that moves, from where they are at rest. Needs core/grid.wgsl. Host: indirect_gpu::MovingObjects.
// Twin: indirect_core::Mesh::pose.

struct Pose {
    /// Rows of the matrix from rest to the world; the fourth component translates.
    position_x: vec4<f32>,
    position_y: vec4<f32>,
    position_z: vec4<f32>,
    /// Rows of the matrix for normals, its cofactors; the fourth component is unused.
    normal_x: vec4<f32>,
    normal_y: vec4<f32>,
    normal_z: vec4<f32>,
    /// The object's first vertex in the scene.
    first: u32,
    /// Its number of vertices.
    count: u32,
    /// Groups of four floats per vertex of the scene.
    stride: u32,
    /// Its first vertex at rest.
    rest: u32,
}

@group(0) @binding(0) var<uniform> pose: Pose;
/// Position and normal of each vertex, with 0.
@group(0) @binding(1) var<storage, read> rest_vertices: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> posed_vertices: array<vec4<f32>>;

@compute @workgroup_size(64)
fn pose_vertices(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i >= pose.count {
        return;
    }
    let p = rest_vertices[2u * (pose.rest + i)].xyz;
    let n = rest_vertices[2u * (pose.rest + i) + 1u].xyz;
    let at = (pose.first + i) * pose.stride;
    let position = vec3<f32>(
        dot(pose.position_x.xyz, p) + pose.position_x.w,
        dot(pose.position_y.xyz, p) + pose.position_y.w,
        dot(pose.position_z.xyz, p) + pose.position_z.w,
    );
    let turned = vec3<f32>(dot(pose.normal_x.xyz, n), dot(pose.normal_y.xyz, n), dot(pose.normal_z.xyz, n));
    let squared = dot(turned, turned);
    let normal = select(n, turned / sqrt(squared), squared > 0.0);
    // The texture coordinate in the fourth components stays.
    posed_vertices[at] = vec4<f32>(position, posed_vertices[at].w);
    posed_vertices[at + 1u] = vec4<f32>(normal, posed_vertices[at + 1u].w);
}
