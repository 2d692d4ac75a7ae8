// tree: the patches linked for the traversal, each with the distance from which it is exact enough.
// Twin: crates/image-space-radiosity/src/cpu/tree.rs. Source: Nichols, Shopf & Wyman 2009, §3.5, eq. 7–8; docs/errata.md.

struct Tree {
    /// 0: the error of a patch; 1: the light that it sends.
    bound: u32,
    maps: u32,
    /// Branches of each map.
    branches: u32,
    /// Share of the reference irradiance.
    tau: f32,
}

@group(0) @binding(1) var<uniform> params: Tree;
@group(0) @binding(2) var<storage, read> patches: array<Patch>;
/// Node, next branch, first child and 0.
@group(0) @binding(3) var<storage, read> links: array<vec4<u32>>;
/// The reference irradiance.
@group(0) @binding(4) var<storage, read_write> irradiance: array<f32>;
@group(0) @binding(5) var<storage, read_write> tree_out: array<Branch>;

const ALWAYS: f32 = 1e18;
const PI: f32 = 3.14159265358979;

@compute @workgroup_size(64)
fn tree(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < params.maps * params.branches {
        tree_out[i] = branch(i);
    }
}

fn branch(i: u32) -> Branch {
    let count = table.levels[table.count - 1u].x + 1u;
    let map = i / params.branches;
    let entry = links[i % params.branches];
    let own = patches[map * count + entry.x];
    let level = place(entry.x).x;
    var reach = 0.0;
    if level > table.finest && weight(own.flux) > 0.0 {
        reach = ALWAYS;
        if level <= table.coarsest {
            reach = reach_of(own, params.tau * irradiance[0]);
        }
    }
    let base = map * params.branches;
    return Branch(own.position, own.area, own.normal, reach, own.flux, base + entry.y, base + entry.z, 0u, 0u, 0u);
}

/// The distance below which the bound of a patch exceeds the threshold.
fn reach_of(own: Patch, threshold: f32) -> f32 {
    if threshold <= 0.0 {
        return ALWAYS;
    }
    let flux = weight(own.flux) / 3.0;
    var reach = 0.0;
    if params.bound == 0u {
        // Φ/(πd²)·(r²/d² + s) = T, a quadratic in 1/d².
        let s = own.versine;
        let r2 = own.radius * own.radius;
        let far = flux / (PI * threshold);
        reach = sqrt(0.5 * (far * s + sqrt(far * (far * (s * s) + 4.0 * r2))));
    } else {
        // Φ/(πd² + A) = T, for the nearest point of the patch.
        reach = own.radius + sqrt(max((flux / threshold - own.area) / PI, 0.0));
    }
    return min(reach, ALWAYS);
}
