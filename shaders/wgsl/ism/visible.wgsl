// visible: the queries of ism/query.wgsl for a list of pairs, for tests and for callers that want bits.
// Twin: crates/imperfect-shadow-maps/src/cpu/atlas.rs.

/// A receiver and the VPL that may light it.
struct IsmPair {
    receiver: vec3<f32>,
    vpl: u32,
    normal: vec3<f32>,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> ism: Ism;
@group(0) @binding(1) var<storage, read> vpls: array<Vpl>;
@group(0) @binding(2) var<storage, read> ism_atlas: array<f32>;
@group(0) @binding(3) var<storage, read> pairs: array<IsmPair>;
/// Bit 0: as a point; bit 1: as a surface.
@group(0) @binding(4) var<storage, read_write> visible_pairs: array<u32>;

@compute @workgroup_size(64)
fn visible(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i >= arrayLength(&pairs) {
        return;
    }
    let pair = pairs[i];
    let vpl = vpls[pair.vpl];
    let point = ism_visible(pair.vpl, vpl.position, vpl.normal, pair.receiver);
    let surface = ism_visible_surface(pair.vpl, vpl.position, vpl.normal, pair.receiver, pair.normal);
    visible_pairs[i] = u32(point) + 2u * u32(surface);
}
