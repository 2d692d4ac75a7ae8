// traverse: each tile of neighbouring fragments gathers its own cut through the tree of lights; four fragments per thread, one
// dispatch per part of the tree.
// Twin: crates/image-space-radiosity/src/cpu/traverse.rs. Source: Nichols, Shopf & Wyman 2009, §3.5.1.

/// A part of the tree: its first branch and the one past its end.
struct Part {
    first: u32,
    end: u32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> part: Part;
@group(0) @binding(1) var<storage, read> branches: array<Branch>;
@group(0) @binding(2) var<storage, read> fragment_positions: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> fragment_normals: array<vec4<f32>>;
/// Number of fragments first.
@group(0) @binding(4) var<storage, read> totals: array<u32>;
@group(0) @binding(5) var<storage, read_write> gathered: array<vec4<f32>>;
/// Lights in the cut of each tile.
@group(0) @binding(6) var<storage, read_write> cuts: array<u32>;
@group(0) @binding(7) var<uniform> settings: Settings;

const PI: f32 = 3.14159265358979;
const LEAST_DENOMINATOR: f32 = 1e-37;

@compute @workgroup_size(64)
fn traverse(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let begin = 4u * grid_index(workgroup_id, num_workgroups, local_index, 64u);
    let n = totals[0];
    if begin >= n {
        return;
    }
    let tile = begin / TILE;
    // Lanes beyond the end repeat the last fragment and are not stored.
    let i1 = min(begin + 1u, n - 1u);
    let i2 = min(begin + 2u, n - 1u);
    let i3 = min(begin + 3u, n - 1u);
    let p0 = fragment_positions[begin].xyz;
    let p1 = fragment_positions[i1].xyz;
    let p2 = fragment_positions[i2].xyz;
    let p3 = fragment_positions[i3].xyz;
    // The other half of the tile, which takes part in the choice of the cut.
    let other = begin ^ 4u;
    let q0 = fragment_positions[min(other, n - 1u)].xyz;
    let q1 = fragment_positions[min(other + 1u, n - 1u)].xyz;
    let q2 = fragment_positions[min(other + 2u, n - 1u)].xyz;
    let q3 = fragment_positions[min(other + 3u, n - 1u)].xyz;
    let n0 = fragment_normals[begin].xyz;
    let n1 = fragment_normals[i1].xyz;
    let n2 = fragment_normals[i2].xyz;
    let n3 = fragment_normals[i3].xyz;
    var e0 = vec3(0.0);
    var e1 = vec3(0.0);
    var e2 = vec3(0.0);
    var e3 = vec3(0.0);
    var lights = 0u;
    // The first part starts the sums, the others add to them.
    if part.first > 0u {
        e0 = gathered[begin].xyz;
        e1 = gathered[i1].xyz;
        e2 = gathered[i2].xyz;
        e3 = gathered[i3].xyz;
        if begin % TILE == 0u {
            lights = cuts[tile];
        }
    }
    var i = 0u;
    let end = part.end - part.first;
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
            i = branches[i].child - part.first;
            continue;
        }
        let flux = branches[i].flux;
        if weight(flux) > 0.0 {
            let normal = branches[i].normal;
            let area = branches[i].area * settings.area_scale;
            e0 += flux * form_factor_per_area(v0, n0, normal, area);
            e1 += flux * form_factor_per_area(v1, n1, normal, area);
            e2 += flux * form_factor_per_area(v2, n2, normal, area);
            e3 += flux * form_factor_per_area(v3, n3, normal, area);
            lights += 1u;
        }
        i = branches[i].next - part.first;
    }
    gathered[begin] = vec4(e0, 0.0);
    if begin + 1u < n { gathered[begin + 1u] = vec4(e1, 0.0); }
    if begin + 2u < n { gathered[begin + 2u] = vec4(e2, 0.0); }
    if begin + 3u < n { gathered[begin + 3u] = vec4(e3, 0.0); }
    if begin % TILE == 0u {
        cuts[tile] = lights;
    }
}

fn distance2(a: vec3<f32>, b: vec3<f32>) -> f32 {
    let v = a - b;
    return dot(v, v);
}

/// cosθ_i cosθ_j / (π d² + A) for the vector v from receiver to patch.
fn form_factor_per_area(v: vec3<f32>, n_receiver: vec3<f32>, n_patch: vec3<f32>, area: f32) -> f32 {
    let d2 = dot(v, v);
    let ci = dot(n_receiver, v);
    let cj = -dot(n_patch, v);
    let denominator = d2 * (PI * d2 + area);
    return max(ci, 0.0) * max(cj, 0.0) / max(denominator, LEAST_DENOMINATOR);
}
