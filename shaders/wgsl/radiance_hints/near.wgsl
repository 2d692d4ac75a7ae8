// near: stratified samples of the lit surface close to a hint; one dispatch per map, after `sample`.
// Twin: crates/radiance-hints/src/cpu/near.rs, which explains the method. Part of the module of sample.wgsl.

@group(0) @binding(10) var<storage, read_write> windows: array<Window>;

const REACH: f32 = 1.0;
const SPAN: f32 = 0.7;
const OFF_CENTRE: f32 = 0.38;

@compute @workgroup_size(64)
fn sample_near(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let hint = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if hint >= lattice.hints {
        return;
    }
    if current.value == 0u {
        windows[hint] = Window();
    }
    near_in_map(hint);
}

/// Gives the hint a window in this map, if more light comes from there than from the window that it has.
fn near_in_map(hint: u32) {
    let view = views[current.value];
    let position = lattice_position(hint);
    let diagonal = length(lattice.volume[lattice_volume(hint)].cell);
    let n = settings.resolution;
    let side = settings.side;
    let plane = view_image_point(view, position);
    if plane.z <= 0.0 {
        return;
    }
    // The projection of a hint outside of the light's view is clamped to the border of the map.
    let at = clamp(plane.xy * f32(n), vec2(0.0), vec2(f32(n) - 0.5));
    let texel = u32(at.y) * n + u32(at.x);
    let v = position - positions[texel].xyz;
    let d2 = dot(v, v);
    // Where the map sees nothing the normal is 0.
    let near = d2 < (REACH * diagonal) * (REACH * diagonal) && dot(normals[texel].xyz, v) > 0.0;
    if !near {
        return;
    }
    // The finest nodes of which `side` are as wide as the window has to be.
    let wanted = SPAN * diagonal / (f32(side) * texel_edge(view, positions[texel].w, n));
    var top = 0u;
    while any(warp_level_size(vec2(n), top) > vec2(1u)) {
        top += 1u;
    }
    var fine = 0u;
    while fine < top && f32(1u << fine) < wanted {
        fine += 1u;
    }
    let coarse = min(fine + 1u, top);
    let width = warp_level_size(vec2(n), coarse).x;
    let outer = min(window_begin(at, coarse, side), vec2(width - min(side, width)));
    let end = min(outer + side, vec2(width));
    let coarse_begin = warp_level_begin(vec2(n), coarse);
    var flux = 0.0;
    for (var y = outer.y; y < end.y; y++) {
        for (var x = outer.x; x < end.x; x++) {
            flux += luminance(nodes[coarse_begin + y * width + x].reflected);
        }
    }
    let score = flux / max(d2, 0.25 * diagonal * diagonal);
    let better = score > windows[hint].score;
    if !better {
        return;
    }
    windows[hint] = Window(
        min(outer << vec2(coarse), vec2(n)), min(end << vec2(coarse), vec2(n)), current.value, score, 0u, 0u,
    );

    let begin = INTERLEAVE * INTERLEAVE * INTERLEAVE * settings.samples + hint * settings.near;
    for (var k = 0u; k < settings.near; k++) {
        samples[begin + k] = Sample();
    }
    let scramble = hash_combine(settings.seed, hint);
    var k = 0u;
    // Where there is no coarser level, the window is the map.
    let half = select(0u, side / 2u, coarse > fine);
    let inner = clamp(window_begin(at, coarse, half), outer, outer + side - half);
    for (var y = outer.y; y < end.y; y++) {
        for (var x = outer.x; x < end.x; x++) {
            let node = vec2(x, y);
            if any(node < inner) || any(node >= inner + half) {
                draw_near(begin + k, coarse, node, sobol_2d(k, scramble));
                k += 1u;
            }
        }
    }
    let fine_end = min(2u * (inner + half), warp_level_size(vec2(n), fine));
    for (var y = 2u * inner.y; y < fine_end.y; y++) {
        for (var x = 2u * inner.x; x < fine_end.x; x++) {
            draw_near(begin + k, fine, vec2(x, y), sobol_2d(k, scramble));
            k += 1u;
        }
    }
}

/// The first of `count` nodes around a projection.
fn window_begin(at: vec2<f32>, level: u32, count: u32) -> vec2<u32> {
    return vec2<u32>(max(at / f32(1u << level) - 0.5 * f32(count) + OFF_CENTRE, vec2(0.0)));
}

/// Edge of a texel at a depth, metres.
fn texel_edge(view: View, depth: f32, resolution: u32) -> f32 {
    let half = max(view.half_extent.x, view.half_extent.y) * select(depth, 1.0, view.orthographic != 0u);
    return 2.0 * half / f32(resolution);
}

/// Draws a texel of the node that stands for the whole node; no sample where the node reflects nothing.
fn draw_near(slot: u32, level: u32, node: vec2<u32>, u: vec2<f32>) {
    let size = vec2(settings.resolution);
    let i = warp_level_begin(size, level) + node.y * warp_level_size(size, level).x + node.x;
    if luminance(nodes[i].reflected) > 0.0 {
        let drawn = warp_sample_within(level, node, u, size);
        samples[slot] = sample_of_texel(drawn.texel.y * settings.resolution + drawn.texel.x, 1.0 / drawn.pdf);
    }
}
