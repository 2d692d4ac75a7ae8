// emit: virtual lights on emissive triangles.
// Twin: crates/instant-radiosity/src/cpu/emit.rs.
// Source: Keller 1997, "Instant Radiosity".

@group(0) @binding(0) var<uniform> settings: FrameSettings;
@group(0) @binding(1) var<storage, read> emitters: array<Emitter>;
@group(0) @binding(2) var<storage, read> emitter_points: array<vec2<f32>>;
@group(0) @binding(3) var<storage, read_write> vpls: array<Vpl>;

@compute @workgroup_size(64)
fn emit(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < settings.from_emitters {
        vpls[settings.per_bounce * settings.bounces + i] = emit_at(emitter_points[i]);
    }
}

fn emit_at(u: vec2<f32>) -> Vpl {
    let count = arrayLength(&emitters);
    // The first whose share reaches u.x.
    var low = 0u;
    var high = count;
    while low < high {
        let middle = (low + high) / 2u;
        if emitters[middle].upto <= u.x {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    let i = min(low, count - 1u);
    let e = emitters[i];
    var before = 0.0;
    if i > 0u {
        before = emitters[i - 1u].upto;
    }
    // What is left of u.x within the triangle's share chooses the side, then the point.
    var x = clamp((u.x - before) / max(e.upto - before, 1.1754944e-38), 0.0, 0.99999994);
    var turn = 1.0;
    if e.two_sided == 1u {
        x *= 2.0;
        if x >= 1.0 {
            x -= 1.0;
            turn = -1.0;
        }
    }
    let b = triangle_uniform(vec2(x, u.y));
    let normal = normalize(cross(e.edge_u, e.edge_v)) * turn;
    let share = settings.emitted / f32(settings.from_emitters);
    let flux = e.radiance * (share / luminance(e.radiance));
    let area = share / (3.14159265358979 * luminance(e.radiance));
    return Vpl(e.corner + e.edge_u * b.x + e.edge_v * b.y, area, normal, 0.0, flux, 0.0);
}
