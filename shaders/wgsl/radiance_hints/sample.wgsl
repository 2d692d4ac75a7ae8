// sample: lists of samples (virtual point lights) that hints share, drawn from the maps; one dispatch per map.
// Twin: crates/radiance-hints/src/cpu/sample.rs.
// Importance: Clarberg et al. 2005, "Wavelet Importance Sampling", §3; disc: Papaioannou 2011, §4.

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var<uniform> lattice: Lattice;
/// The map that this dispatch draws from.
@group(0) @binding(2) var<uniform> current: Index;
@group(0) @binding(3) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> texels: array<Texel>;
@group(0) @binding(6) var<storage, read_write> samples: array<Sample>;
@group(0) @binding(7) var<storage, read> nodes: array<Node>;
@group(0) @binding(8) var<storage, read> tops: array<Node>;
@group(0) @binding(9) var<storage, read> views: array<View>;

const NONE: u32 = 0xffffffffu;

@compute @workgroup_size(64)
fn sample_importance(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let slot = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if slot < settings.slots {
        importance(slot, sobol_2d(index_of(slot, settings.samples), settings.seed));
    }
}

@compute @workgroup_size(64)
fn sample_disc(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let slot = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    let k = slot % settings.samples;
    if slot < settings.slots && k % settings.maps == current.value {
        samples[slot] = disc(slot / settings.samples, k);
    }
}

/// The index of a slot's point in the sequence: each list begins at an aligned block of a power of two.
fn index_of(slot: u32, count: u32) -> u32 {
    let block = 1u << (32u - countLeadingZeros(count - 1u));
    return (slot / count) * block + slot % count;
}

/// A sample at a texel of this map that stands for `scale` texels.
fn sample_of_texel(texel: u32, scale: f32) -> Sample {
    let t = texels[texel];
    return Sample(
        positions[texel].xyz, t.area * scale, normals[texel].xyz, current.value,
        t.reflected * scale, texel, t.incident * scale, 0.0,
    );
}

/// Draws a map in proportion to its reflected luminance and, if it is this one, a texel of it. The first map also clears
/// the slots that no map will fill.
fn importance(slot: u32, u: vec2<f32>) {
    var total = 0.0;
    for (var i = 0u; i < settings.maps; i++) {
        total += luminance(tops[i].reflected);
    }
    // The map in whose share of the total u.x falls; rounding at the end falls to the last map that has any.
    var chosen = NONE;
    var fraction = 0.0;
    var x = u.x * total;
    for (var i = 0u; i < settings.maps; i++) {
        let share = luminance(tops[i].reflected);
        if share > 0.0 {
            chosen = i;
            fraction = x / share;
            if x < share {
                break;
            }
            x -= share;
        }
    }
    if chosen == NONE && current.value == 0u {
        samples[slot] = Sample();
    }
    if chosen == current.value {
        let drawn = warp_sample(vec2(fraction, u.y), vec2(settings.resolution));
        let texel = drawn.texel.y * settings.resolution + drawn.texel.x;
        let p = luminance(tops[chosen].reflected) / total * drawn.pdf;
        samples[slot] = sample_of_texel(texel, 1.0 / (p * f32(settings.samples)));
    }
}

/// A texel of the disc around the hint's projection into this map.
fn disc(list: u32, k: u32) -> Sample {
    let count = settings.samples;
    // Samples of this list that are drawn from this map.
    let share = (count - current.value + settings.maps - 1u) / settings.maps;
    let n = f32(settings.resolution);
    let view = views[current.value];
    let centre = view_image_point(view, lattice_position(list));
    if centre.z <= 0.0 {
        return Sample();
    }
    let radius = sqrt(settings.disc * INV_PI);
    let u = sobol_2d(k / settings.maps, hash_combine(settings.seed, list));
    let at = (centre.xy + disc_concentric(u) * radius) * n;
    if !(at.x >= 0.0 && at.y >= 0.0 && at.x < n && at.y < n) {
        return Sample();
    }
    let texel = u32(at.y) * settings.resolution + u32(at.x);
    if luminance(texels[texel].reflected) <= 0.0 {
        return Sample();
    }
    return sample_of_texel(texel, settings.disc * n * n / f32(share));
}

/// Importance of a node.
fn warp_weight(i: u32) -> f32 {
    return luminance(nodes[i].reflected);
}
