use glam::{Vec3, Vec4};
use indirect_core::Image;
use rsm::{Rsm, Vpl};

use crate::layout::Summary;

/// The technique.
#[derive(Debug, Clone, Copy)]
pub struct InstantRadiosity;

/// The indirect light of a frame and everything that was computed on the way.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Output {
    /// Number of the frame since the history began.
    pub frame: u32,
    /// The maps.
    pub rsm: Rsm,
    /// Virtual lights of all bounces, bounce by bounce; of the first, those from the lights' maps before those from emitters. Behind
    /// them those on emissive triangles.
    pub vpls: Vec<Vpl>,
    /// What they have in common.
    pub summary: Summary,
    /// Their shadow maps, one per virtual light of every bounce.
    #[cfg(feature = "cpu")]
    pub shadows: imperfect_shadow_maps::cpu::Atlas,
    /// The tree over the lights of all bounces, gather=cuts.
    #[cfg(feature = "cpu")]
    pub tree: rsm::cpu::LightTree,
    /// Irradiance of each pixel's part of them, W/m², and a number that differs where other lights were asked or other answers given.
    pub gathered: Vec<Vec4>,
    /// Where the surface of each pixel was in the frame before, metres; empty where nothing moved.
    pub before: Vec<Vec3>,
    /// Irradiance per pixel, and what the next frame needs of it.
    #[cfg(feature = "cpu")]
    pub history: Option<crate::cpu::History>,
    /// Indirect radiance that leaves each pixel, W/(sr·m²).
    pub image: Image,
}
