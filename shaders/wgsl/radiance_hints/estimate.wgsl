// estimate: the radiance of the first bounce that arrives at each hint, as spherical harmonics.
// Twin: crates/radiance-hints/src/cpu/estimate.rs, which holds the equation.
// Papaioannou 2011, §4, eq. 2 to 5 as docs/errata.md corrects them.

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var<uniform> lattice: Lattice;
@group(0) @binding(2) var<storage, read> samples: array<Sample>;
/// One word that is not read where nothing is tested.
@group(0) @binding(3) var<storage, read> blocked: array<u32>;
@group(0) @binding(4) var<storage, read_write> hints: array<vec4<f32>>;
/// One element that is not read where there is one bounce.
@group(0) @binding(5) var<storage, read_write> surroundings: array<Surroundings>;

/// One element that is not read where there are no windows.
@group(0) @binding(6) var<storage, read> windows: array<Window>;

@compute @workgroup_size(64)
fn estimate(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let hint = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if hint >= lattice.hints {
        return;
    }
    let position = lattice_position(hint);
    let cell = lattice.volume[lattice_volume(hint)].cell;
    let first = list_of(hint) * settings.samples;
    let window = window_of(hint);
    let shift = shift_of(settings.seed, hint);
    var sh: array<vec3<f32>, 9>;
    var r_min = 0x1.fffffep+127;
    var r_max = 0.0;
    // Reflected and incident flux weighted as this hint sees it, and unweighted.
    var seen = vec3(0.0);
    var seen_incident = vec3(0.0);
    var all_flux = vec3(0.0);
    var all_incident = vec3(0.0);
    for (var k = 0u; k < settings.samples; k++) {
        let looked = look(hint, window, first, k);
        let s = looked.sample;
        let area = s.area * looked.scale;
        let v = s.position - place_of(position, cell, settings.jitter, shift, k);
        let d2 = dot(v, v);
        if d2 < LEAST_D2 || area <= 0.0 {
            continue;
        }
        let d = sqrt(d2);
        let w = v * (1.0 / d);
        let cosine = max(-dot(s.normal, w), 0.0);
        // A disc of the sample's area: its solid angle, and the attenuation of each band by its angular extent.
        let h = sqrt(d2 + area * settings.footprint * INV_PI);
        let weight = 2.0 * cosine / (PI * h * (h + d)) * open_share(hint, k);
        let c = d / h;
        let band1 = 0.5 * (1.0 + c);
        let band2 = c * band1;
        let basis = sh_basis_l2(w);
        let flux = s.flux * looked.scale;
        let incident = s.incident * looked.scale;
        let radiance = flux * weight;
        sh[0] += radiance * basis[0];
        sh[1] += radiance * (basis[1] * band1);
        sh[2] += radiance * (basis[2] * band1);
        sh[3] += radiance * (basis[3] * band1);
        sh[4] += radiance * (basis[4] * band2);
        sh[5] += radiance * (basis[5] * band2);
        sh[6] += radiance * (basis[6] * band2);
        sh[7] += radiance * (basis[7] * band2);
        sh[8] += radiance * (basis[8] * band2);
        if weight > 0.0 {
            r_min = min(r_min, d);
            r_max = max(r_max, d);
        }
        seen += radiance;
        seen_incident += incident * weight;
        all_flux += flux;
        all_incident += incident;
    }
    let begin = hint * settings.vectors;
    var vectors = pack_hint(sh);
    for (var i = 0u; i < settings.vectors; i++) {
        hints[begin + i] = vectors[i];
    }
    if hint < arrayLength(&surroundings) {
        let albedo = array<f32, 3>(
            share(seen.x, seen_incident.x, all_flux.x, all_incident.x),
            share(seen.y, seen_incident.y, all_flux.y, all_incident.y),
            share(seen.z, seen_incident.z, all_flux.z, all_incident.z),
        );
        surroundings[hint] = Surroundings(albedo, select(0.0, r_min, r_max > 0.0), r_max);
    }
}

/// a/b, or c/d where the hint sees nothing, or 0; at most 1.
fn share(a: f32, b: f32, c: f32, d: f32) -> f32 {
    if b > 0.0 {
        return min(a / b, 1.0);
    }
    if d > 0.0 {
        return min(c / d, 1.0);
    }
    return 0.0;
}

/// The share of a sample's light that arrives.
fn open_share(hint: u32, k: u32) -> f32 {
    if settings.words == 0u {
        return 1.0;
    }
    let number = (blocked[hint * settings.words + k / 8u] >> (4u * (k % 8u))) & 15u;
    return select(1.0 / f32(1u << number), 0.0, number == 15u);
}
