// gather: adds the irradiance that one chunk of VPLs casts on receivers, without visibility; four receivers per thread.
// Twin: crates/rsm/src/cpu/gather.rs, which holds the equation.

const CHUNK: u32 = 1024u;

/// Which VPLs this dispatch sums, and how.
struct Gather {
    /// Index of the chunk's first VPL among all.
    first: u32,
    /// Number of receivers.
    receivers: u32,
    /// What a VPL's area is multiplied by: 1 for the disc form, 0 for the point form.
    area_scale: f32,
    pad0: u32,
}

struct Chunk {
    vpls: array<Vpl, CHUNK>,
}

@group(0) @binding(0) var<uniform> params: Gather;
@group(0) @binding(1) var<uniform> chunk: Chunk;
@group(0) @binding(2) var<storage, read> count: array<u32>;
@group(0) @binding(3) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read_write> irradiance: array<vec4<f32>>;

@compute @workgroup_size(64)
fn gather(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let begin = 4u * grid_index(workgroup_id, num_workgroups, local_index, 64u);
    let n = params.receivers;
    if begin >= n {
        return;
    }
    // Lanes beyond the end repeat the last receiver and are not stored.
    let i0 = begin;
    let i1 = min(begin + 1u, n - 1u);
    let i2 = min(begin + 2u, n - 1u);
    let i3 = min(begin + 3u, n - 1u);
    let p0 = positions[i0].xyz;
    let p1 = positions[i1].xyz;
    let p2 = positions[i2].xyz;
    let p3 = positions[i3].xyz;
    let n0 = normals[i0].xyz;
    let n1 = normals[i1].xyz;
    let n2 = normals[i2].xyz;
    let n3 = normals[i3].xyz;
    var e0 = vec3(0.0);
    var e1 = vec3(0.0);
    var e2 = vec3(0.0);
    var e3 = vec3(0.0);
    let vpls = min(max(count[0], params.first) - params.first, CHUNK);
    for (var j = 0u; j < vpls; j++) {
        let position = chunk.vpls[j].position;
        let normal = chunk.vpls[j].normal;
        let flux = chunk.vpls[j].flux;
        let area = chunk.vpls[j].area * params.area_scale;
        e0 += flux * form_factor_per_area(position - p0, n0, normal, area);
        e1 += flux * form_factor_per_area(position - p1, n1, normal, area);
        e2 += flux * form_factor_per_area(position - p2, n2, normal, area);
        e3 += flux * form_factor_per_area(position - p3, n3, normal, area);
    }
    add(i0, e0);
    if begin + 1u < n { add(i1, e1); }
    if begin + 2u < n { add(i2, e2); }
    if begin + 3u < n { add(i3, e3); }
}

/// The first chunk starts the sum, the others add to it.
fn add(i: u32, e: vec3<f32>) {
    if params.first == 0u {
        irradiance[i] = vec4(e, 0.0);
    } else {
        irradiance[i] = vec4(irradiance[i].xyz + e, 0.0);
    }
}
