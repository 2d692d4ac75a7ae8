// gather_cuts: the irradiance that a tile's cut through the tree over all virtual lights casts on each of its pixels.
// Twin: crates/instant-radiosity/src/cpu/cuts.rs.
// Source: Walter et al. 2005, "Lightcuts"; Nichols, Shopf & Wyman 2009, §3.5.1; Yuksel 2019, "Stochastic Lightcuts".

@group(0) @binding(0) var<uniform> settings: FrameSettings;
@group(0) @binding(1) var<uniform> summary: Summary;
@group(0) @binding(2) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> vpls: array<Vpl>;
@group(0) @binding(5) var<storage, read> branches: array<Branch>;
@group(0) @binding(6) var<storage, read_write> gathered: array<vec4<f32>>;

/// Pixels of a tile, across and down.
const TILE_WIDTH: u32 = 4u;
const TILE_HEIGHT: u32 = 2u;
/// Branches that a tile visits before it takes the rest as they come.
const MOST_VISITED: u32 = 16384u;
/// Levels that a draw descends before it takes a representative.
const DESCENT: u32 = 4u;
/// Distinguishes the numbers that draw lights beneath branches.
const DRAWS: u32 = 0x201u;

/// Bounding box of the tile's pixels.
var<private> low: vec3<f32>;
var<private> high: vec3<f32>;

@compute @workgroup_size(64)
fn gather_cuts(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    // The pixels of a tile follow each other: they walk the same branches.
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    let tile = i / (TILE_WIDTH * TILE_HEIGHT);
    let lane = i % (TILE_WIDTH * TILE_HEIGHT);
    let across = (settings.width + TILE_WIDTH - 1u) / TILE_WIDTH;
    let x0 = tile % across * TILE_WIDTH;
    let y0 = tile / across * TILE_HEIGHT;
    let x = x0 + lane % TILE_WIDTH;
    let y = y0 + lane / TILE_WIDTH;
    if x >= settings.width || y >= settings.height {
        return;
    }
    let pixel = y * settings.width + x;
    let n = normals[pixel].xyz;
    if all(n == vec3(0.0)) {
        gathered[pixel] = vec4(0.0);
        return;
    }
    low = vec3(0x1.fffffep+127f);
    high = vec3(-0x1.fffffep+127f);
    for (var k = 0u; k < TILE_WIDTH * TILE_HEIGHT; k++) {
        let qx = x0 + k % TILE_WIDTH;
        let qy = y0 + k / TILE_WIDTH;
        if qx < settings.width && qy < settings.height {
            let q = qy * settings.width + qx;
            if any(normals[q].xyz != vec3(0.0)) {
                low = min(low, positions[q].xyz);
                high = max(high, positions[q].xyz);
            }
        }
    }
    let light = cut_light(pixel, positions[pixel].xyz, n);
    gathered[pixel] = vec4(light, f32(choices));
}

/// Whether the tile needs the children of branch `i`, of which `visited` have been visited.
fn needs_children(i: u32, visited: u32) -> bool {
    let position = branches[i].position;
    let reach = branches[i].reach;
    let v = min(max(position, low), high) - position;
    return reach > 0.0 && dot(v, v) < reach * reach && visited < MOST_VISITED;
}

/// What part of a branch's flux arrives at a pixel, 1/m².
fn branch_factor(i: u32, p: vec3<f32>, n: vec3<f32>) -> f32 {
    let light = Vpl(branches[i].position, branches[i].area, branches[i].normal, 0.0, branches[i].flux, 0.0);
    let area = select(light.area, summary.area, settings.compensated == 1u);
    return unshadowed_factor(light, area, p, n);
}

fn cut_light(pixel: u32, p: vec3<f32>, n: vec3<f32>) -> vec3<f32> {
    var sum = vec3(0.0);
    var total = 0.0;
    var length = 0u;
    var visited = 0u;
    var i = 0u;
    while i < settings.branches {
        visited += 1u;
        if needs_children(i, visited) {
            i = branches[i].child;
            continue;
        }
        let flux = branches[i].flux;
        if weight(flux) > 0.0 {
            length += 1u;
            total += luminance(flux) * branch_factor(i, p, n);
        }
        i = branches[i].next;
    }
    // Neighbours by which a cut differs are a choice as well.
    note(length);
    let tests = settings.tests;
    if tests > 0u && total <= 0.0 {
        return sum;
    }
    // Evenly spaced places on the running sum, as for the lights of a part.
    let step = total / f32(max(tests, 1u));
    var next = pixel_number(pixel, settings.seed, 0u) * step;
    var running = 0.0;
    let key = hash_combine(hash_combine(pixel, settings.seed), DRAWS);
    visited = 0u;
    i = 0u;
    while i < settings.branches {
        visited += 1u;
        if needs_children(i, visited) {
            i = branches[i].child;
            continue;
        }
        let flux = branches[i].flux;
        if weight(flux) > 0.0 {
            let factor = branch_factor(i, p, n);
            if tests == 0u {
                if factor > 0.0 {
                    if asks(branches[i].representative, p, n) {
                        sum += flux * factor;
                    }
                }
            } else {
                let own = luminance(flux) * factor;
                running += own;
                if own > 0.0 && running > next {
                    let times = ceil((running - next) / step);
                    next += times * step;
                    if asks(draw(i, key), p, n) {
                        sum += flux * (times * step / luminance(flux));
                    }
                }
            }
        }
        i = branches[i].next;
    }
    return sum;
}

/// One of the lights beneath a branch, in proportion to its flux.
fn draw(branch: u32, key: u32) -> u32 {
    var i = branch;
    for (var level = 0u; level < DESCENT && i < settings.inner; level++) {
        let first = branches[i].child;
        let second = branches[first].next;
        var chosen = first;
        // A branch whose first child is its last has one.
        if second != branches[i].next {
            let a = weight(branches[first].flux);
            let b = weight(branches[second].flux);
            if unit_f32(hash_combine(key, i)) * (a + b) >= a {
                chosen = second;
            }
        }
        i = chosen;
    }
    return branches[i].representative;
}
