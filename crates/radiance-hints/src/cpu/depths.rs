//! Segments against depth images: where they cross a surface that a view sees.

use glam::{Vec2, Vec3};
use indirect_core::{GBuffer, View};
use rsm::Rsm;

/// Steps into which a segment is divided.
pub(crate) const STEPS: u32 = 16;
/// Bisections of the step in which a segment crossed a surface.
pub(crate) const REFINEMENTS: u32 = 5;

/// A depth image and the view that it belongs to.
pub(super) struct Depths<'a> {
    pub(super) view: &'a View,
    pub(super) surface: &'a GBuffer,
}

impl<'a> Depths<'a> {
    /// Those of all maps.
    pub(super) fn of_maps(rsm: &'a Rsm) -> Vec<Self> {
        rsm.maps.iter().map(|m| Self { view: &m.view, surface: &m.surface }).collect()
    }
}

/// How far `p` lies behind what the view sees there, metres; negative before it, `None` outside of the image.
pub(super) fn behind(depths: &Depths<'_>, p: Vec3) -> Option<f32> {
    let at = depths.view.image_point(p)?;
    let [width, height] = depths.surface.size;
    let texel = at * Vec2::new(width as f32, height as f32);
    if !(texel.x >= 0.0 && texel.y >= 0.0 && texel.x < width as f32 && texel.y < height as f32) {
        return None;
    }
    let i = texel.y as usize * width as usize + texel.x as usize;
    let depth = depths.view.forward.dot(p - depths.view.origin);
    Some(if depths.surface.is_surface(i) { depth - depths.surface.depth[i] } else { -depth })
}

/// The parameter, `[0, 1]`, at which the segment from `a` to `b` crosses a surface that the view sees, searched from the step
/// `first` on; `None` where it does not.
pub(super) fn crossing(depths: &Depths<'_>, a: Vec3, b: Vec3, first: u32) -> Option<f32> {
    let at = |t: f32| behind(depths, a + (b - a) * t);
    let length = (b - a).length();
    let step = 1.0 / STEPS as f32;
    let mut before = at(first as f32 * step);
    for i in first + 1..=STEPS {
        let t = i as f32 * step;
        let now = at(t);
        if let (Some(x), Some(y)) = (before, now)
            && (x < 0.0) != (y < 0.0)
        {
            // The segment changes sides here: bisect.
            let (mut lo, mut hi, mut x, mut y) = (t - step, t, x, y);
            for _ in 0..REFINEMENTS {
                let middle = 0.5 * (lo + hi);
                let Some(m) = at(middle) else { break };
                if (m < 0.0) == (x < 0.0) {
                    (lo, x) = (middle, m);
                } else {
                    (hi, y) = (middle, m);
                }
            }
            // On a surface the depth difference shrinks with the step; at a silhouette, where depth jumps, it does not.
            if (y - x).abs() < 4.0 * (hi - lo) * length {
                return Some(lo);
            }
        }
        before = now;
    }
    None
}
