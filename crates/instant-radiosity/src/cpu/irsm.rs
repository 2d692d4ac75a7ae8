//! Imperfect reflective shadow maps (Ritschel et al. 2008): the baseline that `bounce` among points is compared with (thesis §3.6). On the
//! CPU alone.

use core::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};
use imperfect_shadow_maps::Point;
use imperfect_shadow_maps::cpu::Atlas;
use indirect_core::math::luminance;
use indirect_sampling::warp::{Empty, Pyramid};
use rayon::prelude::*;
use rsm::Vpl;

use super::bounce::footprint;
use crate::setup::Fitted;

/// No point is seen in a texel.
const NONE: u32 = u32::MAX;

/// The next bounce of `sources`, one for each of `draws` in `[0, 1)²`, drawn in proportion to the luminance that the texels of all maps
/// reflect, by hierarchical warping.
///
/// `atlas` holds the sources' shadow maps, into which `atlas.ism.points_per_map` points each were drawn. A texel is a patch of the point
/// that is nearest in it, of the solid angle of the texel: what lies between points is not seen, and reflects nothing.
#[must_use]
pub fn bounce_irsm(fitted: &Fitted, sources: &[Vpl], atlas: &Atlas, draws: &[Vec2]) -> Vec<Vpl> {
    let texels = atlas.ism.texels();
    let mut nearest = vec![NONE; sources.len() * texels];
    nearest.par_chunks_mut(texels).enumerate().for_each(|(j, map)| draw(fitted, &sources[j], atlas, j, map));
    let tile = atlas.ism.tile;
    // Reflected flux of every texel of every map.
    let reflected: Vec<Vec3> = nearest
        .par_iter()
        .enumerate()
        .map(|(i, point)| {
            let Some(point) = fitted.points.get(*point as usize) else { return Vec3::ZERO };
            let (cosine, solid_angle) = texel(tile, (i % texels) as u32);
            sources[i / texels].flux * point.albedo * (cosine * FRAC_1_PI * solid_angle)
        })
        .collect();
    let size = [tile, tile * sources.len() as u32];
    let importance: Vec<f32> = reflected.iter().map(|r| luminance(*r)).collect();
    let dark = || vec![Vpl::default(); draws.len()];
    let Ok(pyramid) = Pyramid::build(size, &importance) else { return dark() };
    let Ok(warp) = pyramid.warp(Empty::Error) else { return dark() };
    let at = |u: &Vec2| {
        let sample = warp.sample(*u);
        let i = (sample.texel[1] * tile + sample.texel[0]) as usize;
        let source = &sources[i / texels];
        let Some(point) = fitted.points.get(nearest[i] as usize) else { return Vpl::default() };
        let towards = source.position - point.position;
        let normal = if point.normal.dot(towards) < 0.0 { -point.normal } else { point.normal };
        let flux = reflected[i] * (1.0 / (sample.pdf * draws.len() as f32));
        Vpl::new(point.position, normal, flux, footprint(sources, point.position, normal, fitted.area))
    };
    draws.par_iter().map(at).collect()
}

/// The nearest point of each texel of the map of one light.
fn draw(fitted: &Fitted, source: &Vpl, atlas: &Atlas, j: usize, map: &mut [u32]) {
    let (ism, frame) = (&atlas.ism, &atlas.frames[j]);
    let depths = &atlas.depths[j * map.len()..][..map.len()];
    let half = 0.5 * ism.tile as f32;
    let mut best = vec![0.0_f32; map.len()];
    for k in 0..ism.points_per_map {
        let i = ((j as u32).wrapping_mul(ism.points_per_map) % ism.points + k) % ism.points;
        let point: &Point = &fitted.points[i as usize];
        let v = point.position - source.position;
        let local = frame.local(v);
        if local.z.is_nan() || local.z <= 0.0 {
            continue;
        }
        let depth = 1.0 / (v.length() + local.z);
        let [x, y] = [local.x, local.y].map(|q| ((q * depth * half + half) as u32).min(ism.tile - 1));
        let texel = (y * ism.tile + x) as usize;
        // Hidden behind another splat: a texel's depth is that of a splat's plane.
        if depth * ism.point_bias >= depths[texel] && depth > best[texel] {
            best[texel] = depth;
            map[texel] = i;
        }
    }
}

/// Cosine to the light's normal, and solid angle, sr, of the middle of a texel of the paraboloid map; 0 outside of the hemisphere.
fn texel(tile: u32, i: u32) -> (f32, f32) {
    let at = |k: u32| (k as f32 + 0.5) * 2.0 / tile as f32 - 1.0;
    let (x, y) = (at(i % tile), at(i / tile));
    let r2 = x * x + y * y;
    if r2 >= 1.0 {
        return (0.0, 0.0);
    }
    // The stereographic map of the hemisphere onto the unit disc: dω = 4/(1 + r²)² dx dy, cosθ = (1 − r²)/(1 + r²).
    let side = 2.0 / tile as f32;
    let scale = 2.0 / (1.0 + r2);
    ((1.0 - r2) / (1.0 + r2), scale * scale * side * side)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_make_up_the_hemisphere() {
        let sum = |of: fn((f32, f32)) -> f32| (0..64 * 64).map(|i| f64::from(of(texel(64, i)))).sum::<f64>();
        let (angle, flux) = (sum(|t| t.1), sum(|t| t.0 * t.1 * FRAC_1_PI));
        // Texels that the rim cuts count wholly or not at all: a few in a thousand of a rim that is a sixteenth of all.
        assert!((angle / core::f64::consts::TAU - 1.0).abs() < 5e-3, "{angle}");
        assert!((flux - 1.0).abs() < 2e-3, "{flux}");
    }
}
