use std::sync::Arc;

use glam::{Mat3, Vec3};
use photon_tracing::Sources;

use crate::pyramid::Pyramid;
use crate::settings::{Options, Params};
use crate::voxels::Voxels;

/// All settings, and what was fitted to the scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Setup {
    /// Fixed.
    pub options: Options,
    /// Per frame.
    pub params: Params,
    /// What the scene has.
    pub fitted: Fitted,
}

impl Setup {
    /// How photons are drawn.
    #[must_use]
    pub const fn photon_params(&self) -> photon_tracing::Params {
        photon_tracing::Params { photons: self.options.photons, seed: self.params.seed }
    }

    /// How far a photon must get to be stored, metres.
    #[must_use]
    pub fn store_reach(&self) -> f32 {
        if self.options.open_points == 0 {
            0.0
        } else {
            self.options.open_reach * self.fitted.voxels.grid.cell
        }
    }

    /// Distance from which on nothing darkens, metres.
    #[must_use]
    pub const fn obscurance_range(&self) -> f32 {
        self.params.obscurance_distance * self.fitted.unit
    }
}

/// What a scene has that the technique needs beside its lights.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Fitted {
    /// What makes the cells anew where something moves.
    #[cfg(feature = "cpu")]
    pub(crate) voxeliser: Option<Arc<crate::voxeliser::Voxeliser>>,
    /// The V-grid and the SH-grid.
    pub voxels: Arc<Voxels>,
    /// The levels of the R-grid.
    pub pyramid: Arc<Pyramid>,
    /// Where light starts; punctual lights are those of the frame.
    pub sources: Sources,
    /// Punctual lights of the scene, black ones included.
    pub lights: usize,
    /// Normals of all triangles, octahedral.
    pub normals: Arc<Vec<u32>>,
    /// Directions in which the cells of the field look.
    pub directions: Arc<Vec<Vec3>>,
    /// Directions in which pixels look.
    pub pixel_directions: Arc<Vec<Vec3>>,
    /// Turns of both.
    pub turns: Arc<Vec<Mat3>>,
    /// Diagonal of the triangles' bounds, metres.
    pub unit: f32,
    /// Positions of the vertices that all this was made for, metres.
    pub positions: Arc<Vec<Vec3>>,
    /// The scene for rays on the GPU.
    #[cfg(feature = "gpu")]
    pub tree: Arc<indirect_accel::FlatTree>,
}
