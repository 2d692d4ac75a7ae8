//! Data shared by both backends, field by field as the WGSL of `shaders/wgsl/ism` declares it.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::settings::Options;

/// What a texel holds in which nothing was drawn: nothing is in the way there. Maps hold `1 / (distance + height)`, 1/m, where
/// the height is that above the VPL's plane: 0 is infinitely far.
pub const EMPTY: f32 = 0.0;

/// A point of the scene's surface that moves with its triangle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ScenePoint {
    /// Index into [`Mesh::triangles`](indirect_core::Mesh::triangles).
    pub triangle: u32,
    /// Barycentric weight of the second vertex, `[0, 1]`.
    pub u: f32,
    /// Barycentric weight of the third vertex, `[0, 1]`; `u + v ≤ 1` up to rounding.
    pub v: f32,
    /// Surface that the point stands for, m².
    pub area: f32,
}

indirect_core::wgsl_struct! {
    /// A [`ScenePoint`] in the world. 48 bytes.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub struct Point = "IsmPoint" {
        /// World position, metres.
        pub position: Vec3,
        /// Surface that the point stands for, m²; 0 in a hole of an alpha mask or of a triangle without area.
        pub area: f32,
        /// Unit normal of the triangle's plane, on its front side.
        pub normal: Vec3,
        /// Fills the row.
        pub pad0: f32,
        /// Lambertian albedo, `[0, 1]`.
        pub albedo: Vec3,
        /// Fills the row.
        pub pad1: f32,
    }
}

indirect_core::wgsl_struct! {
    /// What all passes and queries read. 48 bytes.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub struct Ism = "Ism" {
        /// Texels along each side of a map, a power of two.
        pub tile: u32,
        /// Maps for which there is room.
        pub tiles: u32,
        /// Points of the scene.
        pub points: u32,
        /// Points that are drawn into each map, at most `points`.
        pub points_per_map: u32,
        /// Coarser levels from which holes are filled.
        pub levels: u32,
        /// Texels of the coarser levels of a map.
        pub coarse: u32,
        /// What the area of a point is multiplied by to be that of its splat: a map draws only a part of the points.
        pub area_scale: f32,
        /// Factor by which what a map holds must exceed what the receiver's plane would put there, to shade it.
        pub bias: f32,
        /// The same for a receiver of unknown slope.
        pub point_bias: f32,
        /// How far a receiver's plane may be from the receiver within a texel, as a factor of its depth.
        pub reach: f32,
        /// Fills the row.
        pub pad0: u32,
        /// Fills the row.
        pub pad1: u32,
    }
}

/// Texels of bias that a receiver of unknown slope needs besides: what a slope of 3 changes from the middle of a texel to its
/// border, times 2 for the point's own place in its texel.
const SLOPE: f32 = 3.0;
/// Texels by which the plane of a receiver may be nearer or farther than the receiver, within one texel.
const REACH: f32 = 4.0;

impl Ism {
    /// For `points` points and `tiles` maps, as many as there are VPLs. A side that is no power of two is rounded down to one,
    /// within `1..=256`.
    #[must_use]
    pub fn new(options: &Options, points: u32, tiles: u32) -> Self {
        let points_per_map = options.points_per_map.min(points);
        let tile: u32 = 1 << options.tile.max(1).ilog2().min(8);
        let levels = options.pull_push.min(tile.ilog2());
        // What a texel spans across the line of sight, over the distance plus the height above the VPL's plane.
        let texel = 2.0 / tile as f32;
        Self {
            tile,
            tiles,
            points,
            points_per_map,
            levels,
            coarse: (1..=levels).map(|l| (tile >> l) * (tile >> l)).sum(),
            area_scale: options.overlap * points as f32 / points_per_map.max(1) as f32,
            bias: 1.0 + options.bias * texel,
            point_bias: 1.0 + (options.bias + SLOPE) * texel,
            reach: 1.0 + REACH * texel,
            pad0: 0,
            pad1: 0,
        }
    }

    /// Texels of a map.
    #[must_use]
    pub const fn texels(&self) -> usize {
        self.tile as usize * self.tile as usize
    }
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::*;
    use indirect_gpu::shaders::{ISM_PULL, ISM_PUSH, ISM_SPLAT, ISM_VISIBLE};
    use testkit::layout::check;

    #[test]
    fn structs_are_those_of_the_shaders() {
        check::<Point>(&ISM_SPLAT).unwrap();
        check::<rsm::Vpl>(&ISM_SPLAT).unwrap();
        for module in [&ISM_SPLAT, &ISM_PULL, &ISM_PUSH, &ISM_VISIBLE] {
            check::<Ism>(module).unwrap();
        }
    }
}
