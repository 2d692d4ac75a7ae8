// directions: along which directions hints gather later bounces, and where each ends.
// Twin: crates/radiance-hints/src/cpu/directions.rs.

/// The quantised hit distance of a direction without a hit.
const OPEN: u32 = 255u;

/// Direction j, the same for all bounces and all hints.
fn direction(j: u32) -> vec3<f32> {
    return sphere_uniform(sobol_2d(j, hash_combine(settings.seed, 0u)));
}

/// The distance at which a direction w of a hint ends, and the face of its box that lies there.
fn border_of(room: Volume, position: vec3<f32>, w: vec3<f32>) -> vec2<f32> {
    let border = exit(room, position, w);
    let reach = settings.range * length(room.cell * vec3<f32>(room.resolution));
    return vec2(min(border.x * settings.enclosure[u32(border.y)].w, reach), border.y);
}

/// Half of a cell along w.
fn half_cell(room: Volume, w: vec3<f32>) -> f32 {
    return 0.5 * dot(abs(w), room.cell);
}

/// Where the ray from p, inside, along w leaves the volume: distance and face, −x, +x, −y, +y, −z, +z.
fn exit(volume: Volume, p: vec3<f32>, w: vec3<f32>) -> vec2<f32> {
    let end = volume.origin + volume.cell * vec3<f32>(volume.resolution);
    var nearest = 0x1.fffffep+127;
    var face = 0u;
    for (var axis = 0u; axis < 3u; axis++) {
        if w[axis] == 0.0 {
            continue;
        }
        let up = w[axis] > 0.0;
        let t = (select(volume.origin[axis], end[axis], up) - p[axis]) / w[axis];
        if t < nearest {
            nearest = t;
            face = 2u * axis + u32(up);
        }
    }
    return vec2(max(nearest, 0.0), f32(face));
}
