// tree: the patches linked for the traversal, each with the distance from which it is exact enough.
// Twin: crates/image-space-radiosity/src/cpu/tree.rs. Source: Nichols, Shopf & Wyman 2009, §3.5, eq. 7–8; docs/errata.md.

@group(0) @binding(1) var<uniform> settings: Settings;
/// Of this map, levels 1 and coarser.
@group(0) @binding(2) var<storage, read> patches: array<Patch>;
/// Node, next branch, first child and 0.
@group(0) @binding(3) var<storage, read> links: array<vec4<u32>>;
/// The reference irradiance.
@group(0) @binding(4) var<storage, read> reference: array<f32>;
/// The part of the tree that holds this map's branches.
@group(0) @binding(5) var<storage, read_write> branches: array<Branch>;
@group(0) @binding(6) var<uniform> map_index: MapIndex;
@group(0) @binding(7) var<uniform> lengths: Lengths;

const ALWAYS: f32 = 1e18;
const PI: f32 = 3.14159265358979;

/// The branches above the texels, which come first; one thread each.
@compute @workgroup_size(64)
fn tree(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < lengths.coarse_branches {
        let node = links[i].x;
        let own = patches[node - table.levels[0].y * table.levels[0].z];
        let level = place(node).x;
        var reach = 0.0;
        if level > table.finest && weight(own.flux) > 0.0 {
            reach = ALWAYS;
            if level <= table.coarsest {
                reach = reach_of(own, settings.tau * reference[0]);
            }
        }
        store(i, Vpl(own.position, own.area, own.normal, 0.0, own.flux, 0.0), reach);
    }
}

/// Those of the texels, where they are the finest.
@compute @workgroup_size(64)
fn tree_texels(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = lengths.coarse_branches + grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < lengths.branches {
        let own = texel_patch(links[i].x);
        store(i, Vpl(own.position, own.area, own.normal, 0.0, own.flux, 0.0), 0.0);
    }
}

fn store(i: u32, light: Vpl, reach: f32) {
    // Of the maps before.
    let base = map_index.map * lengths.branches;
    let next = base + links[i].y;
    let child = base + links[i].z;
    branches[base - map_index.first_branch + i] =
        Branch(light.position, light.area, light.normal, reach, light.flux, next, child, 0u, 0u, 0u);
}

/// The distance below which the bound of a patch exceeds the threshold.
fn reach_of(own: Patch, threshold: f32) -> f32 {
    if threshold <= 0.0 {
        return ALWAYS;
    }
    let flux = weight(own.flux) / 3.0;
    var reach = 0.0;
    if settings.bound == 0u {
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
