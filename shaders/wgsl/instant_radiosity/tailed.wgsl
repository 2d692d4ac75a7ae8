// tailed_lights: the virtual lights of all bounces with the flux that receivers see.
// Twin: tailed in crates/instant-radiosity/src/cpu/cuts.rs.

@group(0) @binding(0) var<uniform> settings: FrameSettings;
@group(0) @binding(1) var<uniform> summary: Summary;
@group(0) @binding(2) var<storage, read> vpls: array<Vpl>;
@group(0) @binding(3) var<storage, read_write> tailed: array<Vpl>;

@compute @workgroup_size(64)
fn tailed_lights(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < settings.per_bounce * settings.bounces {
        var own = vpls[i];
        if i >= settings.per_bounce * (settings.bounces - 1u) {
            own.flux *= summary.tail;
        }
        tailed[i] = own;
    }
}
