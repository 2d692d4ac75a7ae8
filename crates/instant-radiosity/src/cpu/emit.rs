//! `emit`: virtual lights on emissive triangles, where the light of emitters starts (Keller 1997, "Instant Radiosity").

use core::f32::consts::PI;

use glam::Vec2;
use indirect_core::math::{luminance, normalize_or};
use indirect_sampling::mapping::triangle_uniform;
use rsm::Vpl;

use crate::layout::Emitter;

/// One virtual light for each of `points` in `[0, 1)²`: a triangle in proportion to the luminance of its flux, a point on it evenly.
/// `emitted` is the luminance of the flux of all, W. All carry the same luminance, and together the emitters' flux.
#[must_use]
pub fn emit(emitters: &[Emitter], emitted: f32, points: &[Vec2]) -> Vec<Vpl> {
    points.iter().map(|&u| emit_at(emitters, emitted, u, points.len())).collect()
}

fn emit_at(emitters: &[Emitter], emitted: f32, u: Vec2, count: usize) -> Vpl {
    // The first whose share reaches u.x.
    let (mut low, mut high) = (0, emitters.len() as u32);
    while low < high {
        let middle = (low + high) / 2;
        if emitters[middle as usize].upto <= u.x {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    let Some(last) = emitters.len().checked_sub(1) else { return Vpl::default() };
    let i = (low as usize).min(last);
    let e = &emitters[i];
    let before = if i == 0 { 0.0 } else { emitters[i - 1].upto };
    // What is left of u.x within the triangle's share chooses the side, then the point.
    let mut x = ((u.x - before) / (e.upto - before).max(f32::MIN_POSITIVE)).clamp(0.0, 0.999_999_94);
    let mut turn = 1.0;
    if e.two_sided == 1 {
        x *= 2.0;
        if x >= 1.0 {
            x -= 1.0;
            turn = -1.0;
        }
    }
    let b = triangle_uniform(Vec2::new(x, u.y));
    let normal = normalize_or(e.edge_u.cross(e.edge_v), glam::Vec3::ZERO) * turn;
    let share = emitted / count as f32;
    let flux = e.radiance * (share / luminance(e.radiance));
    // A point of the triangle stands for the area whose flux is the light's.
    let area = share / (PI * luminance(e.radiance));
    Vpl::new(e.corner + e.edge_u * b.x + e.edge_v * b.y, normal, flux, area)
}
