//! `gather`: irradiance of the pixels (§4.2, §4.4).

use core::f32::consts::PI;

use glam::{Mat3, Vec2, Vec3, Vec4};
use indirect_core::{GBuffer, math};
use indirect_sampling::mapping::hemisphere_cosine;
use indirect_sampling::rng::hash_combine;
use indirect_sampling::sobol;
use rayon::prelude::*;

use crate::cpu::field::Sight;
use crate::cpu::interpolate::{Field, Local};
use crate::directions::turn_of;

/// Directions in which pixels look.
#[derive(Debug, Clone, Copy)]
pub struct Looks<'a> {
    /// Unit vectors, evenly spread over the sphere: of each pixel those count that point away from its surface.
    pub directions: &'a [Vec3],
    /// Turns of them; pixels take different ones.
    pub turns: &'a [Mat3],
    /// Chooses the turns.
    pub seed: u32,
}

impl Looks<'_> {
    /// `4π/N Σ value(ω) cosθ` over the hemisphere around `n`.
    fn integral(&self, pixel: u32, n: Vec3, value: impl Fn(Vec3) -> Vec3) -> Vec3 {
        let turn = self.turns[turn_of(pixel, self.seed) as usize];
        let mut sum = Vec3::ZERO;
        for &d in self.directions {
            let d = turn * d;
            let cosine = n.dot(d);
            if cosine > 0.0 {
                sum += value(d) * cosine;
            }
        }
        sum * (4.0 * PI / self.directions.len() as f32)
    }
}

/// Of every pixel irradiance, W/m², from the field in closed form, and a number that differs where other cells count.
#[must_use]
pub fn gather(field: &Field<'_>, camera: &GBuffer) -> Vec<Vec4> {
    each_pixel(camera, |_, p, n| {
        let local = field.at(p, n);
        chosen(local.irradiance(n), local.choices)
    })
}

/// The same from directions over the hemisphere.
#[must_use]
pub fn gather_samples(field: &Field<'_>, looks: &Looks<'_>, camera: &GBuffer) -> Vec<Vec4> {
    each_pixel(camera, |pixel, p, n| {
        let local = field.at(p, n);
        let e = looks.integral(pixel, n, |d| local.evaluate(d).truncate());
        chosen(e.max(Vec3::ZERO), local.choices)
    })
}

/// A vector with a number below 2²⁴, which a float holds.
fn chosen(e: Vec3, choices: u32) -> Vec4 {
    e.extend((choices & 0x00ff_ffff) as f32)
}

/// Multiplies the irradiance of every pixel by its obscurance: the cosine-weighted mean of `min(distance/range, 1)` (§4.4, with the
/// minimum of `docs/errata.md`). `range` in metres.
pub fn obscure(irradiance: &mut [Vec4], field: &Field<'_>, looks: &Looks<'_>, range: f32, camera: &GBuffer) {
    let factors = each_pixel(camera, |pixel, p, n| {
        let local = field.at(p, n);
        Vec3::splat(obscurance(&local, looks, pixel, n, range)).extend(1.0)
    });
    irradiance.iter_mut().zip(factors).for_each(|(e, f)| *e *= f);
}

fn obscurance(local: &Local, looks: &Looks<'_>, pixel: u32, n: Vec3, range: f32) -> f32 {
    let near = |d: Vec3| {
        let distance = local.evaluate(d).w;
        Vec3::new((distance / range).clamp(0.0, 1.0), 1.0, 0.0)
    };
    // Over the cosines' own sum: without anything near, every set of directions gives 1.
    let sums = looks.integral(pixel, n, near);
    if sums.y > 0.0 { sums.x / sums.y } else { 1.0 }
}

/// Of every pixel irradiance, W/m², and a number that differs where something else is seen: by `rays` rays with the density of the
/// cosine, each with one look at the R-grid where it ends.
#[must_use]
pub fn gather_final(sight: &Sight<'_>, rays: u32, seed: u32, camera: &GBuffer) -> Vec<Vec4> {
    each_pixel(camera, |pixel, p, n| {
        let origin = math::offset_ray_origin_scaled(p, n, sight.accel.unit());
        let (t, b) = math::orthonormal_basis(n);
        let seed = hash_combine(seed, pixel);
        let (mut sum, mut choices) = (Vec3::ZERO, 0_u32);
        for k in 0..rays {
            let u: Vec2 = sobol::sample_2d(k, seed);
            let w = hemisphere_cosine(u);
            let d = t * w.x + b * w.y + n * w.z;
            if let Some((look, _)) = sight.look(origin, d, 0.0) {
                sum += sight.lookup.radiance(&look);
                choices = choices.wrapping_add(look.mark);
            }
        }
        chosen(sum * (PI / rays as f32), choices)
    })
}

fn each_pixel(camera: &GBuffer, value: impl Fn(u32, Vec3, Vec3) -> Vec4 + Sync) -> Vec<Vec4> {
    let one = |i: u32| {
        let i = i as usize;
        if camera.is_surface(i) { value(i as u32, camera.position[i], camera.normal[i]) } else { Vec4::ZERO }
    };
    (0..camera.len() as u32).into_par_iter().with_min_len(64).map(one).collect()
}
