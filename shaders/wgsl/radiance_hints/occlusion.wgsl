// occlusion: how much each sample is occluded from each hint, by depth images; eight samples to a word.
// Twin: crates/radiance-hints/src/cpu/occlusion.rs, which defines the numbers.
// Camera depth: Papaioannou 2011, §8.

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var<uniform> lattice: Lattice;
@group(0) @binding(2) var<storage, read> samples: array<Sample>;
@group(0) @binding(3) var<storage, read> views: array<View>;
@group(0) @binding(4) var<storage, read> depths: array<f32>;
@group(0) @binding(5) var<storage, read_write> blocked: array<u32>;
/// The view whose depths are copied.
@group(0) @binding(6) var<uniform> current: Index;
@group(0) @binding(7) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read_write> copies: array<f32>;

/// One element that is not read where there are no windows.
@group(0) @binding(9) var<storage, read> windows: array<Window>;

const POINTS: u32 = 8u;

/// The depths of one view, side by side with those of the others.
@compute @workgroup_size(64)
fn occlusion_depths(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    let count = arrayLength(&positions);
    if i < count {
        copies[current.value * count + i] = positions[i].w;
    }
}

@compute @workgroup_size(64)
fn occlusion_rsm(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < lattice.hints * settings.words {
        blocked[i] = occlusion_word(i, false);
    }
}

@compute @workgroup_size(64)
fn occlusion_camera(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < lattice.hints * settings.words {
        blocked[i] = occlusion_word(i, true);
    }
}

fn occlusion_word(i: u32, by_camera: bool) -> u32 {
    let hint = i / settings.words;
    let begin = (i % settings.words) * 8u;
    let position = lattice_position(hint);
    let cell = lattice.volume[lattice_volume(hint)].cell;
    let first = list_of(hint) * settings.samples;
    let window = window_of(hint);
    let shift = shift_of(settings.seed, hint);
    var word = 0u;
    for (var k = begin; k < min(begin + 8u, settings.samples); k++) {
        let looked = look(hint, window, first, k);
        let s = looked.sample;
        let y = place_of(position, cell, settings.jitter, shift, k);
        if s.area * looked.scale <= 0.0 || dot(s.normal, y - s.position) <= 0.0 {
            continue;
        }
        var found = 0u;
        if by_camera {
            found = hidden(s.position, y);
        } else {
            for (var m = 0u; m < settings.maps; m++) {
                // The first point is near the surface that the sample lies on.
                if crossing(m, s.position, y, 1u) < 1.0 {
                    found = 15u;
                }
            }
        }
        word |= found << (4u * (k - begin));
    }
    return word;
}

/// How many points of the segment from a to b are behind the camera's depth image.
fn hidden(a: vec3<f32>, b: vec3<f32>) -> u32 {
    var count = 0u;
    for (var i = 0u; i < POINTS; i++) {
        let t = (f32(i) + 0.5) / f32(POINTS);
        let p = a + (b - a) * t;
        // Rounding: a point on a surface is not behind it.
        let slack = 1e-3 * length(p - views[0].origin);
        if behind(0u, p) > slack {
            count += 1u;
        }
    }
    return count;
}
