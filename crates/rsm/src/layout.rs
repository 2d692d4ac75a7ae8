//! Data shared by both backends, field by field as the WGSL of `shaders/wgsl/rsm` declares it.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

indirect_core::wgsl_struct! {
    /// A virtual point light: a small diffuse patch that radiates already reflected flux. 48 bytes; 1024 of them fill 48 KiB
    /// of the 64 KiB that every WebGPU device binds as a uniform buffer.
    ///
    /// Its intensity towards the unit direction `ω` is `flux/π · max(0, normal·ω)`, W/sr.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub struct Vpl = "Vpl" {
        /// World position, metres.
        pub position: Vec3,
        /// Area of the patch it stands for, m².
        pub area: f32,
        /// Unit normal of the side that radiates.
        pub normal: Vec3,
        /// Fills the row.
        pub pad0: f32,
        /// Reflected flux per channel, W.
        pub flux: Vec3,
        /// Fills the row.
        pub pad1: f32,
    }
}

impl Vpl {
    /// A VPL from its meaningful fields.
    #[must_use]
    pub const fn new(position: Vec3, normal: Vec3, flux: Vec3, area: f32) -> Self {
        Self { position, area, normal, pad0: 0.0, flux, pad1: 0.0 }
    }
}

indirect_core::wgsl_struct! {
    /// A node of a tree of lights as a traversal sees it: what is beneath it as one light, linked to its children and past them.
    /// 64 bytes, a cache line.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub struct Branch = "Branch" {
        /// Mean position, weighted by flux, metres.
        pub position: Vec3,
        /// Sum of the areas, m².
        pub area: f32,
        /// Mean normal, weighted by flux, made unit: the axis of a cone that contains all normals.
        pub normal: Vec3,
        /// Receivers nearer to `position` than this need the children, metres; 0 where there are none.
        pub reach: f32,
        /// Sum of the reflected flux, W.
        pub flux: Vec3,
        /// Index of the branch that follows when the children are skipped.
        pub next: u32,
        /// Index of the first child; meaningless where `reach` is 0.
        pub child: u32,
        /// Index of the virtual point light that stands for those beneath in a test of visibility; 0 where the tree has none.
        pub representative: u32,
        /// Radius of a sphere around `position` that contains what is beneath, metres; 0 of a texel.
        pub radius: f32,
        /// `1 − cos` of the cone's half angle, `[0, 2]`.
        pub versine: f32,
    }
}

impl Branch {
    /// Sum of the flux over the channels, W: positive where anything is reflected.
    #[must_use]
    pub fn weight(&self) -> f32 {
        self.flux.x + self.flux.y + self.flux.z
    }

    /// The branch as a virtual point light.
    #[must_use]
    pub const fn vpl(&self) -> Vpl {
        Vpl::new(self.position, self.normal, self.flux, self.area)
    }
}

indirect_core::wgsl_struct! {
    /// Light in one texel of a map. 32 bytes.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub struct Texel = "Texel" {
        /// Flux that the light sends through the texel onto the surface, W.
        pub incident: Vec3,
        /// Fills the row.
        pub pad0: f32,
        /// Flux that the surface reflects, albedo × incident, W.
        pub reflected: Vec3,
        /// Area of the surface that the texel covers, m².
        pub area: f32,
    }
}

indirect_core::wgsl_struct! {
    /// A node of a map's mip pyramid: bounds and sums over the lit texels beneath it. 48 bytes.
    ///
    /// A node without a lit texel is [`Node::EMPTY`].
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    pub struct Node = "Node" {
        /// Sum of the reflected flux, W.
        pub reflected: Vec3,
        /// Least view depth, metres.
        pub depth_min: f32,
        /// Sum of the incident flux, W.
        pub incident: Vec3,
        /// Greatest view depth, metres; below `depth_min` in an empty node.
        pub depth_max: f32,
        /// Unit axis of a cone that contains all normals.
        pub cone_axis: Vec3,
        /// `1 − cos` of the cone's half angle, `[0, 2]`. The versine keeps its digits for narrow cones, where a cosine near 1
        /// has none.
        pub cone_versine: f32,
    }
}

impl Node {
    /// A node without a lit texel.
    pub const EMPTY: Self = Self {
        reflected: Vec3::ZERO,
        depth_min: f32::MAX,
        incident: Vec3::ZERO,
        depth_max: 0.0,
        cone_axis: Vec3::ZERO,
        cone_versine: 0.0,
    };

    /// Whether no texel beneath is lit.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.depth_min > self.depth_max
    }
}

indirect_core::wgsl_struct! {
    /// One light seen through one view, as the `flux` pass needs it. 96 bytes.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    pub struct LightMap = "LightMap" {
        /// Unit vector to the right of the map.
        pub right: Vec3,
        /// Half the width of the image plane: its tangent (perspective) or metres (orthographic).
        pub half_width: f32,
        /// Unit vector to the top of the map.
        pub up: Vec3,
        /// Half the height of the image plane, likewise.
        pub half_height: f32,
        /// Unit view direction.
        pub forward: Vec3,
        /// 1 for an orthographic map, 0 for a perspective one.
        pub orthographic: u32,
        /// The light's power: W/sr (perspective) or W/m² (orthographic).
        pub power: Vec3,
        /// 1 over the light's range, 1/m; 0 without one.
        pub inverse_range: f32,
        /// Unit axis of a spot light.
        pub axis: Vec3,
        /// Cosine of a spot's outer angle; −2 for any other light.
        pub cos_outer: f32,
        /// `1 / max(0.001, cos inner − cos outer)` of a spot; 1 for any other light.
        pub spot_scale: f32,
        /// Texels along each side.
        pub resolution: u32,
        /// Fills the row.
        pub pad0: u32,
        /// Fills the row.
        pub pad1: u32,
    }
}
