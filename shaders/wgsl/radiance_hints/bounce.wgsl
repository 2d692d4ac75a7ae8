// bounce: what hints receive from each other, for the second and every later bounce.
// Twin: crates/radiance-hints/src/cpu/bounce.rs, which holds the equation.
// Papaioannou 2011, §6 and §7, eq. 8 to 11 as docs/errata.md corrects them.

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var<uniform> lattice: Lattice;
/// After the bounce before.
@group(0) @binding(2) var<storage, read> hints: array<vec4<f32>>;
/// The field that the new light is added to: the first bounce; as printed, the bounce before.
@group(0) @binding(3) var<storage, read> base: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> surroundings: array<Surroundings>;
@group(0) @binding(5) var<storage, read_write> next: array<vec4<f32>>;

/// Quantised hit distances of the directions; one word that is not read where nothing is tested.
@group(0) @binding(6) var<storage, read> stops: array<u32>;

/// The number of the bounce.
@group(0) @binding(7) var<uniform> current: Index;

const PLACES: u32 = 4u;

@compute @workgroup_size(64)
fn bounce_directions(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let hint = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if hint >= lattice.hints {
        return;
    }
    let position = lattice_position(hint);
    let room = lattice.volume[lattice.volume[lattice_volume(hint)].room];
    var sh: array<vec3<f32>, 9>;
    for (var j = 0u; j < settings.bounce_samples; j++) {
        let w = direction(j);
        let border = border_of(room, position, w);
        var farthest = border.x;
        let stop = stop_of(hint, j);
        if stop != OPEN {
            farthest = max(farthest * (f32(stop) / f32(OPEN)) - half_cell(room, w), 0.0);
        }
        // From there inwards, until a hint sees a lit surface: others are within objects or outside of the room.
        var radiance = vec3(0.0);
        for (var i = 0u; i < PLACES; i++) {
            let q = position + w * (farthest * (1.0 - f32(i) / f32(PLACES)));
            let other = nearest_hint(q);
            if surroundings[other].r_max > 0.0 {
                var albedo = settings.enclosure[u32(border.y)].xyz;
                if settings.enclosed == 0u || stop != OPEN {
                    albedo = albedo_of(other);
                }
                radiance = radiance_from(other, w, albedo);
                break;
            }
        }
        let basis = sh_basis_l2(w);
        for (var i = 0u; i < 9u; i++) {
            sh[i] += radiance * basis[i];
        }
    }
    store(hint, sh, 4.0 * PI / f32(settings.bounce_samples));
}

@compute @workgroup_size(64)
fn bounce_sphere(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let hint = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if hint < lattice.hints {
        sphere(hint, false);
    }
}

@compute @workgroup_size(64)
fn bounce_sphere_as_printed(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let hint = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if hint < lattice.hints {
        sphere(hint, true);
    }
}

fn sphere(hint: u32, printed: bool) {
    let position = lattice_position(hint);
    let volume = lattice.volume[lattice.volume[lattice_volume(hint)].room];
    let extent = volume.cell * vec3<f32>(volume.resolution);
    let reach = settings.range * length(extent);
    let own = surroundings[hint];
    let key = hash_combine(hash_combine(settings.seed, current.value), hint);
    var sh: array<vec3<f32>, 9>;
    var weights = 0.0;
    var visible = 0.0;
    var confident = 0.0;
    for (var j = 0u; j < settings.bounce_samples; j++) {
        let w = sphere_uniform(sobol_2d(j, key));
        // The largest of three even numbers has the density 3r² of the radius in a ball.
        let u0 = unit_f32(hash_combine(key, 3u * j));
        let u1 = unit_f32(hash_combine(key, 3u * j + 1u));
        let u2 = unit_f32(hash_combine(key, 3u * j + 2u));
        let r = max(max(u0, u1), u2) * reach;
        let q = position + w * r;
        let t = q - volume.origin;
        if any(t < vec3(0.0)) || any(t > extent) {
            continue;
        }
        let other = nearest_hint(q);
        let r_min = surroundings[other].r_min;
        let v = visibility(r, own.r_min + r_min, own.r_max + surroundings[other].r_max);
        let c = max(1.0 - r_min / reach, 0.0);
        let albedo = select(albedo_of(other), vec3(1.0), printed);
        let radiance = radiance_from(other, w, albedo) * (v * c);
        let basis = sh_basis_l2(w);
        for (var i = 0u; i < 9u; i++) {
            sh[i] += radiance * basis[i];
        }
        weights += v * c;
        visible += v;
        confident += c;
    }
    let total = select(weights, visible * confident, printed);
    store(hint, sh, select(0.0, 4.0 * PI / total, total > 0.0));
}

/// The quantised hit distance of direction j; OPEN where nothing was tested.
fn stop_of(hint: u32, j: u32) -> u32 {
    if settings.stop_words == 0u {
        return OPEN;
    }
    return (stops[hint * settings.stop_words + j / 4u] >> (8u * (j % 4u))) & 255u;
}

fn store(hint: u32, sh: array<vec3<f32>, 9>, scale: f32) {
    let begin = hint * settings.vectors;
    var vectors = pack_hint(sh);
    for (var i = 0u; i < settings.vectors; i++) {
        next[begin + i] = base[begin + i] + vectors[i] * scale;
    }
}

/// The radiance that a surface of this albedo at the position of a hint reflects towards -w.
fn radiance_from(hint: u32, w: vec3<f32>, albedo: vec3<f32>) -> vec3<f32> {
    let lobe = cosine_lobe(-w);
    let low_band = vec4(lobe[0], lobe[1], lobe[2], lobe[3]);
    let high_band = vec4(lobe[4], lobe[5], lobe[6], lobe[7]);
    let irradiance = hint_weigh(hint, low_band, high_band, lobe[8]);
    return albedo * INV_PI * max(irradiance, vec3(0.0));
}

fn albedo_of(hint: u32) -> vec3<f32> {
    let albedo = surroundings[hint].albedo;
    return vec3(albedo[0], albedo[1], albedo[2]);
}

/// Eq. 11; a step where both distances are the same.
fn visibility(d: f32, near: f32, far: f32) -> f32 {
    if far > near {
        return 1.0 - clamp((d - near) / (far - near), 0.0, 1.0);
    }
    return select(0.0, 1.0, d <= near);
}
