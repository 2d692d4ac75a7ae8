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
    let chosen = emitter_pick(arrayLength(&emitters), u.x);
    let e = emitters[chosen.index];
    let at = emitter_point(e, vec2(chosen.x, u.y));
    let share = settings.emitted / f32(settings.from_emitters);
    let flux = e.radiance * (share / luminance(e.radiance));
    let area = share / (3.14159265358979 * luminance(e.radiance));
    return Vpl(at.position, area, at.normal, 0.0, flux, 0.0);
}
