//! `splat`: points of the scene drawn into the maps.
//!
//! A point at distance `d` that stands for the area `A` is drawn as a square of as many texels as it covers,
//!
//! ```text
//! Ω = A cosθ_p / (d² + A/π)                   solid angle of a disc, at most π
//! n = Ω (side/2)² / (1 + cosθ)²               the paraboloid's density, texels
//! ```
//!
//! at least one, with the depth that the point's plane has at the middle of each. Ritschel et al. 2008 give the whole splat the
//! point's depth: it then shades the surface that it lies on wherever that is seen at a slant.

use rayon::prelude::*;
use rsm::Vpl;

use super::atlas::Atlas;
use super::frame::Frame;
use crate::layout::{Ism, Point};
use crate::settings::Options;

/// Splats are at most this share of the side wide: what is nearer than that covers the map by its number.
const MAX_SHARE: f32 = 0.25;
/// Points less above a VPL's plane than this share of their radius belong to the VPL's own surface.
const LIFT: f32 = 1.0 / 64.0;
/// The plane of a point counts up to this many times its reciprocal depth.
const NEAREST: f32 = 2.0;

/// The maps of `vpls`: map `j` draws the points `j·points_per_map + k`, modulo their number.
#[must_use]
pub fn splat(vpls: &[Vpl], points: &[Point], options: &Options) -> Atlas {
    let ism = Ism::new(options, points.len() as u32, vpls.len() as u32);
    let mut atlas = Atlas::new(ism, vpls);
    if points.is_empty() {
        return atlas;
    }
    let frames = &atlas.frames;
    atlas.depths.par_chunks_mut(ism.texels()).zip(frames).enumerate().for_each(|(j, (map, frame))| {
        let n = points.len();
        // As the GPU's 32-bit product wraps, so does this one.
        let begin = ((j as u32).wrapping_mul(ism.points_per_map) % ism.points) as usize;
        let end = begin + ism.points_per_map as usize;
        for run in [&points[begin..end.min(n)], &points[..end.saturating_sub(n)]] {
            for block in run.chunks(LANES) {
                let splats = project(&ism, frame, block);
                for lane in 0..block.len() {
                    draw(&ism, &splats, lane, map);
                }
            }
        }
    });
    atlas
}

/// Points that are projected at once: plain loops over arrays, which the compiler makes vectors of.
const LANES: usize = 8;

/// One value per point.
type Lanes = [f32; LANES];

/// Where some points go in a map.
#[derive(Default)]
struct Splats {
    /// The first texel of each axis and the one behind the last; equal where nothing is drawn.
    x: [[u32; LANES]; 2],
    y: [[u32; LANES]; 2],
    /// The plane: half the normal along the axes of the frame, over `n·p`.
    n: [Lanes; 3],
    /// The greatest value that counts.
    nearest: Lanes,
}

#[inline]
fn project(ism: &Ism, frame: &Frame, block: &[Point]) -> Splats {
    let (mut p, mut m, mut areas) = ([Lanes::default(); 3], [Lanes::default(); 3], Lanes::default());
    for (i, point) in block.iter().enumerate() {
        for axis in 0..3 {
            p[axis][i] = point.position[axis];
            m[axis][i] = point.normal[axis];
        }
        areas[i] = point.area;
    }
    let Frame { position: o, tangent: t, bitangent: b, normal: n } = *frame;
    let (half, tile) = (0.5 * ism.tile as f32, ism.tile as f32);
    let most = if MAX_SHARE * tile > 1.0 { MAX_SHARE * tile } else { 1.0 };
    let mut s = Splats::default();
    for i in 0..LANES {
        let area = areas[i] * ism.area_scale;
        // The square of the radius.
        let r2 = area * core::f32::consts::FRAC_1_PI;
        let (vx, vy, vz) = (p[0][i] - o.x, p[1][i] - o.y, p[2][i] - o.z);
        let (mx, my, mz) = (m[0][i], m[1][i], m[2][i]);
        let z = n.x * vx + n.y * vy + n.z * vz;
        let facing = mx * vx + my * vy + mz * vz;
        let k = facing.abs();
        let d2 = vx * vx + vy * vy + vz * vz;
        let d = d2.sqrt();
        let c = 1.0 / (d + z);
        let x = (t.x * vx + t.y * vy + t.z * vz) * c * half + half;
        let y = (b.x * vx + b.y * vy + b.z * vz) * c * half + half;
        // Ω / (1 + cosθ)² = A k d c² / (d² + r²).
        let side = (area * k * d / (d2 + r2)).sqrt() * c * half;
        let side = if side > 1.0 { side } else { 1.0 };
        let side = if side < most { side } else { most };
        // Texels whose middles lie within [x − side/2, x + side/2). All false where a number is none.
        let drawn = (z > 0.0) & (z * z > LIFT * LIFT * r2) & (k > 0.0) & (area > 0.0);
        let reach = if drawn { 0.5 * side } else { 0.0 };
        let (x, y) = if drawn { (x, y) } else { (0.0, 0.0) };
        (s.x[0][i], s.x[1][i]) = (first(x - reach, tile), first(x + reach, tile));
        (s.y[0][i], s.y[1][i]) = (first(y - reach, tile), first(y + reach, tile));
        let over = 0.5 / facing;
        s.n[0][i] = (t.x * mx + t.y * my + t.z * mz) * over;
        s.n[1][i] = (b.x * mx + b.y * my + b.z * mz) * over;
        s.n[2][i] = (n.x * mx + n.y * my + n.z * mz) * over;
        s.nearest[i] = NEAREST * c;
    }
    s
}

#[inline]
fn draw(ism: &Ism, s: &Splats, i: usize, map: &mut [f32]) {
    let (nx, ny, nz, nearest) = (s.n[0][i], s.n[1][i], s.n[2][i], s.nearest[i]);
    let step = 2.0 / ism.tile as f32;
    for ty in s.y[0][i]..s.y[1][i] {
        let qy = (ty as f32 + 0.5) * step - 1.0;
        let row = &mut map[(ty * ism.tile) as usize..][s.x[0][i] as usize..s.x[1][i] as usize];
        for (tx, texel) in (s.x[0][i]..).zip(row) {
            let qx = (tx as f32 + 0.5) * step - 1.0;
            let u = 2.0 * (nx * qx + ny * qy) + nz * (1.0 - (qx * qx + qy * qy));
            let u = if u < nearest { u } else { nearest };
            *texel = if u > *texel { u } else { *texel };
        }
    }
}

/// The first texel whose middle is not below `x`, at most `tile`.
#[inline]
fn first(x: f32, tile: f32) -> u32 {
    let x = x + 0.5;
    let x = if x > 0.0 { x } else { 0.0 };
    // Cut off.
    (if x < tile { x } else { tile }) as i32 as u32
}
