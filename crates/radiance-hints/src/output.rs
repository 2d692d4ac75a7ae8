use glam::{Vec3, Vec4};
use indirect_core::Image;
use indirect_filter::History;
use rsm::Rsm;

use crate::layout::{Near, Sample, Surroundings};

/// The technique.
#[derive(Debug, Clone, Copy)]
pub struct RadianceHints;

/// The indirect light of a frame and everything that was computed on the way.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Output {
    /// The maps.
    pub rsm: Rsm,
    /// The lists of samples, one after the other.
    pub samples: Vec<Sample>,
    /// The windows and their samples; empty for other samplings than [`Sampling::Nearby`](crate::Sampling::Nearby).
    pub near: Near,
    /// Occlusion between hints and samples, see [`occlusion`](crate::cpu::occlusion()); empty where nothing is tested.
    pub blocked: Vec<u32>,
    /// Quantised hit distances along the directions of later bounces, see [`stops`](crate::cpu::stops()); empty where
    /// nothing is tested.
    pub stops: Vec<u32>,
    /// The hints after each bounce, W/(sr·m²): [`Order::vectors`](crate::Order::vectors) vectors each, see
    /// [`pack`](crate::cpu::pack).
    pub bounces: Vec<Vec<Vec4>>,
    /// Mean albedo and distances of the lit surfaces around each hint; empty for one bounce.
    pub surroundings: Vec<Surroundings>,
    /// Irradiance per texel of the reduced image, W/m²; empty at full resolution.
    pub low: Vec<Vec3>,
    /// Irradiance per pixel, W/m².
    pub irradiance: Vec<Vec3>,
    /// What the next frame is blended with; none where nothing is smoothed.
    pub history: Option<History>,
    /// Indirect radiance that leaves each pixel, W/(sr·m²); 0 where the camera sees nothing.
    pub image: Image,
}
