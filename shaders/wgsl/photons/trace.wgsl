// trace_photons: one flight of every photon that is alive, and its reflection. Group 0 is the scene's.
// Twin: crates/photon-tracing/src/cpu/trace.rs.
// Source: Arvo & Kirk 1990, "Particle Transport and Image Synthesis".

@group(1) @binding(0) var<uniform> photon_settings: PhotonSettings;
@group(1) @binding(1) var<storage, read> accel_nodes: array<AccelNode>;
@group(1) @binding(2) var<storage, read> accel_triangles: array<AccelTriangle>;
@group(1) @binding(3) var<storage, read_write> photons: array<Photon>;

/// Largest probability of surviving a reflection.
const PHOTON_MOST_KEPT: f32 = 0.75;
/// Surfaces of no larger albedo are black: 2⁻²⁴.
const PHOTON_LEAST_KEPT: f32 = 0x1p-24;

@compute @workgroup_size(64)
fn trace_photons(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i >= photon_settings.photons {
        return;
    }
    if photons[i].state == PHOTON_ALIVE {
        photons[i] = traced_photon(i, photons[i]);
    }
}

fn traced_photon(i: u32, before: Photon) -> Photon {
    var p = before;
    let origin = offset_ray_origin(p.position, p.normal, photon_settings.unit);
    let hit = accel_closest_hit(origin, p.direction, 0x1.fffffep+127f);
    if hit.triangle >= scene_info.triangles {
        p.state = PHOTON_ESCAPED;
        return p;
    }
    let triangle = scene_triangles[hit.triangle];
    let w = vec3(1.0 - hit.u - hit.v, hit.u, hit.v);
    let a = scene_position(triangle.x);
    let b = scene_position(triangle.y);
    let c = scene_position(triangle.z);
    // From the corners: that is on the triangle's plane to rounding, however far the ray came.
    p.position = a * w.x + b * w.y + c * w.z;
    let geometric = normalize_or(cross(b - a, c - a), vec3(0.0));
    p.normal = select(geometric, -geometric, dot(geometric, p.direction) > 0.0);
    let s = length(p.position - before.position) * p.inverse_range;
    p.flux = p.flux * clamp(1.0 - s * s * s * s, 0.0, 1.0);
    p.inverse_range = 0.0;
    p.state = PHOTON_ABSORBED;

    let albedo = surface_albedo(triangle, w);
    let kept = min(max(albedo.x, max(albedo.y, albedo.z)), PHOTON_MOST_KEPT);
    let numbers = philox4x32(vec4(i, p.reflections, 0u, 0u), vec2(photon_settings.seed, 0u));
    let ends = max(unit_f32(numbers.x), PHOTON_LEAST_KEPT) >= kept;
    if ends || all(p.flux == vec3(0.0)) || all(p.normal == vec3(0.0)) {
        return p;
    }
    p.state = PHOTON_ALIVE;
    p.direction = to_world(hemisphere_cosine(vec2(unit_f32(numbers.y), unit_f32(numbers.z))), p.normal);
    p.reflections += 1u;
    p.flux = p.flux * (albedo / kept);
    return p;
}
