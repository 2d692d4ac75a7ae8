// bounce: the virtual lights of the next bounce, one ray from each of this one.
// Twin: crates/instant-radiosity/src/cpu/bounce.rs.

@group(0) @binding(0) var<uniform> settings: FrameSettings;
@group(0) @binding(1) var<uniform> range: BounceRange;
@group(0) @binding(2) var<storage, read> accel_nodes: array<AccelNode>;
@group(0) @binding(3) var<storage, read> accel_triangles: array<AccelTriangle>;
@group(0) @binding(4) var<storage, read> surfaces: array<TriangleSurface>;
@group(0) @binding(5) var<storage, read> bounce_points: array<vec2<f32>>;
@group(0) @binding(6) var<storage, read_write> vpls: array<Vpl>;

@compute @workgroup_size(64)
fn bounce_rays(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) local_index: u32,
) {
    let i = grid_index(workgroup_id, num_workgroups, local_index, 64u);
    if i < range.count {
        vpls[range.target_first + i] = along_ray(vpls[range.source_first + i], bounce_points[range.point_first + i]);
    }
}

fn along_ray(source: Vpl, u: vec2<f32>) -> Vpl {
    if all(source.flux == vec3(0.0)) {
        return Vpl();
    }
    let direction = to_world(hemisphere_cosine(u), source.normal);
    let origin = offset_ray_origin(source.position, source.normal, settings.unit);
    let hit = accel_closest_hit(origin, direction, 0x1.fffffep+127f);
    if hit.triangle >= arrayLength(&surfaces) {
        return Vpl();
    }
    let surface = surfaces[hit.triangle];
    let normal = select(surface.normal, -surface.normal, dot(surface.normal, direction) > 0.0);
    let position = origin + direction * hit.t;
    return Vpl(position, footprint(position, normal), normal, 0.0, source.flux * surface.albedo, 0.0);
}
