// Photons.
// Twin: crates/photon-tracing/src/layout.rs.

/// After emission where light starts; after a flight one that is alive is stored: its flux is reflected at its position.
struct Photon {
    position: vec3<f32>,
    /// PHOTON_ABSORBED, PHOTON_ALIVE or PHOTON_ESCAPED.
    state: u32,
    direction: vec3<f32>,
    reflections: u32,
    flux: vec3<f32>,
    /// One over the range of the punctual light that it comes from, until it meets a surface; else 0.
    inverse_range: f32,
    /// Of the surface that it left; 0 where it comes from a punctual light.
    normal: vec3<f32>,
    pad0: u32,
}

/// Ended at a surface, or never was.
const PHOTON_ABSORBED: u32 = 0u;
/// Goes on.
const PHOTON_ALIVE: u32 = 1u;
/// Met no surface.
const PHOTON_ESCAPED: u32 = 2u;

struct PhotonSettings {
    photons: u32,
    seed: u32,
    emitters: u32,
    lights: u32,
    /// Luminance of the flux of each photon; 0 where nothing emits.
    share: f32,
    /// Share of the flux that punctual lights have.
    lights_share: f32,
    /// Characteristic length of the scene.
    unit: f32,
    pad0: u32,
}
