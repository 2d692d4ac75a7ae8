// What a ray meets, through the scene's acceleration structure. Needs accel_nodes, accel_triangles, triangle_normals: array<u32>.
// Twin: Sight::look in crates/sh-grid-raytracer/src/cpu/field.rs.

fn look_along(origin: vec3<f32>, direction: vec3<f32>, area: f32) -> Look {
    var look: Look;
    look.place = NO_CELL;
    let hit = accel_closest_hit(origin, direction, 0x1.fffffep+127f);
    if hit.triangle >= arrayLength(&triangle_normals) {
        return look;
    }
    look.mark = hit.triangle + 1u;
    look.origin = grid_local(origin);
    look.distance = hit.t / settings.cell;
    let at = look.origin + direction * look.distance;
    look.place = boundary_at(at);
    look.cell = vec3<u32>(max(at, vec3(0.0)));
    let n = octahedral_unpack(triangle_normals[hit.triangle]);
    look.normal = select(n, -n, dot(n, direction) > 0.0);
    look.direction = direction;
    look.area = area * look.distance * look.distance;
    return look;
}
