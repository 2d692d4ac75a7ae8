// shade: the radiance that leaves each pixel, ρ/π · E.
// Twin: shade in crates/filter/src/cpu/shade.rs.

@group(0) @binding(0) var<storage, read> albedos: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read> irradiance: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> image: array<vec4<f32>>;

const FRAC_1_PI: f32 = 0.318309886183791;

@compute @workgroup_size(64)
fn shade(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < arrayLength(&image) {
        image[i] = vec4(albedos[i].xyz * FRAC_1_PI * irradiance[i].xyz, 0.0);
    }
}
