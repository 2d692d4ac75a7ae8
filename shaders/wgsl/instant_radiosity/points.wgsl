// bounce among points of the scene: each virtual light lights its own points, one of which becomes the next.
// Twin: crates/instant-radiosity/src/cpu/points.rs.
// Source: thesis §3.6; docs/errata.md; weighted reservoir sampling: Chao 1982.

struct PointChoice {
    /// Points of each virtual light.
    each: u32,
    brightest: u32,
    seed: u32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> settings: FrameSettings;
@group(0) @binding(1) var<uniform> range: BounceRange;
@group(0) @binding(2) var<uniform> choice: PointChoice;
@group(0) @binding(3) var<uniform> ism: Ism;
@group(0) @binding(4) var<storage, read> ism_points: array<IsmPoint>;
@group(0) @binding(5) var<storage, read> accel_nodes: array<AccelNode>;
@group(0) @binding(6) var<storage, read> accel_triangles: array<AccelTriangle>;
@group(0) @binding(7) var<storage, read_write> vpls: array<Vpl>;

@compute @workgroup_size(64)
fn bounce_points(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < range.count {
        vpls[range.target_first + i] = among_points(i, vpls[range.source_first + i]);
    }
}

/// A point of the scene as a light sees it.
struct Lit {
    reflected: vec3<f32>,
    valid: bool,
    normal: vec3<f32>,
}

fn among_points(j: u32, source: Vpl) -> Vpl {
    let count = ism.points;
    if all(source.flux == vec3(0.0)) || count == 0u {
        return Vpl();
    }
    let each = min(choice.each, count);
    let first = hash_combine(choice.seed, j) % count;
    let share = f32(count) / f32(each);
    var total = 0.0;
    var most = 0.0;
    var chosen = Vpl();
    for (var i = 0u; i < each; i++) {
        let point = ism_points[(first + i) % count];
        let found = lit(source, point, share);
        if !found.valid {
            continue;
        }
        let weight = luminance(found.reflected);
        let number = unit_f32(hash_combine(first, i ^ choice.seed));
        var wins = weight > number * (total + weight);
        if choice.brightest == 1u {
            // Only what would be chosen is asked whether it is seen.
            wins = weight > most;
            if !wins {
                continue;
            }
        }
        if !sees(source, point.position, found.normal) {
            continue;
        }
        // All that is lit counts, whether it is chosen or not.
        total += weight;
        if wins {
            most = weight;
            chosen = Vpl(point.position, 0.0, found.normal, 0.0, found.reflected, 0.0);
        }
    }
    if most <= 0.0 {
        return Vpl();
    }
    if choice.brightest == 0u {
        chosen.flux *= total / most;
    }
    chosen.area = footprint(chosen.position, chosen.normal);
    return chosen;
}

fn lit(source: Vpl, point: IsmPoint, share: f32) -> Lit {
    let none = Lit(vec3(0.0), false, vec3(0.0));
    let v = source.position - point.position;
    let d2 = dot(v, v);
    let normal = select(point.normal, -point.normal, dot(point.normal, v) < 0.0);
    let cosines = dot(normal, v) * max(-dot(source.normal, v), 0.0);
    let kernel = cosines * FRAC_1_PI / (d2 * d2);
    if !(kernel > 0.0 && kernel < 0x1.fffffep+127f) {
        return none;
    }
    let received = point.area * share * bounded(kernel, source.area);
    return Lit(source.flux * point.albedo * received, received > 0.0, normal);
}

fn sees(source: Vpl, p: vec3<f32>, n: vec3<f32>) -> bool {
    let origin = offset_ray_origin(p, n, settings.unit);
    let goal = offset_ray_origin(source.position, source.normal, settings.unit);
    return !accel_any_hit(origin, goal - origin, 1.0);
}
