//! What a technique's frames need of a scene: made once, followed where it moves.

use std::sync::Arc;

use glam::Vec3;
use indirect_accel::Accel;
use indirect_core::{Aabb, Mesh, octahedral};
use photon_tracing::Sources;

use crate::directions::{spiral, turns};
use crate::grid::Grid;
use crate::pyramid::Pyramid;
use crate::settings::Options;
use crate::setup::Fitted;
use crate::voxeliser::{Openness, Voxeliser};

impl Fitted {
    /// Looks at the scene once.
    #[must_use]
    pub fn new(accel: &Accel<'_>, options: &Options) -> Self {
        let scene = accel.scene();
        let grid = bounds(&scene.mesh).map_or_else(Grid::default, |b| Grid::around(&b, options.grid));
        let openness = Openness { points: options.open_points, reach: options.open_reach };
        let voxeliser = Voxeliser::new(accel, grid, openness);
        let mut fitted = Self {
            directions: Arc::new(spiral(options.directions)),
            pixel_directions: Arc::new(spiral(2 * options.samples)),
            turns: Arc::new(turns()),
            voxeliser: Some(Arc::new(voxeliser)),
            ..Self::default()
        };
        fitted.take(accel);
        #[cfg(feature = "gpu")]
        {
            fitted.tree = Arc::new(indirect_accel::FlatTree::of(accel));
        }
        fitted
    }

    /// What follows from the cells and the scene.
    fn take(&mut self, accel: &Accel<'_>) {
        let mesh = &accel.scene().mesh;
        let voxels = self.voxeliser.as_ref().map(|v| v.voxels()).unwrap_or_default();
        self.pyramid = Arc::new(Pyramid::over(&voxels));
        self.voxels = Arc::new(voxels);
        self.sources = Sources::new(accel.scene());
        self.lights = accel.scene().lights.len();
        let normal = |t| octahedral::pack(mesh.geometric_normal(t));
        self.normals = Arc::new((0..mesh.triangles.len() as u32).map(normal).collect());
        self.unit = accel.unit();
        self.positions = Arc::new(mesh.positions.clone());
    }

    /// Looks at a scene whose vertices may have moved: cells without a moved triangle in or beside them stay. The grid keeps its
    /// place: what leaves it is not modelled.
    pub fn refit(&mut self, accel: &Accel<'_>) {
        let mesh = &accel.scene().mesh;
        if *self.positions == mesh.positions {
            return;
        }
        let same = |&v: &u32| self.positions.get(v as usize) == mesh.positions.get(v as usize);
        let moved: Vec<u32> =
            (0..).zip(&mesh.triangles).filter(|(_, t)| !t.iter().all(same)).map(|(i, _)| i).collect();
        if let Some(voxeliser) = &mut self.voxeliser {
            Arc::make_mut(voxeliser).update(accel, &moved);
        }
        self.take(accel);
        #[cfg(feature = "gpu")]
        if Arc::make_mut(&mut self.tree).refit(accel.scene()).is_err() {
            self.tree = Arc::new(indirect_accel::FlatTree::of(accel));
        }
    }
}

/// Bounds of all triangles that have an area; vertices that none of them has do not count.
fn bounds(mesh: &Mesh) -> Option<Aabb> {
    let sound = |t: &u32| mesh.geometric_normal(*t) != Vec3::ZERO;
    Aabb::of((0..mesh.triangles.len() as u32).filter(sound).flat_map(|t| mesh.corners(t)))
}
