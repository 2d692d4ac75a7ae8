//! `summary`: what all virtual lights have in common: the area that bounds them, and what stands for later bounces.

use glam::Vec3;
use indirect_core::math::luminance;
use rsm::Vpl;

use crate::layout::Summary;

/// Largest share of a bounce's flux that the bounce after it is taken to keep.
pub const MOST_KEPT: f32 = 0.95;

/// The sums over `vpls`, `per_bounce` of each bounce, bounce by bounce. `bound` is in units of the mean area; the tail stays 1 where
/// it is not asked for or there is a single bounce.
#[must_use]
pub fn summary(vpls: &[Vpl], per_bounce: u32, bound: f32, tail: bool) -> Summary {
    let (mut area, mut weight) = (0.0, 0.0);
    let mut flux = [Vec3::ZERO; 2];
    for bounce in vpls.chunks(per_bounce.max(1) as usize) {
        flux = [flux[1], Vec3::ZERO];
        for v in bounce {
            let lum = luminance(v.flux);
            area += v.area * lum;
            weight += lum;
            flux[1] += v.flux;
        }
    }
    let kept = |k: usize| if flux[0][k] > 0.0 { (flux[1][k] / flux[0][k]).min(MOST_KEPT) } else { 0.0 };
    let kept = if tail { Vec3::new(kept(0), kept(1), kept(2)) } else { Vec3::ZERO };
    let area = if weight > 0.0 { bound * area / weight } else { 0.0 };
    Summary { tail: Vec3::ONE / (Vec3::ONE - kept), area }
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    #[test]
    fn the_largest_share_is_that_of_the_shader() {
        use indirect_gpu::shaders::INSTANT_RADIOSITY_SUMMARY;
        testkit::layout::check_constant(&INSTANT_RADIOSITY_SUMMARY, "MOST_KEPT", super::MOST_KEPT).unwrap();
    }
}
