// traverse: each tile of neighbouring receivers gathers its own cut through a tree of lights; four receivers per
// thread, one dispatch per part of the tree.
// Twin: crates/rsm/src/cpu/traverse.rs. Source: Nichols, Shopf & Wyman 2009, §3.5.1.
//
// The module that includes this file says what stands in the way, at most once for each receiver and light of its
// cut, and only where that light would arrive. `rsm/unoccluded.wgsl` says nothing; another file may bind two storage
// buffers and textures from binding 8 on:
//
//     fn light_visible(representative: u32, receiver: u32, position: vec3<f32>, normal: vec3<f32>) -> bool

/// Which branches a dispatch walks, and how.
struct Traversal {
    /// The first branch of the part among all, and the one past its end.
    first: u32,
    end: u32,
    /// What a light's area is multiplied by: 1 for the disc form, 0 for the point form.
    area_scale: f32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> traversal: Traversal;
@group(0) @binding(1) var<storage, read> branches: array<Branch>;
@group(0) @binding(2) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> normals: array<vec4<f32>>;
/// Number of receivers first.
@group(0) @binding(4) var<storage, read> receiver_count: array<u32>;
@group(0) @binding(5) var<storage, read_write> irradiance: array<vec4<f32>>;
/// Lights in the cut of each tile.
@group(0) @binding(6) var<storage, read_write> cuts: array<u32>;

/// Neighbouring receivers that share one cut.
const TILE: u32 = 8u;

@compute @workgroup_size(64)
fn traverse(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let begin = 4u * grid_index(workgroup_id, num_workgroups, local_index, 64u);
    let n = receiver_count[0];
    if begin >= n {
        return;
    }
    let tile = begin / TILE;
    // Lanes beyond the end repeat the last receiver and are not stored.
    let i1 = min(begin + 1u, n - 1u);
    let i2 = min(begin + 2u, n - 1u);
    let i3 = min(begin + 3u, n - 1u);
    let p0 = positions[begin].xyz;
    let p1 = positions[i1].xyz;
    let p2 = positions[i2].xyz;
    let p3 = positions[i3].xyz;
    // The other half of the tile, which takes part in the choice of the cut.
    let other = begin ^ 4u;
    let q0 = positions[min(other, n - 1u)].xyz;
    let q1 = positions[min(other + 1u, n - 1u)].xyz;
    let q2 = positions[min(other + 2u, n - 1u)].xyz;
    let q3 = positions[min(other + 3u, n - 1u)].xyz;
    let n0 = normals[begin].xyz;
    let n1 = normals[i1].xyz;
    let n2 = normals[i2].xyz;
    let n3 = normals[i3].xyz;
    var e0 = vec3(0.0);
    var e1 = vec3(0.0);
    var e2 = vec3(0.0);
    var e3 = vec3(0.0);
    var lights = 0u;
    // The first part starts the sums, the others add to them.
    if traversal.first > 0u {
        e0 = irradiance[begin].xyz;
        e1 = irradiance[i1].xyz;
        e2 = irradiance[i2].xyz;
        e3 = irradiance[i3].xyz;
        if begin % TILE == 0u {
            lights = cuts[tile];
        }
    }
    var i = 0u;
    let end = traversal.end - traversal.first;
    while i < end {
        let position = branches[i].position;
        let reach = branches[i].reach;
        let v0 = position - p0;
        let v1 = position - p1;
        let v2 = position - p2;
        let v3 = position - p3;
        let own2 = min(min(dot(v0, v0), dot(v1, v1)), min(dot(v2, v2), dot(v3, v3)));
        let other2 = min(min(distance2(position, q0), distance2(position, q1)),
            min(distance2(position, q2), distance2(position, q3)));
        if reach > 0.0 && min(own2, other2) < reach * reach {
            i = branches[i].child - traversal.first;
            continue;
        }
        let flux = branches[i].flux;
        if weight(flux) > 0.0 {
            let normal = branches[i].normal;
            let area = branches[i].area * traversal.area_scale;
            let light = branches[i].representative;
            e0 += flux * arriving(form_factor_per_area(v0, n0, normal, area), light, begin, p0, n0);
            e1 += flux * arriving(form_factor_per_area(v1, n1, normal, area), light, i1, p1, n1);
            e2 += flux * arriving(form_factor_per_area(v2, n2, normal, area), light, i2, p2, n2);
            e3 += flux * arriving(form_factor_per_area(v3, n3, normal, area), light, i3, p3, n3);
            lights += 1u;
        }
        i = branches[i].next - traversal.first;
    }
    irradiance[begin] = vec4(e0, 0.0);
    if begin + 1u < n { irradiance[begin + 1u] = vec4(e1, 0.0); }
    if begin + 2u < n { irradiance[begin + 2u] = vec4(e2, 0.0); }
    if begin + 3u < n { irradiance[begin + 3u] = vec4(e3, 0.0); }
    if begin % TILE == 0u {
        cuts[tile] = lights;
    }
}

fn distance2(a: vec3<f32>, b: vec3<f32>) -> f32 {
    let v = a - b;
    return dot(v, v);
}

/// The factor f where it is not 0 and the light is seen.
fn arriving(f: f32, representative: u32, receiver: u32, position: vec3<f32>, normal: vec3<f32>) -> f32 {
    if f > 0.0 && light_visible(representative, receiver, position, normal) {
        return f;
    }
    return 0.0;
}
