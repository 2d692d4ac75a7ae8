// clusters: the patches that hold no discontinuity, as large as they get, one list for all fragments.
// Twin: crates/image-space-radiosity/src/cpu/clusters.rs. Source: Nichols, Shopf & Wyman 2009, §3.4.

@group(0) @binding(1) var<uniform> settings: Settings;
/// Levels 1 and coarser of the maps of a part, one map after the other.
@group(0) @binding(2) var<storage, read> patches: array<Patch>;
/// Of all maps.
@group(0) @binding(3) var<storage, read_write> cluster_slots: array<Vpl>;
@group(0) @binding(4) var<uniform> map_index: MapIndex;
@group(0) @binding(5) var<uniform> lengths: Lengths;

@compute @workgroup_size(64)
fn clusters(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < table.nodes {
        cluster_slots[map_index.map * table.nodes + i] = cluster(i);
    }
}

fn cluster(i: u32) -> Vpl {
    let at = place(i);
    let own = node(i);
    if weight(own.flux) <= 0.0 || at.x < table.finest || at.x > table.coarsest {
        return Vpl();
    }
    // From the coarsest down: the first flat one is the cluster of all beneath.
    for (var above = table.coarsest; above > at.x; above--) {
        let l = table.levels[above];
        let shift = above - at.x;
        if flat(node(l.x + (at.z >> shift) * l.y + (at.y >> shift))) {
            return Vpl();
        }
    }
    if at.x == table.finest || flat(own) {
        return Vpl(own.position, own.area, own.normal, 0.0, own.flux, 0.0);
    }
    return Vpl();
}

fn flat(own: Patch) -> bool {
    return is_flat(own, settings.patch_depth, settings.patch_versine);
}

/// The patch of a node.
fn node(i: u32) -> Patch {
    let first = table.levels[0].y * table.levels[0].z;
    if i < first {
        return texel_patch(i);
    }
    return patches[map_index.in_part * lengths.patches + i - first];
}
