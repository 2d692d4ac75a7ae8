//! Which source, and where on it.

use glam::{Vec2, Vec3};
use indirect_core::math::normalize_or;
use indirect_sampling::mapping::triangle_uniform;

use crate::layout::Emitter;

/// The largest f32 below 1.
pub(super) const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// The first of `count` things, at least one, whose share reaches `x` in `[0, 1)`, and where in its share that is, `[0, 1)`. `upto` are
/// the shares of all up to each and with it.
#[must_use]
pub fn pick(count: usize, upto: impl Fn(usize) -> f32, x: f32) -> (usize, f32) {
    let (mut low, mut high) = (0, count as u32);
    while low < high {
        let middle = (low + high) / 2;
        if upto(middle as usize) <= x {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    let i = (low as usize).min(count.saturating_sub(1));
    let before = if i == 0 { 0.0 } else { upto(i - 1) };
    (i, ((x - before) / (upto(i) - before).max(f32::MIN_POSITIVE)).clamp(0.0, BELOW_ONE))
}

/// A point of an emissive triangle, metres, and the normal of a side that emits there: evenly for `u` in `[0, 1)²`, of which the first
/// chooses the side, too.
#[must_use]
pub fn emitter_point(e: &Emitter, u: Vec2) -> (Vec3, Vec3) {
    let mut x = u.x;
    let mut turn = 1.0;
    if e.two_sided == 1 {
        x *= 2.0;
        if x >= 1.0 {
            x -= 1.0;
            turn = -1.0;
        }
    }
    let b = triangle_uniform(Vec2::new(x, u.y));
    let normal = normalize_or(e.edge_u.cross(e.edge_v), Vec3::ZERO) * turn;
    (e.corner + e.edge_u * b.x + e.edge_v * b.y, normal)
}
