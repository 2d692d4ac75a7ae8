use glam::Vec4;
use indirect_core::Image;
use photon_tracing::Photon;

use crate::layout::{Faces, StoredPhoton};

/// The technique.
#[derive(Debug, Clone, Copy)]
pub struct ShGridRaytracer;

/// The indirect light of a frame and everything that was computed on the way.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Output {
    /// All photons after their last flight.
    pub photons: Vec<Photon>,
    /// Those that were stored, reflection by reflection, each in the order of emission.
    pub stored: Vec<StoredPhoton>,
    /// The stored photons in the order of their cells.
    pub order: Vec<u32>,
    /// The R-grid, level by level.
    pub faces: Vec<Faces>,
    /// The active cells.
    #[cfg(feature = "cpu")]
    pub field: crate::cpu::Cells,
    /// Irradiance per pixel, W/m², and a number that differs where it comes from elsewhere.
    pub irradiance: Vec<Vec4>,
    /// Indirect radiance that leaves each pixel, W/(sr·m²).
    pub image: Image,
}
