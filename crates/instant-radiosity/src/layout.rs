//! Data shared by both backends, field by field as the WGSL of `shaders/wgsl/instant_radiosity` declares it.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

impl TriangleSurface {
    /// The normal of the side that a ray along `direction` meets.
    #[must_use]
    #[inline]
    pub fn facing(&self, direction: Vec3) -> Vec3 {
        if self.normal.dot(direction) > 0.0 { -self.normal } else { self.normal }
    }
}

indirect_core::wgsl_struct! {
    /// What all virtual lights have in common.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    pub struct Summary = "Summary" {
        /// What the flux of the last bounce is multiplied by, to stand for all that would follow, per channel, `≥ 1`.
        pub tail: Vec3,
        /// Area that bounds the light of each near by, m².
        pub area: f32,
    }
}

impl Default for Summary {
    fn default() -> Self {
        Self { tail: Vec3::ONE, area: 0.0 }
    }
}

indirect_core::wgsl_struct! {
    /// A triangle of the scene as light leaves it.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub struct TriangleSurface = "TriangleSurface" {
        /// Unit normal of its front; 0 for a triangle without area.
        pub normal: Vec3,
        /// Fills the row.
        pub pad0: f32,
        /// Mean Lambertian albedo, `[0, 1]`.
        pub albedo: Vec3,
        /// Fills the row.
        pub pad1: f32,
    }
}

#[cfg(feature = "gpu")]
indirect_core::wgsl_struct! {
    /// Virtual lights that send rays, and where those that the rays find go.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub(crate) struct BounceRange = "BounceRange" {
        pub(crate) source_first: u32,
        pub(crate) target_first: u32,
        pub(crate) count: u32,
        pub(crate) point_first: u32,
    }
}

#[cfg(feature = "gpu")]
indirect_core::wgsl_struct! {
    /// Lights of each part, counted through the bounces, that a dispatch sums.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub(crate) struct LightRange = "LightRange" {
        pub(crate) first: u32,
        pub(crate) end: u32,
        pub(crate) number: u32,
        pub(crate) pad0: u32,
    }
}

#[cfg(feature = "gpu")]
indirect_core::wgsl_struct! {
    /// A frame and its settings.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub(crate) struct FrameSettings = "FrameSettings" {
        pub(crate) width: u32,
        pub(crate) height: u32,
        pub(crate) interleave: u32,
        pub(crate) per_bounce: u32,
        pub(crate) bounces: u32,
        pub(crate) from_emitters: u32,
        pub(crate) tests: u32,
        pub(crate) compensated: u32,
        pub(crate) seed: u32,
        pub(crate) lights: u32,
        pub(crate) unit: f32,
        pub(crate) bound: f32,
        pub(crate) tail: u32,
        pub(crate) emitted: f32,
        pub(crate) confidence: f32,
        pub(crate) moved: f32,
        pub(crate) turned: f32,
        pub(crate) changed: f32,
        pub(crate) outliers: f32,
        pub(crate) depth: f32,
        pub(crate) normal: f32,
        pub(crate) area: f32,
        pub(crate) moving: u32,
        pub(crate) path_tests: u32,
        pub(crate) paths: f32,
        pub(crate) path_bounces: u32,
        pub(crate) path_parts: u32,
        pub(crate) inner: u32,
        pub(crate) branches: u32,
        pub(crate) pad0: u32,
        pub(crate) pad1: u32,
        pub(crate) pad2: u32,
    }
}

indirect_core::wgsl_struct! {
    /// How a run of `bounce` chooses among points of the scene.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable)]
    pub struct PointChoice = "PointChoice" {
        /// Points of each virtual light.
        pub each: u32,
        /// 1 where the brightest is taken, with its own light alone, as the thesis prints it.
        pub brightest: u32,
        /// Chooses the points of each light, and among them.
        pub seed: u32,
        /// Fills the row.
        pub pad0: u32,
    }
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::*;
    use indirect_gpu::shaders::{
        INSTANT_RADIOSITY_BOUNCE, INSTANT_RADIOSITY_COMPENSATE, INSTANT_RADIOSITY_EMIT,
        INSTANT_RADIOSITY_GATHER, INSTANT_RADIOSITY_MERGE, INSTANT_RADIOSITY_POINTS,
        INSTANT_RADIOSITY_SUMMARY,
    };
    use testkit::layout::check;

    #[test]
    fn structs_lie_in_memory_as_in_wgsl() {
        check::<photon_tracing::Emitter>(&INSTANT_RADIOSITY_EMIT).unwrap();
        check::<TriangleSurface>(&INSTANT_RADIOSITY_BOUNCE).unwrap();
        check::<BounceRange>(&INSTANT_RADIOSITY_BOUNCE).unwrap();
        check::<PointChoice>(&INSTANT_RADIOSITY_POINTS).unwrap();
        check::<Summary>(&INSTANT_RADIOSITY_SUMMARY).unwrap();
        check::<LightRange>(&INSTANT_RADIOSITY_GATHER).unwrap();
        check::<photon_tracing::PunctualLight>(&INSTANT_RADIOSITY_COMPENSATE).unwrap();
        check::<FrameSettings>(&INSTANT_RADIOSITY_MERGE).unwrap();
    }
}
