// emit_photons: photons where light starts.
// Twin: crates/photon-tracing/src/cpu/emit.rs, spot.rs, which say why.

@group(0) @binding(0) var<uniform> photon_settings: PhotonSettings;
@group(0) @binding(1) var<storage, read> emitters: array<Emitter>;
@group(0) @binding(2) var<storage, read> photon_lights: array<PunctualLight>;
@group(0) @binding(3) var<storage, read_write> photons: array<Photon>;

@compute @workgroup_size(64)
fn emit_photons(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < photon_settings.photons {
        photons[i] = emitted_photon(i);
    }
}

fn emitted_photon(i: u32) -> Photon {
    let s = photon_settings;
    if s.share <= 0.0 {
        return Photon();
    }
    let u = sobol_2d(i, hash_combine(s.seed, 0u));
    if s.lights > 0u && u.x < s.lights_share {
        let chosen = light_pick(s.lights, min(u.x / s.lights_share, PHOTONS_BELOW_ONE));
        return photon_of_light(photon_lights[chosen.index], vec2(chosen.x, u.y), s.share);
    }
    if s.emitters == 0u {
        return Photon();
    }
    let x = (u.x - s.lights_share) / max(1.0 - s.lights_share, 1.1754944e-38);
    let chosen = emitter_pick(s.emitters, clamp(x, 0.0, PHOTONS_BELOW_ONE));
    let e = emitters[chosen.index];
    let at = emitter_point(e, vec2(chosen.x, u.y));
    let w = hemisphere_cosine(sobol_2d(i, hash_combine(s.seed, 1u)));
    let flux = e.radiance * (s.share / photon_luminance(e.radiance));
    return Photon(at.position, PHOTON_ALIVE, to_world(w, at.normal), 0u, flux, 0.0, at.normal, 0u);
}

/// As emitter_pick.
fn light_pick(count: u32, x: f32) -> Pick {
    var low = 0u;
    var high = count;
    while low < high {
        let middle = (low + high) / 2u;
        if photon_lights[middle].upto <= x {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    let i = min(low, count - 1u);
    var before = 0.0;
    if i > 0u {
        before = photon_lights[i - 1u].upto;
    }
    return Pick(i, clamp((x - before) / max(photon_lights[i].upto - before, 1.1754944e-38), 0.0, PHOTONS_BELOW_ONE));
}

fn photon_of_light(light: PunctualLight, u: vec2<f32>, share: f32) -> Photon {
    let flux = light.power * (share / photon_luminance(light.power));
    if light.directional == 1u {
        let across = vec3(light.half_width * (2.0 * u.x - 1.0), light.half_height * (2.0 * u.y - 1.0), 0.0);
        let start = light.axis + to_world(across, light.place);
        return Photon(start, PHOTON_ALIVE, light.place, 0u, flux, 0.0, vec3(0.0), 0u);
    }
    var direction: vec3<f32>;
    if light.cos_outer < -1.0 {
        direction = sphere_uniform(u);
    } else {
        direction = to_world(spot_direction(light, u), light.axis);
    }
    return Photon(light.place, PHOTON_ALIVE, direction, 0u, flux, light.inverse_range, vec3(0.0), 0u);
}

/// A direction about z in proportion to a spot's intensity.
fn spot_direction(light: PunctualLight, u: vec2<f32>) -> vec3<f32> {
    // Full intensity is reached at this cosine, unless even the axis is short of it.
    let edge = min(light.cos_outer + 1.0 / light.spot_scale, 1.0);
    let fall = edge - light.cos_outer;
    let inner = 1.0 - edge;
    let brightest = fall * light.spot_scale;
    let falloff = fall * (brightest * brightest) * (1.0 / 3.0);
    let p = disc_concentric(u);
    let r2 = min(dot(p, p), 1.0);
    let q = r2 * (inner + falloff);
    // 1 − cosθ.
    var h = q;
    if q >= inner {
        let rest = clamp((inner + falloff - q) / max(falloff, 1.1754944e-38), 0.0, 1.0);
        h = (1.0 - light.cos_outer) - fall * cube_root(rest);
    }
    let sine = sqrt(max(h * (2.0 - h), 0.0));
    return vec3(p * (sine / max(sqrt(r2), 1.1754944e-38)), 1.0 - h);
}

/// The cube root of a number in [0, 1].
fn cube_root(x: f32) -> f32 {
    var y = bitcast<f32>(bitcast<u32>(x) / 3u + 709921077u);
    for (var k = 0u; k < 3u; k++) {
        y = (y + y + x / (y * y)) * (1.0 / 3.0);
    }
    return y;
}

/// Twin of indirect_core::math::luminance.
fn photon_luminance(rgb: vec3<f32>) -> f32 {
    return dot(rgb, vec3(0.2126, 0.7152, 0.0722));
}
