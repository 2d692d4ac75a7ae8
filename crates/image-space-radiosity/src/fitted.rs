use std::sync::Arc;

#[cfg(feature = "cpu")]
use crate::settings::Options;

/// What a scene has that the technique needs: nothing without shadow maps.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Fitted {
    /// Points of the scene in their triangles.
    #[cfg(feature = "cpu")]
    pub places: Arc<Vec<imperfect_shadow_maps::ScenePoint>>,
    /// The same in the world: what shadow maps are drawn from.
    pub points: Arc<Vec<imperfect_shadow_maps::Point>>,
}

#[cfg(feature = "cpu")]
impl Fitted {
    /// Places the points.
    #[must_use]
    pub fn new(accel: &indirect_accel::Accel<'_>, options: &Options) -> Self {
        let mut fitted = Self::default();
        if options.has_shadows() {
            let maps = options.shadow_maps();
            // The same points for every seed: where the maps stand changes with it.
            let places = imperfect_shadow_maps::place(accel.scene(), maps.points, &[], maps.placement, 0);
            fitted.places = Arc::new(places);
            fitted.refit(accel);
        }
        fitted
    }

    /// Moves the points with a scene whose vertices may have moved.
    pub fn refit(&mut self, accel: &indirect_accel::Accel<'_>) {
        if !self.places.is_empty() {
            self.points = Arc::new(imperfect_shadow_maps::cpu::resolve(accel.scene(), &self.places));
        }
    }
}
