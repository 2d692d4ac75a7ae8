// reconstruct: the irradiance that the field casts on pixels.
// Twin: crates/radiance-hints/src/cpu/reconstruct.rs.
// Papaioannou 2011, §5, eq. 6 and 7.

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var<uniform> lattice: Lattice;
@group(0) @binding(2) var<storage, read> hints: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(5) var<uniform> reduced: Reduced;
@group(0) @binding(6) var<storage, read_write> low: array<vec4<f32>>;

@compute @workgroup_size(64)
fn reconstruct(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i >= reduced.small.x * reduced.small.y {
        return;
    }
    let pixel = reduced_pixel(reduced, vec2(i % reduced.small.x, i / reduced.small.x));
    let n = normals[pixel].xyz;
    var e = vec3(0.0);
    if any(n != vec3(0.0)) {
        e = field_irradiance(positions[pixel].xyz, n);
    }
    low[i] = vec4(e, 0.0);
}
