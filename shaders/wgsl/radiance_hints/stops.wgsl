// stops: the quantised hit distance along each direction of later bounces, from the maps' depth; four to a word.
// Twin: crates/radiance-hints/src/cpu/stops.rs, which defines the numbers.

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var<uniform> lattice: Lattice;
@group(0) @binding(2) var<storage, read> views: array<View>;
@group(0) @binding(3) var<storage, read> depths: array<f32>;
@group(0) @binding(4) var<storage, read_write> stops: array<u32>;

@compute @workgroup_size(64)
fn stop_directions(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i >= lattice.hints * settings.stop_words {
        return;
    }
    let hint = i / settings.stop_words;
    let begin = (i % settings.stop_words) * 4u;
    let position = lattice_position(hint);
    let room = lattice.volume[lattice.volume[lattice_volume(hint)].room];
    var word = 0u;
    for (var j = begin; j < min(begin + 4u, settings.bounce_samples); j++) {
        let w = direction(j);
        let farthest = border_of(room, position, w).x;
        let reach = farthest - half_cell(room, w);
        word |= stop(position, w, farthest, reach) << (8u * (j - begin));
    }
    stops[i] = word;
}

/// The nearest hit along a direction, quantised; `farthest` is the distance to the border, hits beyond `reach` are ignored.
fn stop(position: vec3<f32>, w: vec3<f32>, farthest: f32, reach: f32) -> u32 {
    var nearest = OPEN;
    for (var m = 0u; m < settings.maps; m++) {
        let t = crossing(m, position, position + w * farthest, 0u);
        if t < 1.0 && t * farthest < reach {
            nearest = min(nearest, u32(t * f32(OPEN)));
        }
    }
    return nearest;
}
