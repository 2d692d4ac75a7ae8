// A renderer that knows nothing of this workspace: instances of a square, three render targets.

struct Instance {
    world: mat4x4<f32>,
    albedo: vec4<f32>,
}

struct Seen {
    @builtin(position) clip: vec4<f32>,
    @location(0) normal: vec3<f32>,
    @location(1) @interpolate(flat) albedo: vec3<f32>,
}

@group(0) @binding(0) var<uniform> clip_from_world: mat4x4<f32>;
@group(0) @binding(1) var<storage, read> instances: array<Instance>;

@vertex
fn vertex(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> Seen {
    var corners = array<vec2<f32>, 6>(
        vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, 1.0),
    );
    let i = instances[instance];
    let world = i.world * vec4(corners[vertex], 0.0, 1.0);
    return Seen(clip_from_world * world, (i.world * vec4(0.0, 0.0, 1.0, 0.0)).xyz, i.albedo.xyz);
}

struct Targets {
    @location(0) normal: vec4<f32>,
    @location(1) albedo: vec4<f32>,
}

@fragment
fn fragment(seen: Seen, @builtin(front_facing) front: bool) -> Targets {
    let n = normalize(select(-seen.normal, seen.normal, front));
    return Targets(vec4(n * 0.5 + 0.5, 1.0), vec4(seen.albedo, 1.0));
}
