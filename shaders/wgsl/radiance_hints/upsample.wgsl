// upsample: irradiance at every pixel from that at one of 2 × 2 or 4 × 4, by a joint bilateral filter.
// Twin: crates/radiance-hints/src/cpu/upsample.rs.
// Papaioannou 2011, §9.3.

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var<uniform> lattice: Lattice;
@group(0) @binding(2) var<storage, read> hints: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(5) var<uniform> reduced: Reduced;
@group(0) @binding(6) var<storage, read> low: array<vec4<f32>>;
@group(0) @binding(7) var<storage, read_write> irradiance: array<vec4<f32>>;

const LEAST_WEIGHT: f32 = 0.05;

@compute @workgroup_size(64)
fn upsample(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < reduced.size.x * reduced.size.y {
        irradiance[i] = vec4(upsample_pixel(i), 0.0);
    }
}

fn upsample_pixel(i: u32) -> vec3<f32> {
    let n = normals[i].xyz;
    if all(n == vec3(0.0)) {
        return vec3(0.0);
    }
    let found = bilateral(reduced, i);
    if found.w < LEAST_WEIGHT {
        return field_irradiance(positions[i].xyz, n);
    }
    return found.xyz * (1.0 / found.w);
}
