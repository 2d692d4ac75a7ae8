// clusters: the patches that hold no discontinuity, as large as they get, one list for all fragments.
// Twin: crates/image-space-radiosity/src/cpu/clusters.rs. Source: Nichols, Shopf & Wyman 2009, §3.4.

/// When a patch is flat.
struct Clusters {
    /// Distance from its plane relative to its radius.
    depth: f32,
    /// Versine of the half angle of the cone of normals.
    versine: f32,
    pad0: f32,
    pad1: f32,
}

@group(0) @binding(1) var<uniform> params: Clusters;
@group(0) @binding(2) var<storage, read> patches: array<Patch>;
@group(0) @binding(3) var<storage, read_write> slots: array<Vpl>;

@compute @workgroup_size(64)
fn clusters(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < table.nodes {
        slots[i] = cluster(i);
    }
}

fn cluster(i: u32) -> Vpl {
    // The last level is one node.
    let count = table.levels[table.count - 1u].x + 1u;
    let map = i - i % count;
    let at = place(i % count);
    let own = patches[i];
    if weight(own.flux) <= 0.0 || at.x < table.finest || at.x > table.coarsest {
        return Vpl();
    }
    // From the coarsest down: the first flat one is the cluster of all beneath.
    for (var above = table.coarsest; above > at.x; above--) {
        let l = table.levels[above];
        let shift = above - at.x;
        if flat(map + l.x + (at.z >> shift) * l.y + (at.y >> shift)) {
            return Vpl();
        }
    }
    if at.x == table.finest || flat(i) {
        return Vpl(own.position, own.area, own.normal, 0.0, own.flux, 0.0);
    }
    return Vpl();
}

fn flat(i: u32) -> bool {
    return patches[i].relief < params.depth * patches[i].radius && patches[i].versine < params.versine;
}
