use std::sync::Arc;

use glam::Vec3;
use photon_tracing::Emitter;

use crate::layout::TriangleSurface;
use crate::settings::{Options, Params};

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
    /// Runs of `bounce`: from emitters, where there are any, and from each bounce to the next.
    pub(crate) fn runs(&self) -> u32 {
        u32::from(self.fitted.from_emitters > 0) + self.options.bounces - 1
    }

    /// Whether the movement of vertices is followed.
    pub(crate) fn follows_motion(&self) -> bool {
        self.options.motion.is_on() && self.options.has_history()
    }
}

/// What a scene has that the technique needs beside its lights.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Fitted {
    /// Emissive triangles; empty where nothing emits.
    pub emitters: Arc<Vec<Emitter>>,
    /// Luminance of the flux of all emissive triangles, W.
    pub emitted: f32,
    /// Virtual lights of each bounce that start at emissive triangles; the rest starts in the lights' maps. A multiple of interleave².
    pub from_emitters: u32,
    /// Every triangle as light leaves it. Its albedo is the mean over the triangle, so that virtual lights do not carry the noise of
    /// a texture (thesis §4.3).
    pub surfaces: Arc<Vec<TriangleSurface>>,
    /// Points of the scene in their triangles, where the options ask for them.
    #[cfg(feature = "cpu")]
    pub places: Arc<Vec<imperfect_shadow_maps::ScenePoint>>,
    /// The same in the world.
    pub points: Arc<Vec<imperfect_shadow_maps::Point>>,
    /// Area of all triangles, m².
    pub area: f32,
    /// Diagonal of the triangles' bounds, metres.
    pub unit: f32,
    /// Vertices of the triangles, where movement is followed.
    pub triangles: Arc<Vec<[u32; 3]>>,
    /// Positions of the vertices, metres.
    pub now: Arc<Vec<Vec3>>,
    /// The same in the frame before; empty where nothing moved or movement is not followed.
    pub before: Arc<Vec<Vec3>>,
    /// The scene for rays on the GPU.
    #[cfg(feature = "gpu")]
    pub tree: Arc<indirect_accel::FlatTree>,
}

impl Fitted {
    /// Whether vertices moved since the frame before.
    #[must_use]
    pub fn moved(&self) -> bool {
        !self.before.is_empty()
    }
}
