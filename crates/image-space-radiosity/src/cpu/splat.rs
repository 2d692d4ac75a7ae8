//! `splat`: the baselines that add one light after the other, instead of summing all lights at one fragment.

use core::f32::consts::PI;

use glam::{Vec2, Vec3};
use indirect_core::{GBuffer, Projection, View};
use rayon::prelude::*;
use rsm::{Form, Vpl};

/// Multiresolution splatting (Nichols & Wyman 2009): every light adds itself to every fragment, one light after the other.
/// Irradiance per fragment, W/m².
#[must_use]
pub fn splat(vpls: &[Vpl], positions: &[Vec3], normals: &[Vec3], form: Form) -> Vec<Vec3> {
    let mut irradiance = vec![Vec3::ZERO; positions.len()];
    for vpl in vpls {
        let fragments = irradiance.par_iter_mut().with_min_len(4096).zip(positions).zip(normals);
        fragments.for_each(|((e, p), n)| {
            *e += vpl.flux * form_factor_per_area(vpl, *p, *n, form.area_scale());
        });
    }
    irradiance
}

/// Splatting with bounded footprints (Dachsbacher & Stamminger 2006): every light adds itself to the pixels within the
/// distance at which it falls below `cutoff`, W/m². Irradiance per pixel of `surface`, W/m².
#[must_use]
pub fn splat_bounded(vpls: &[Vpl], surface: &GBuffer, view: &View, cutoff: f32, form: Form) -> Vec<Vec3> {
    let [width, height] = surface.size;
    let footprints: Vec<_> = vpls
        .iter()
        .map(|vpl| {
            let reach2 = reach2(vpl, cutoff);
            (vpl, reach2, rectangle(vpl.position, reach2.sqrt(), view, surface.size))
        })
        .collect();
    let mut irradiance = vec![Vec3::ZERO; surface.len()];
    irradiance.par_chunks_mut(width.max(1) as usize).zip(0..height).for_each(|(row, y)| {
        for (vpl, reach2, [min, max]) in &footprints {
            if (min[1]..max[1]).contains(&y) {
                for x in min[0]..max[0] {
                    let i = (y * width + x) as usize;
                    let (p, n) = (surface.position[i], surface.normal[i]);
                    let v = vpl.position - p;
                    if v.dot(v) < *reach2 {
                        row[x as usize] += vpl.flux * form_factor_per_area(vpl, p, n, form.area_scale());
                    }
                }
            }
        }
    });
    irradiance
}

/// Squared distance at which a light falls below `cutoff`: `Φ/(πd² + A)` of its mean channel, m².
fn reach2(vpl: &Vpl, cutoff: f32) -> f32 {
    let flux = (vpl.flux.x + vpl.flux.y + vpl.flux.z) / 3.0;
    ((flux / cutoff - vpl.area) / PI).max(0.0)
}

/// First and one past the last pixel of a rectangle that contains the image of a sphere.
fn rectangle(centre: Vec3, radius: f32, view: &View, size: [u32; 2]) -> [[u32; 2]; 2] {
    let v = centre - view.origin;
    let local = Vec3::new(v.dot(view.right), v.dot(view.up), v.dot(view.forward));
    let (lo, hi) = match view.projection {
        Projection::Orthographic { half_size } => {
            ((local.truncate() - radius) / half_size, (local.truncate() + radius) / half_size)
        }
        Projection::Perspective { tan_half } => {
            let nearest = local.z - radius;
            if local.z + radius <= 0.0 {
                return [[0, 0]; 2];
            }
            if nearest <= 0.0 {
                return [[0, 0], size];
            }
            // The box around the sphere, seen at its nearest or farthest depth, whichever is further out.
            let farthest = local.z + radius;
            let out = |a: f32, away: f32| a / if (a > 0.0) == (away > 0.0) { nearest } else { farthest };
            let lo = local.truncate() - radius;
            let hi = local.truncate() + radius;
            (
                Vec2::new(out(lo.x, -1.0), out(lo.y, -1.0)) / tan_half,
                Vec2::new(out(hi.x, 1.0), out(hi.y, 1.0)) / tan_half,
            )
        }
    };
    let pixel = |ndc: f32, size: u32| ((ndc + 1.0) * 0.5 * size as f32).clamp(0.0, size as f32);
    [
        [pixel(lo.x, size[0]).floor() as u32, pixel(-hi.y, size[1]).floor() as u32],
        [pixel(hi.x, size[0]).ceil() as u32, pixel(-lo.y, size[1]).ceil() as u32],
    ]
}

/// `cosθ_i cosθ_j/(πd² + A)`, as the gather has it.
fn form_factor_per_area(vpl: &Vpl, position: Vec3, normal: Vec3, area_scale: f32) -> f32 {
    let v = vpl.position - position;
    let d2 = v.dot(v);
    let ci = normal.dot(v);
    let cj = -vpl.normal.dot(v);
    let denominator = d2 * (PI * d2 + vpl.area * area_scale);
    ci.max(0.0) * cj.max(0.0) / denominator.max(1e-37)
}
