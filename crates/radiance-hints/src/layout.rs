//! Data shared by both backends, field by field as the WGSL of `shaders/wgsl/radiance_hints` declares it.

use bytemuck::{Pod, Zeroable};
use glam::{UVec3, Vec3};
use indirect_core::Aabb;

/// A box of the scene, divided into cells with a hint at the centre of each. 48 bytes.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Volume {
    /// Smallest corner, metres.
    pub origin: Vec3,
    /// Number of its first hint among those of all volumes.
    pub first: u32,
    /// Edges of a cell, metres, each `> 0`.
    pub cell: Vec3,
    /// Number of the box at whose border later bounces of its hints begin: the last that contains this one.
    pub room: u32,
    /// Cells along each axis, each at least 1.
    pub resolution: UVec3,
    /// Fills the row.
    pub pad1: u32,
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

/// A small lit patch, drawn from the reflective shadow maps. 64 bytes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Sample {
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

/// The part of a map that a hint looks at closely: texels around its own projection, in nodes of the map's pyramid. 32 bytes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Window {
    /// Its first texel along both axes.
    pub first: [u32; 2],
    /// Past its last texel; the same as `first` for a hint that looks at nothing closely.
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

/// What a hint knows of the lit surfaces around it; kept only where there is more than one bounce. 20 bytes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Surroundings {
    /// Mean albedo, `[0, 1]`: reflected over incident flux, as the hint sees it.
    pub albedo: [f32; 3],
    /// Distance to the nearest sample whose lit side it sees, metres; 0 for a hint that sees none.
    pub r_min: f32,
    /// Distance to the farthest of them, metres; 0 for a hint that sees none, which is inside of something or outside of
    /// everything and has no say in later bounces.
    pub r_max: f32,
}

/// Most volumes of a lattice: they share one uniform buffer.
pub(crate) const VOLUMES: usize = 16;

/// All volumes.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LatticeUniform {
    /// How many of them count.
    pub volumes: u32,
    /// Hints of all of them.
    pub hints: u32,
    /// Fills the row.
    pub pad0: u32,
    /// Fills the row.
    pub pad1: u32,
    /// Those with precedence first.
    pub volume: [Volume; VOLUMES],
}

/// Options and parameters as shaders see them; see [`Options`](crate::Options) and [`Params`](crate::Params).
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Settings {
    /// Samples per list.
    pub samples: u32,
    /// Number of maps.
    pub maps: u32,
    /// Texels along each side of each.
    pub resolution: u32,
    /// The seed, for a bounce that of the bounce.
    pub seed: u32,
    /// Share of the cell.
    pub jitter: f32,
    /// Share of the sample's area.
    pub footprint: f32,
    /// Share of the volume's diagonal.
    pub range: f32,
    /// Share of the map that the disc takes.
    pub fraction: f32,
    /// Vectors per hint.
    pub vectors: u32,
    /// Samples per hint and bounce.
    pub bounce_samples: u32,
    /// 0 importance, 1 disc.
    pub sampling: u32,
    /// Words of the visibility test per hint; 0 without one.
    pub words: u32,
    /// 1 where pixels read as the paper prints it.
    pub as_printed: u32,
    /// 1 where `enclosure` is known.
    pub enclosed: u32,
    /// Nodes along each side of either level of a hint's window.
    pub side: u32,
    /// Samples in it; 0 where there are no windows.
    pub near: u32,
    /// Words of what ends the directions of later bounces, per hint; 0 where nothing is tested.
    pub stop_words: u32,
    /// Of those directions.
    pub direction_seed: u32,
    /// Fills the row.
    pub pad0: u32,
    /// Fills the row.
    pub pad1: u32,
    /// Albedo and depth behind each face; 0 and 1 where `enclosed` is 0.
    pub enclosure: [[f32; 4]; 6],
}
