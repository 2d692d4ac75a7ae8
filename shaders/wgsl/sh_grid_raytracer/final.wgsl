// gather_final: irradiance of the pixels by rays with the density of the cosine, each with one look at the R-grid where it ends. Some rays
// at a time: software renderers end a shader's loops after 65 535 rounds.
// Twin: crates/sh-grid-raytracer/src/cpu/gather.rs.

/// Rays of a dispatch.
struct DirectionRange {
    first: u32,
    end: u32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> settings: FrameSettings;
@group(0) @binding(1) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> cell_index: array<u32>;
@group(0) @binding(4) var<storage, read> faces: array<Faces>;
@group(0) @binding(5) var<storage, read> accel_nodes: array<AccelNode>;
@group(0) @binding(6) var<storage, read> accel_triangles: array<AccelTriangle>;
@group(0) @binding(7) var<storage, read> triangle_normals: array<u32>;
@group(0) @binding(8) var<uniform> range: DirectionRange;
@group(0) @binding(9) var<storage, read_write> irradiance: array<vec4<f32>>;

const PI: f32 = 3.14159265358979;

@compute @workgroup_size(64)
fn gather_final(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i >= settings.pixels {
        return;
    }
    let n = normals[i].xyz;
    var sum = vec3(0.0);
    // A number below 2²⁴ that differs where something else is seen.
    var choices = 0u;
    if any(n != vec3(0.0)) {
        if range.first > 0u {
            sum = irradiance[i].xyz;
            choices = u32(irradiance[i].w);
        }
        let origin = offset_ray_origin(positions[i].xyz, n, settings.unit);
        let seed = hash_combine(settings.seed, i);
        for (var k = range.first; k < range.end; k++) {
            let d = to_world(hemisphere_cosine(sobol_2d(k, seed)), n);
            let look = look_along(origin, d, 0.0);
            if look.place != NO_CELL {
                sum += look_radiance(look);
                choices += look.mark;
            }
        }
        if range.end == settings.samples {
            sum *= PI / f32(settings.samples);
        }
    }
    irradiance[i] = vec4(sum, f32(choices & 0xffffffu));
}
