//! Data shared by both backends, field by field as the WGSL of `shaders/wgsl/radiance_hints` declares it.

use bytemuck::{Pod, Zeroable};
use glam::{UVec3, Vec3};

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
    /// Fills the row.
    pub pad0: u32,
    /// Cells along each axis, each at least 1.
    pub resolution: UVec3,
    /// Fills the row.
    pub pad1: u32,
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
    /// Fills the row.
    pub pad0: f32,
    /// Incident flux that it stands for, W: `flux / incident` is the albedo.
    pub incident: Vec3,
    /// Fills the row.
    pub pad1: f32,
}

/// What a hint knows of the lit surfaces around it; kept only where there is more than one bounce. 20 bytes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Surroundings {
    /// Mean albedo, `[0, 1]`: reflected over incident flux, as the hint sees it.
    pub albedo: [f32; 3],
    /// Distance to the nearest sample, metres; 0 for a hint without samples.
    pub r_min: f32,
    /// Distance to the farthest sample, metres.
    pub r_max: f32,
}
