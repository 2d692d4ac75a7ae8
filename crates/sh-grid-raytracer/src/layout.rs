//! Data shared by both backends, field by field as the WGSL of `shaders/wgsl/sh_grid_raytracer` declares it.

use bytemuck::{Pod, Zeroable};
#[cfg(feature = "gpu")]
use glam::UVec3;
use glam::{Vec3, Vec4};

indirect_core::wgsl_struct! {
    /// A photon as the R-grid takes it. 32 bytes.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub struct StoredPhoton = "StoredPhoton" {
        /// Flux that a surface reflects, W.
        pub flux: Vec3,
        /// Place of its cell among the boundary cells.
        pub cell: u32,
        /// Unit vector that shares it out among the faces of its cell: the normal of the side that reflects it, or with
        /// [`Reconstruct::AsPrinted`](crate::Reconstruct::AsPrinted) the direction in which it leaves.
        pub axis: Vec3,
        /// Its number among those that were emitted.
        pub photon: u32,
    }
}

indirect_core::wgsl_struct! {
    /// A cell of the R-grid: for the faces −x, +x, −y, +y, −z, +z the flux that left through them, W, and the area that sent it, m². 96
    /// bytes.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub struct Faces = "Faces" {
        /// Flux and area of each.
        pub faces: [Vec4; 6],
    }
}

indirect_core::wgsl_struct! {
    /// Which fine cells of a boundary cell surfaces pass through. 16 bytes.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable)]
    pub struct Voxel = "Voxel" {
        /// A bit for each of its 4×4×4 fine cells, x fastest; the first 32.
        pub low: u32,
        /// The others.
        pub high: u32,
        /// Where the normals of the set ones begin, in the order of the bits.
        pub first_normal: u32,
        /// Fills the row.
        pub pad0: u32,
    }
}

impl Voxel {
    /// Whether surfaces pass through the fine cell of a bit.
    #[must_use]
    #[inline]
    pub const fn has(&self, bit: u32) -> bool {
        (if bit < 32 { self.low >> bit } else { self.high >> (bit - 32) }) & 1 != 0
    }

    /// Sets a bit.
    #[inline]
    pub const fn set(&mut self, bit: u32) {
        if bit < 32 {
            self.low |= 1 << bit;
        } else {
            self.high |= 1 << (bit - 32);
        }
    }

    /// How many set bits there are before a bit.
    #[must_use]
    #[inline]
    pub const fn rank(&self, bit: u32) -> u32 {
        if bit < 32 {
            (self.low & ((1 << bit) - 1)).count_ones()
        } else {
            self.low.count_ones() + (self.high & ((1 << (bit - 32)) - 1)).count_ones()
        }
    }
}

/// Levels of the R-grid at most: those of 128 cells.
#[cfg(feature = "gpu")]
pub(crate) const MOST_LEVELS: usize = 8;

#[cfg(feature = "gpu")]
indirect_core::wgsl_struct! {
    /// A level of the R-grid.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub(crate) struct GridLevel = "GridLevel" {
        pub(crate) size: UVec3,
        pub(crate) cube: u32,
        pub(crate) first: u32,
        pub(crate) count: u32,
        pub(crate) cell: f32,
        pub(crate) pad0: u32,
    }
}

#[cfg(feature = "gpu")]
indirect_core::wgsl_struct! {
    /// A frame and its settings.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    pub(crate) struct FrameSettings = "FrameSettings" {
        pub(crate) origin: Vec3,
        pub(crate) cell: f32,
        pub(crate) size: UVec3,
        pub(crate) boundary: u32,
        pub(crate) cells: u32,
        pub(crate) photons: u32,
        pub(crate) capacity: u32,
        pub(crate) levels: u32,
        pub(crate) store_reach: f32,
        pub(crate) unit: f32,
        pub(crate) least_area: f32,
        pub(crate) far: f32,
        pub(crate) directions: u32,
        pub(crate) coefficients: u32,
        pub(crate) seed: u32,
        pub(crate) printed: u32,
        pub(crate) turned: u32,
        pub(crate) footprint: u32,
        pub(crate) weights: u32,
        pub(crate) pixels: u32,
        pub(crate) samples: u32,
        pub(crate) reach: f32,
        pub(crate) obscurance_range: f32,
        pub(crate) pad0: u32,
        pub(crate) grid_levels: [GridLevel; MOST_LEVELS],
    }
}

#[cfg(feature = "gpu")]
indirect_core::wgsl_struct! {
    /// Directions and turns.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    pub(crate) struct DirectionSet = "DirectionSet" {
        pub(crate) turns: [Vec4; 3 * crate::directions::TURNS as usize],
        pub(crate) directions: [Vec4; crate::directions::MOST_DIRECTIONS as usize],
    }
}

#[cfg(feature = "gpu")]
indirect_core::wgsl_struct! {
    /// Directions, or rays, of a dispatch.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable)]
    pub(crate) struct DirectionRange = "DirectionRange" {
        pub(crate) first: u32,
        pub(crate) end: u32,
        pub(crate) pad0: u32,
        pub(crate) pad1: u32,
    }
}

#[cfg(feature = "gpu")]
indirect_core::wgsl_struct! {
    /// A level of the R-grid that is made.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable)]
    pub(crate) struct LevelRange = "LevelRange" {
        pub(crate) first: u32,
        pub(crate) count: u32,
        pub(crate) pad0: u32,
        pub(crate) pad1: u32,
    }
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::*;
    use crate::directions::TURNS;
    use crate::grid::{FINE, NONE};
    use crate::settings::Weights;
    use indirect_gpu::shaders::{
        SH_GRID_FIELD, SH_GRID_FIELD_VOXELS, SH_GRID_FINAL, SH_GRID_GATHER, SH_GRID_RADIANCE, SH_GRID_SORT,
        SH_GRID_STORE,
    };
    use testkit::layout::{check, check_constant};

    #[test]
    fn structs_and_constants_are_those_of_the_shaders() {
        for module in [&SH_GRID_STORE, &SH_GRID_SORT, &SH_GRID_RADIANCE] {
            check::<StoredPhoton>(module).unwrap();
        }
        for module in [&SH_GRID_RADIANCE, &SH_GRID_FIELD] {
            check::<Faces>(module).unwrap();
            check::<GridLevel>(module).unwrap();
            check::<FrameSettings>(module).unwrap();
        }
        check::<Voxel>(&SH_GRID_FIELD_VOXELS).unwrap();
        check::<LevelRange>(&SH_GRID_RADIANCE).unwrap();
        check::<DirectionSet>(&SH_GRID_FIELD).unwrap();
        for module in [&SH_GRID_FIELD, &SH_GRID_FINAL] {
            check::<DirectionRange>(module).unwrap();
        }
        check_constant(&SH_GRID_STORE, "NO_CELL", NONE).unwrap();
        check_constant(&SH_GRID_FIELD_VOXELS, "FINE", FINE).unwrap();
        check_constant(&SH_GRID_FIELD, "TURNS", TURNS).unwrap();
        check_constant(&SH_GRID_SORT, "RUN", crate::cpu::RUN).unwrap();
        check_constant(&SH_GRID_GATHER, "FULL_SIDE", crate::cpu::FULL_SIDE).unwrap();
        for (name, rule) in [
            ("RULE_VISIBLE", Weights::Visible),
            ("RULE_SIDE", Weights::Side),
            ("RULE_AS_PRINTED", Weights::AsPrinted),
        ] {
            check_constant(&SH_GRID_GATHER, name, rule as u32).unwrap();
        }
    }
}
