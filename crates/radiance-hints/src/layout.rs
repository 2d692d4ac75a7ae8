//! Data shared by both backends, field by field as the WGSL of `shaders/wgsl/radiance_hints` declares it.

use bytemuck::{Pod, Zeroable};
use glam::{UVec3, Vec3, Vec4};
use indirect_core::{Aabb, wgsl_struct};

wgsl_struct! {
    /// A box of the scene, divided into cells with a hint at the centre of each. 48 bytes.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    pub struct Volume = "Volume" {
        /// Smallest corner, metres.
        pub origin: Vec3,
        /// Number of its first hint among those of all volumes.
        pub first: u32,
        /// Edges of a cell, metres, each `> 0`.
        pub cell: Vec3,
        /// Number of the box at whose border the directions of its hints' later bounces end: the last that contains this one.
        pub room: u32,
        /// Cells along each axis, each at least 1.
        pub resolution: UVec3,
        /// Fills the row.
        pub pad1: u32,
    }
}

impl Volume {
    /// Its edges, metres.
    #[must_use]
    pub fn extent(&self) -> Vec3 {
        self.cell * self.resolution.as_vec3()
    }

    /// Its box.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        Aabb { min: self.origin, max: self.origin + self.extent() }
    }
}

wgsl_struct! {
    /// A sample of the lit surfaces: a virtual point light, drawn from the reflective shadow maps. 64 bytes.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub struct Sample = "Sample" {
        /// World position, metres.
        pub position: Vec3,
        /// Area that it stands for, m².
        pub area: f32,
        /// Unit normal of the side that is lit.
        pub normal: Vec3,
        /// Number of the map it was drawn from.
        pub map: u32,
        /// Reflected flux that it stands for, W.
        pub flux: Vec3,
        /// Number of the texel in its map, row by row.
        pub texel: u32,
        /// Incident flux that it stands for, W: `flux / incident` is the albedo.
        pub incident: Vec3,
        /// Fills the row.
        pub pad1: f32,
    }
}

wgsl_struct! {
    /// The region of a map around a hint's own projection, which is sampled node by node of the map's pyramid (stratified)
    /// instead of at random. 32 bytes.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub struct Window = "Window" {
        /// Its first texel along both axes.
        pub first: [u32; 2],
        /// Past its last texel; the same as `first` for a hint without a window.
        pub end: [u32; 2],
        /// Number of the map.
        pub map: u32,
        /// Luminance of the flux that it reflects over the squared distance, W/m²: of several maps the one with the most.
        pub score: f32,
        /// Fills the row.
        pub pad0: u32,
        /// Fills the row.
        pub pad1: u32,
    }
}

wgsl_struct! {
    /// The mean albedo of the lit surfaces that a hint sees, and the range of their distances; kept only where there is more
    /// than one bounce. 20 bytes.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub struct Surroundings = "Surroundings" {
        /// Mean albedo, `[0, 1]`: reflected over incident flux, weighted as the hint sees it.
        pub albedo: [f32; 3],
        /// Distance to the nearest sample whose lit side it sees, metres; 0 for a hint that sees none.
        pub r_min: f32,
        /// Distance to the farthest of them, metres; 0 for a hint that sees none, inside of an object or outside of the room:
        /// later bounces do not read it.
        pub r_max: f32,
    }
}

/// The windows of hints and the samples in them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Near {
    /// Texels along each side of the maps that the windows are in.
    pub resolution: u32,
    /// One per hint; none where [`Draw::near`](crate::Draw::near) is 0.
    pub windows: Vec<Window>,
    /// [`Draw::near`](crate::Draw::near) samples per hint.
    pub samples: Vec<Sample>,
}

/// Most volumes of a lattice: they share one uniform buffer.
pub(crate) const VOLUMES: usize = 16;

wgsl_struct! {
    /// All volumes.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    pub(crate) struct LatticeUniform = "Lattice" {
        /// How many of them count.
        pub(crate) volumes: u32,
        /// Hints of all of them.
        pub(crate) hints: u32,
        pub(crate) pad0: u32,
        pub(crate) pad1: u32,
        /// Those with precedence first.
        pub(crate) volume: [Volume; VOLUMES],
    }
}

wgsl_struct! {
    /// Options and parameters as shaders see them; see [`Options`](crate::Options) and [`Params`](crate::Params).
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub(crate) struct SettingsUniform = "Settings" {
        pub(crate) samples: u32,
        /// Number of maps.
        pub(crate) maps: u32,
        pub(crate) resolution: u32,
        pub(crate) seed: u32,
        pub(crate) jitter: f32,
        pub(crate) footprint: f32,
        pub(crate) range: f32,
        pub(crate) disc: f32,
        /// Vectors per hint.
        pub(crate) vectors: u32,
        pub(crate) bounce_samples: u32,
        /// 1 for the disc, 0 otherwise.
        pub(crate) sampling: u32,
        /// Words of the visibility test per hint; 0 without one.
        pub(crate) words: u32,
        /// 1 where pixels read as the paper prints it.
        pub(crate) as_printed: u32,
        /// 1 where `enclosure` is known.
        pub(crate) enclosed: u32,
        /// Nodes along each side of either level of a hint's window.
        pub(crate) side: u32,
        /// Samples in it; 0 where there are no windows.
        pub(crate) near: u32,
        /// Words of the stops per hint; 0 where nothing is tested.
        pub(crate) stop_words: u32,
        /// Samples of all lists.
        pub(crate) slots: u32,
        pub(crate) pad0: u32,
        pub(crate) pad1: u32,
        /// Albedo and depth behind each face; 0 and 1 where `enclosed` is 0.
        pub(crate) enclosure: [Vec4; 6],
    }
}

wgsl_struct! {
    /// Which of several maps, views or bounces a dispatch is for.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    pub(crate) struct Index = "Index" {
        pub(crate) value: u32,
    }
}
