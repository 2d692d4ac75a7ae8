// compensate: what bounding virtual lights removes, carried by one path per pixel.
// Twin: crates/instant-radiosity/src/cpu/compensate.rs.
// Source: Kollig & Keller 2004, "Illumination in the Presence of Weak Singularities".

@group(0) @binding(0) var<uniform> settings: FrameSettings;
@group(0) @binding(1) var<uniform> summary: Summary;
@group(0) @binding(2) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> vpls: array<Vpl>;
@group(0) @binding(5) var<storage, read> accel_nodes: array<AccelNode>;
@group(0) @binding(6) var<storage, read> accel_triangles: array<AccelTriangle>;
@group(0) @binding(7) var<storage, read> surfaces: array<TriangleSurface>;
@group(0) @binding(8) var<uniform> punctual_lights: array<PunctualLight, 1024>;
@group(0) @binding(9) var<storage, read_write> gathered: array<vec4<f32>>;

/// Keeps the reach of a path finite where its number is 0: the next number is 2⁻²⁴.
const LEAST_NUMBER: f32 = 0x1p-26;

@compute @workgroup_size(64)
fn compensate(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i >= settings.width * settings.height {
        return;
    }
    let n = normals[i].xyz;
    if any(n != vec3(0.0)) {
        let before = gathered[i];
        choices = u32(before.w);
        let more = residual(i, positions[i].xyz, n);
        gathered[i] = vec4(before.xyz + more, f32(choices));
    }
}

fn residual(i: u32, p: vec3<f32>, n: vec3<f32>) -> vec3<f32> {
    let none = vec3(0.0);
    let w = hemisphere_cosine(vec2(pixel_number(i, settings.seed, 0x101u), pixel_number(i, settings.seed, 0x102u)));
    let direction = to_world(w, n);
    let origin = offset_ray_origin(p, n, settings.unit);
    // Beyond this even surfaces that face each other end the path.
    let u = pixel_number(i, settings.seed, 0x103u);
    let t_max = sqrt(summary.area * FRAC_1_PI * (settings.paths - u) / max(u, LEAST_NUMBER));
    let hit = accel_closest_hit(origin, direction, t_max);
    if hit.triangle >= arrayLength(&surfaces) {
        return none;
    }
    let surface = surfaces[hit.triangle];
    let normal = select(surface.normal, -surface.normal, dot(surface.normal, direction) > 0.0);
    let kernel = w.z * -dot(normal, direction) * FRAC_1_PI / (hit.t * hit.t);
    let share = unbounded_share(kernel, summary.area);
    let probability = min(settings.paths * share, 1.0);
    if u >= probability {
        return none;
    }
    note(hit.triangle);
    let q = origin + direction * hit.t;
    // Few pixels come here: they can afford more than their own part, of which one light may stand for all of many.
    let parts = settings.interleave * settings.interleave;
    let end = run_length() * settings.path_bounces;
    var light = vec3(0.0);
    for (var k = 0u; k < settings.path_parts; k++) {
        let part = (part_of_pixel(i) + k * parts / settings.path_parts) % parts;
        light += emitted_at(part, q, normal, pixel_number(i, settings.seed, 0x204u + k));
        let u = pixel_number(i, settings.seed, 0x104u + k);
        light += lights_at(part, 0u, end, q, normal, settings.path_tests, u);
    }
    light = light / f32(settings.path_parts) + punctual_at(q, normal);
    return surface.albedo * light * (share / probability);
}

/// Irradiance of the punctual lights, W/m².
fn punctual_at(q: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    let origin = offset_ray_origin(q, normal, settings.unit);
    var sum = vec3(0.0);
    for (var i = 0u; i < settings.lights; i++) {
        let l = punctual_lights[i];
        var direction = -l.place;
        var t_max = 0x1.fffffep+127f;
        var irradiance = l.power;
        if l.directional == 0u {
            let v = l.place - q;
            let d2 = dot(v, v);
            let d = sqrt(d2);
            direction = v * (1.0 / d);
            t_max = d;
            let s = d * l.inverse_range;
            let window = clamp(1.0 - s * s * s * s, 0.0, 1.0);
            let a = clamp((-dot(l.axis, direction) - l.cos_outer) * l.spot_scale, 0.0, 1.0);
            irradiance = l.power * (a * a * window / d2);
        }
        let cosine = dot(normal, direction);
        if cosine > 0.0 && any(irradiance > vec3(0.0)) && irradiance.x < 3.4e38 {
            let blocked = accel_any_hit(origin, direction, t_max);
            note(u32(blocked));
            if !blocked {
                sum += irradiance * cosine;
            }
        }
    }
    return sum;
}

/// Irradiance of a part of the virtual lights on emissive triangles, W/m², one of which is asked: u in [0, 1) draws it in proportion to
/// what it would give.
fn emitted_at(part: u32, q: vec3<f32>, normal: vec3<f32>, u: f32) -> vec3<f32> {
    let parts = settings.interleave * settings.interleave;
    let run = settings.from_emitters / parts;
    let first = settings.per_bounce * settings.bounces + part * run;
    var total = 0.0;
    for (var i = first; i < first + run; i++) {
        let vpl = vpls[i];
        total += luminance(vpl.flux * unshadowed_factor(vpl, vpl.area, q, normal));
    }
    var running = 0.0;
    for (var i = first; i < first + run; i++) {
        let vpl = vpls[i];
        let e = vpl.flux * unshadowed_factor(vpl, vpl.area, q, normal);
        let weight = luminance(e);
        running += weight;
        if running > u * total {
            let origin = offset_ray_origin(q, normal, settings.unit);
            let goal = offset_ray_origin(vpl.position, vpl.normal, settings.unit);
            let seen = !accel_any_hit(origin, goal - origin, 1.0);
            note(2u * (i - first) + u32(seen));
            return select(vec3(0.0), e * (total / weight * f32(parts)), seen);
        }
    }
    return vec3(0.0);
}
