// What light starts from.
// Twin: crates/photon-tracing/src/layout.rs.

/// An emissive triangle.
struct Emitter {
    corner: vec3<f32>,
    /// Share of the flux of all emitters up to this one and with it.
    upto: f32,
    edge_u: vec3<f32>,
    two_sided: u32,
    edge_v: vec3<f32>,
    pad0: u32,
    radiance: vec3<f32>,
    pad1: u32,
}

/// A punctual light.
struct PunctualLight {
    /// Position; of a directional light, its direction of travel.
    place: vec3<f32>,
    /// 1 for a directional light.
    directional: u32,
    /// Of a spot; of a directional light among the sources of photons, the middle of the rectangle where they start.
    axis: vec3<f32>,
    /// Cosine of a spot's outer angle; −2 for any other light.
    cos_outer: f32,
    power: vec3<f32>,
    spot_scale: f32,
    inverse_range: f32,
    /// Share of the flux of all punctual lights up to this one and with it.
    upto: f32,
    /// Half the sides of the rectangle.
    half_width: f32,
    half_height: f32,
}
