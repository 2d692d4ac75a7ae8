// shadows: the virtual point lights from which shadow maps look, one texel of each patch of one coarse level; a dispatch per map.
// Twin: crates/image-space-radiosity/src/cpu/shadows.rs.

@group(0) @binding(1) var<uniform> settings: Settings;
/// Levels 1 and coarser of the maps of a part, one map after the other.
@group(0) @binding(2) var<storage, read> patches: array<Patch>;
/// Of all maps.
@group(0) @binding(3) var<storage, read_write> shadow_vpls: array<Vpl>;
@group(0) @binding(4) var<uniform> map_index: MapIndex;
@group(0) @binding(5) var<uniform> lengths: Lengths;

@compute @workgroup_size(64)
fn shadow_lights(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    let l = table.levels[settings.shadow_level];
    if i < l.y * l.z {
        shadow_vpls[map_index.map * l.y * l.z + i] = shadow_light(l.x + i);
    }
}

fn shadow_light(i: u32) -> Vpl {
    let own = node(i);
    if weight(own.flux) <= 0.0 {
        return Vpl();
    }
    let number = descend_number(settings.seed, map_index.map, i);
    let at = descend(map_index.in_part, place(i), 0u, number);
    let texel = texel_patch(at.y * table.levels[0].y + at.x);
    return Vpl(texel.position, own.area, texel.normal, 0.0, own.flux, 0.0);
}

/// The patch of a node.
fn node(i: u32) -> Patch {
    let first = table.levels[0].y * table.levels[0].z;
    if i < first {
        return texel_patch(i);
    }
    return patches[map_index.in_part * lengths.patches + i - first];
}

fn node_weight(map: u32, i: u32) -> f32 {
    return weight(node(i).flux);
}
