// Data of the radiance hints. Twin: crates/radiance-hints/src/layout.rs, compared field by field in its tests.

/// A box of the scene, divided into cells with a hint at the centre of each.
struct Volume {
    origin: vec3<f32>,
    first: u32,
    cell: vec3<f32>,
    /// The box at whose border the directions of its hints' later bounces end.
    room: u32,
    resolution: vec3<u32>,
    pad1: u32,
}

/// All boxes, those with precedence first.
struct Lattice {
    volumes: u32,
    hints: u32,
    pad0: u32,
    pad1: u32,
    volume: array<Volume, 16>,
}

/// A virtual point light, drawn from the reflective shadow maps.
struct Sample {
    position: vec3<f32>,
    area: f32,
    normal: vec3<f32>,
    map: u32,
    flux: vec3<f32>,
    texel: u32,
    incident: vec3<f32>,
    pad1: f32,
}

/// The region of a map around a hint's projection that is sampled stratified.
struct Window {
    first: vec2<u32>,
    end: vec2<u32>,
    map: u32,
    score: f32,
    pad0: u32,
    pad1: u32,
}

/// Mean albedo and distances of the lit surfaces that a hint sees.
struct Surroundings {
    albedo: array<f32, 3>,
    r_min: f32,
    r_max: f32,
}

/// Options and parameters.
struct Settings {
    /// Samples per list.
    samples: u32,
    /// Number of maps, and texels along each side of each.
    maps: u32,
    resolution: u32,
    seed: u32,
    jitter: f32,
    footprint: f32,
    /// r_max, as a share of a volume's diagonal.
    range: f32,
    /// c_RSM, the share of the map that the disc takes.
    disc: f32,
    /// Vectors of a hint: four coefficients of red, green and blue each; four more of each, and the ninth of all three.
    vectors: u32,
    bounce_samples: u32,
    /// 0 importance, 1 disc.
    sampling: u32,
    /// Words of `blocked` per hint; 0 where nothing is tested.
    words: u32,
    /// 1 where pixels read the field as the paper prints it.
    as_printed: u32,
    /// 1 where `enclosure` is known.
    enclosed: u32,
    /// Nodes along each side of either level of a hint's window, and samples in it; 0 where there are no windows.
    side: u32,
    near: u32,
    /// Words of `stops` per hint; 0 where nothing is tested.
    stop_words: u32,
    /// Samples of all lists.
    slots: u32,
    pad0: u32,
    pad1: u32,
    /// Mean albedo and depth of the surfaces behind each face of the box: −x, +x, −y, +y, −z, +z; depth 1 where unknown.
    enclosure: array<vec4<f32>, 6>,
}

/// The number of the map, view or bounce that a dispatch is for.
struct Index {
    value: u32,
}

const PI: f32 = 3.14159265358979;
const INV_PI: f32 = 0.318309886183791;
const INTERLEAVE: u32 = 4u;
const LEAST_D2: f32 = 1e-37;

/// The box that hint `i` belongs to.
fn lattice_volume(i: u32) -> u32 {
    var v = 0u;
    for (var k = 1u; k < lattice.volumes; k++) {
        if i >= lattice.volume[k].first {
            v = k;
        }
    }
    return v;
}

/// The coordinates of its cell in that box.
fn lattice_place(i: u32) -> vec3<u32> {
    let volume = lattice.volume[lattice_volume(i)];
    let local = i - volume.first;
    let r = volume.resolution;
    return vec3(local % r.x, (local / r.x) % r.y, local / (r.x * r.y));
}

/// World position of hint `i`.
fn lattice_position(i: u32) -> vec3<f32> {
    let v = lattice_volume(i);
    return lattice.volume[v].origin + lattice.volume[v].cell * (vec3<f32>(lattice_place(i)) + 0.5);
}

/// The coefficients of a hint as it stores them; order 2 keeps the first three vectors.
fn pack_hint(sh: array<vec3<f32>, 9>) -> array<vec4<f32>, 7> {
    return array<vec4<f32>, 7>(
        vec4(sh[0].x, sh[1].x, sh[2].x, sh[3].x),
        vec4(sh[0].y, sh[1].y, sh[2].y, sh[3].y),
        vec4(sh[0].z, sh[1].z, sh[2].z, sh[3].z),
        vec4(sh[4].x, sh[5].x, sh[6].x, sh[7].x),
        vec4(sh[4].y, sh[5].y, sh[6].y, sh[7].y),
        vec4(sh[4].z, sh[5].z, sh[6].z, sh[7].z),
        vec4(sh[8], 0.0),
    );
}
