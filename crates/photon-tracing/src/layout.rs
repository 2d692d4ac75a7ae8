//! Data shared by both backends, field by field as the WGSL of `shaders/wgsl/photons` declares it.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use indirect_core::{Light, LightKind};

indirect_core::wgsl_struct! {
    /// An emissive triangle. 64 bytes.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub struct Emitter = "Emitter" {
        /// A corner, metres.
        pub corner: Vec3,
        /// Share of the flux of all emitters up to this one and with it, `(0, 1]`.
        pub upto: f32,
        /// From the corner to the next, metres.
        pub edge_u: Vec3,
        /// 1 where the back emits too.
        pub two_sided: u32,
        /// From the corner to the last, metres.
        pub edge_v: Vec3,
        /// Fills the row.
        pub pad0: u32,
        /// Mean emitted radiance, W/(sr·m²).
        pub radiance: Vec3,
        /// Fills the row.
        pub pad1: u32,
    }
}

indirect_core::wgsl_struct! {
    /// A punctual light. 64 bytes.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub struct PunctualLight = "PunctualLight" {
        /// Position, metres; of a directional light its direction of travel.
        pub place: Vec3,
        /// 1 for a directional light.
        pub directional: u32,
        /// Direction of a spot's axis. Among [`Sources`](crate::Sources), of a directional light the middle of the rectangle where its
        /// photons start, metres.
        pub axis: Vec3,
        /// Cosine of a spot's outer angle; −2 for any other light.
        pub cos_outer: f32,
        /// [`Light::power`].
        pub power: Vec3,
        /// One over the difference of a spot's cosines, as [`indirect_core::spot_attenuation`] bounds it.
        pub spot_scale: f32,
        /// One over the range, 1/m; 0 without a range.
        pub inverse_range: f32,
        /// Among [`Sources`](crate::Sources), share of the flux of all punctual lights up to this one and with it, `(0, 1]`; else 0.
        pub upto: f32,
        /// Among [`Sources`](crate::Sources), half the rectangle's side along the first vector of
        /// [`orthonormal_basis`](indirect_core::math::orthonormal_basis) of `place`, metres; else 0.
        pub half_width: f32,
        /// The same along the second vector.
        pub half_height: f32,
    }
}

impl PunctualLight {
    /// A light as shaders evaluate it.
    #[must_use]
    pub fn new(light: &Light) -> Self {
        let l = Self {
            power: light.power,
            cos_outer: -2.0,
            spot_scale: 1.0,
            // Finite: a product with the distance 0 is no NaN.
            inverse_range: light.range.map_or(0.0, |r| (1.0 / r).min(f32::MAX)),
            ..Self::default()
        };
        match light.kind {
            LightKind::Directional { direction } => Self { place: direction, directional: 1, ..l },
            LightKind::Point { position } => Self { place: position, ..l },
            LightKind::Spot { position, direction, inner_angle, outer_angle } => Self {
                place: position,
                axis: direction,
                cos_outer: outer_angle.cos(),
                spot_scale: 1.0 / (inner_angle.cos() - outer_angle.cos()).max(0.001),
                ..l
            },
        }
    }
}

indirect_core::wgsl_struct! {
    /// A photon on its way. 64 bytes.
    ///
    /// After `emit` it is where light starts; after each `trace` one that is alive is a stored photon of its last reflection: its flux
    /// is reflected there and its direction the one in which it goes on.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub struct Photon = "Photon" {
        /// Where it was emitted, last reflected or absorbed, metres.
        pub position: Vec3,
        /// [`Photon::ABSORBED`], [`Photon::ALIVE`] or [`Photon::ESCAPED`].
        pub state: u32,
        /// Unit direction of travel: onwards where it is alive, else the last.
        pub direction: Vec3,
        /// Reflections behind it.
        pub reflections: u32,
        /// Flux that it carries, W, or had when it ended; 0 for a photon that never was.
        pub flux: Vec3,
        /// One over the range of the punctual light that it comes from, 1/m, until it meets a surface; else 0.
        pub inverse_range: f32,
        /// Unit normal of the surface that it left, on its side; 0 where it comes from a punctual light.
        pub normal: Vec3,
        /// Fills the row.
        pub pad0: u32,
    }
}

impl Photon {
    /// Ended at a surface, or never was.
    pub const ABSORBED: u32 = 0;
    /// Goes on.
    pub const ALIVE: u32 = 1;
    /// Met no surface.
    pub const ESCAPED: u32 = 2;

    /// Whether it goes on.
    #[must_use]
    #[inline]
    pub const fn is_alive(&self) -> bool {
        self.state == Self::ALIVE
    }
}

indirect_core::wgsl_struct! {
    /// What both passes read. 32 bytes.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub struct PhotonSettings = "PhotonSettings" {
        /// Photons to emit.
        pub photons: u32,
        /// Chooses places, directions and ends.
        pub seed: u32,
        /// Emissive triangles.
        pub emitters: u32,
        /// Punctual lights that are not black.
        pub lights: u32,
        /// Luminance of the flux of each photon, W; 0 where nothing emits.
        pub share: f32,
        /// Share of the flux that punctual lights have, `[0, 1]`.
        pub lights_share: f32,
        /// Characteristic length of the scene, metres.
        pub unit: f32,
        /// Fills the row.
        pub pad0: u32,
    }
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::*;
    use indirect_gpu::shaders::{PHOTONS_EMIT, PHOTONS_TRACE};
    use testkit::layout::{check, check_constant};

    #[test]
    fn structs_and_constants_are_those_of_the_shaders() {
        check::<Emitter>(&PHOTONS_EMIT).unwrap();
        check::<PunctualLight>(&PHOTONS_EMIT).unwrap();
        for module in [&PHOTONS_EMIT, &PHOTONS_TRACE] {
            check::<Photon>(module).unwrap();
            check::<PhotonSettings>(module).unwrap();
            check_constant(module, "PHOTON_ABSORBED", Photon::ABSORBED).unwrap();
            check_constant(module, "PHOTON_ALIVE", Photon::ALIVE).unwrap();
            check_constant(module, "PHOTON_ESCAPED", Photon::ESCAPED).unwrap();
        }
    }
}
