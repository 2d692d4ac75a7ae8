// gather, gather_samples: irradiance of the pixels from the field, in closed form or from directions over the hemisphere.
// Twin: crates/sh-grid-raytracer/src/cpu/gather.rs.

@group(0) @binding(0) var<uniform> settings: FrameSettings;
@group(0) @binding(1) var<uniform> pixel_directions: DirectionSet;
@group(0) @binding(2) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> cell_index: array<u32>;
@group(0) @binding(5) var<storage, read> field_cells: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read_write> irradiance: array<vec4<f32>>;

const PI: f32 = 3.14159265358979;

@compute @workgroup_size(64)
fn gather(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i >= settings.pixels {
        return;
    }
    let n = normals[i].xyz;
    var e = vec3(0.0);
    if any(n != vec3(0.0)) {
        let local = field_at(positions[i].xyz, n);
        let lobe = sh_lobe_l2(SH_COSINE, n);
        for (var k = 0u; k < min(settings.coefficients, 9u); k++) {
            e += local[k].xyz * lobe[k];
        }
        e = max(e, vec3(0.0)) * obscurance(i, n, local);
    }
    irradiance[i] = vec4(e, f32(choices & 0xffffffu));
}

@compute @workgroup_size(64)
fn gather_samples(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i >= settings.pixels {
        return;
    }
    let n = normals[i].xyz;
    var e = vec3(0.0);
    if any(n != vec3(0.0)) {
        let local = field_at(positions[i].xyz, n);
        for (var j = 0u; j < 2u * settings.samples; j++) {
            let d = pixel_direction(i, j);
            let cosine = dot(n, d);
            if cosine > 0.0 {
                e += value_at(local, d).xyz * cosine;
            }
        }
        e *= 4.0 * PI / f32(2u * settings.samples);
        e = max(e, vec3(0.0)) * obscurance(i, n, local);
    }
    irradiance[i] = vec4(e, f32(choices & 0xffffffu));
}

fn pixel_direction(i: u32, j: u32) -> vec3<f32> {
    let turn = 3u * (hash_combine(settings.seed, i) % TURNS);
    let d = pixel_directions.directions[j].xyz;
    return pixel_directions.turns[turn].xyz * d.x + pixel_directions.turns[turn + 1u].xyz * d.y
        + pixel_directions.turns[turn + 2u].xyz * d.z;
}

fn value_at(local: array<vec4<f32>, 16>, d: vec3<f32>) -> vec4<f32> {
    let y = field_basis(d);
    var value = vec4(0.0);
    for (var k = 0u; k < settings.coefficients; k++) {
        value += local[k] * y[k];
    }
    return value;
}

/// The cosine-weighted mean of min(distance/range, 1); 1 where nothing is obscured.
fn obscurance(i: u32, n: vec3<f32>, local: array<vec4<f32>, 16>) -> f32 {
    if settings.obscurance_range <= 0.0 {
        return 1.0;
    }
    var sums = vec2(0.0);
    for (var j = 0u; j < 2u * settings.samples; j++) {
        let d = pixel_direction(i, j);
        let cosine = dot(n, d);
        if cosine > 0.0 {
            let near = clamp(value_at(local, d).w / settings.obscurance_range, 0.0, 1.0);
            sums += vec2(near, 1.0) * cosine;
        }
    }
    if sums.y > 0.0 {
        return sums.x / sums.y;
    }
    return 1.0;
}
