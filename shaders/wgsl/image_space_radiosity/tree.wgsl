// tree: the patches linked for the traversal, each with the distance from which it is exact enough.
// Twin: crates/image-space-radiosity/src/cpu/tree.rs. Source: Nichols, Shopf & Wyman 2009, §3.5, eq. 7–8; docs/errata.md.

@group(0) @binding(1) var<uniform> settings: Settings;
/// Levels 1 and coarser of the maps of a part, one map after the other.
@group(0) @binding(2) var<storage, read> patches: array<Patch>;
/// Node, next branch, first child and 0.
@group(0) @binding(3) var<storage, read> links: array<vec4<u32>>;
/// The reference irradiance.
@group(0) @binding(4) var<storage, read> reference: array<f32>;
/// Of the maps of a part, one map after the other.
@group(0) @binding(5) var<storage, read_write> branches: array<Branch>;
@group(0) @binding(6) var<uniform> map_index: MapIndex;
@group(0) @binding(7) var<uniform> lengths: Lengths;
@group(0) @binding(8) var<uniform> part: Part;
/// A list of lights.
@group(0) @binding(13) var<storage, read> vpls: array<Vpl>;
/// Number of its lights.
@group(0) @binding(14) var<storage, read> count: array<u32>;

/// The bound that asks for the same cut for all.
const FLAT: u32 = 2u;

/// The branches above the texels, which come first, of all maps of a part; one thread each.
@compute @workgroup_size(64)
fn tree(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let k = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if k < part.maps * lengths.coarse_branches {
        let map = k / lengths.coarse_branches;
        let i = k % lengths.coarse_branches;
        let node = links[i].x;
        let own = patches[map * lengths.patches + node - table.levels[0].y * table.levels[0].z];
        let level = place(node).x;
        var branch = branch_of(own);
        branch.radius = own.radius;
        branch.versine = own.versine;
        if level > table.finest && weight(own.flux) > 0.0 {
            branch.reach = ALWAYS;
            if level <= table.coarsest {
                if settings.bound != FLAT {
                    branch.reach = reach_of(branch, settings.bound, settings.tau * reference[0]);
                } else if is_flat(own, settings.patch_depth, settings.patch_versine) {
                    branch.reach = 0.0;
                }
            }
        }
        if settings.shadow_level < table.count {
            branch.representative = tile_of(map, part.first_map + map, node);
        }
        store(part.first_map + map, i, branch);
    }
}

/// Those of the texels of a map, where they are the finest.
@compute @workgroup_size(64)
fn tree_texels(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = lengths.coarse_branches + grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < lengths.branches {
        let node = links[i].x;
        var branch = branch_of(texel_patch(node));
        if settings.shadow_level < table.count {
            let width = table.levels[0].y;
            branch.representative = tile_above(map_index.map, vec3(0u, node % width, node / width));
        }
        store(map_index.map, i, branch);
    }
}

/// The lights of a list, each with a shadow map of its own.
@compute @workgroup_size(64)
fn tree_list(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < arrayLength(&branches) {
        var branch = Branch();
        if i < count[0] {
            branch = Branch(vpls[i].position, vpls[i].area, vpls[i].normal, 0.0, vpls[i].flux, 0u, 0u, i, 0.0, 0.0);
        }
        branch.next = i + 1u;
        branches[i] = branch;
    }
}

/// The shadow map that the light of a node asks: of the patch above it, or of one beneath it.
fn tile_of(map_in_part: u32, map: u32, node: u32) -> u32 {
    let at = place(node);
    if at.x <= settings.shadow_level {
        return tile_above(map, at);
    }
    let l = table.levels[settings.shadow_level];
    let tile = descend(map_in_part, at, settings.shadow_level, descend_number(settings.seed, map, node));
    return map * l.y * l.z + tile.y * l.y + tile.x;
}

/// That of the patch above a node (level, column and row).
fn tile_above(map: u32, at: vec3<u32>) -> u32 {
    let l = table.levels[settings.shadow_level];
    let up = settings.shadow_level - at.x;
    return map * l.y * l.z + (at.z >> up) * l.y + (at.y >> up);
}

fn node_weight(map: u32, node: u32) -> f32 {
    return weight(patches[map * lengths.patches + node - table.levels[0].y * table.levels[0].z].flux);
}

/// A patch as a branch without links.
fn branch_of(own: Patch) -> Branch {
    return Branch(own.position, own.area, own.normal, 0.0, own.flux, 0u, 0u, 0u, 0.0, 0.0);
}

/// Stores branch i of a map.
fn store(map: u32, i: u32, unlinked: Branch) {
    let base = map * lengths.branches;
    var branch = unlinked;
    branch.next = base + links[i].y;
    branch.child = base + links[i].z;
    branches[base - part.first + i] = branch;
}
