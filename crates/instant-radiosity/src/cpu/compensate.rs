//! `compensate`: what bounding virtual lights removes, carried by one path per pixel (Kollig & Keller 2004, "Illumination in the Presence of
//! Weak Singularities").
//!
//! A ray leaves the pixel with the density `cosθ/π`. What it meets at the distance `d` sends it the share `A k/(1 + A k)` of its light that
//! virtual lights do not carry, `k = cosθ_i cosθ_j/(π d²)`. With one path it would go on with this probability and take all; it goes on
//! `paths` times as often, where that is no more than always, and takes as much less. Far surfaces end it.

use core::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3, Vec4};
use indirect_accel::Accel;
use indirect_core::{GBuffer, Ray, form_factor::unbounded_share, math, math::luminance};
use indirect_sampling::mapping::hemisphere_cosine;
use rayon::prelude::*;
use rsm::Vpl;

use super::gather::{Choices, Lights, pixel_number, unshadowed_factor};
use super::shadow::{Rays, Shadow};
use crate::setup::Fitted;

/// Keeps the reach of a path finite where its number is 0: the next number is 2⁻²⁴.
const LEAST_NUMBER: f32 = 1.0 / (1 << 26) as f32;

/// Where a path may end, and what it meets there.
#[derive(Debug, Clone, Copy)]
pub struct Paths<'a> {
    /// The scene.
    pub accel: &'a Accel<'a>,
    /// Its triangles as light leaves them.
    pub fitted: &'a Fitted,
    /// Bounces whose lights the end of a path is lit by: one fewer than pixels are, as the path itself is one; all where the last stands for
    /// those that follow.
    pub bounces: u32,
    /// Parts of the lights that the end of a path is lit by, `1..=interleave²`.
    pub parts: u32,
    /// Shadow tests where a path ends, for each of these; 0: all.
    pub tests: u32,
    /// How often a path goes on, in units of the share that it carries, `≥ 1`.
    pub paths: f32,
    /// What the pixels' random numbers begin with.
    pub seed: u32,
}

/// Adds to `gathered`, irradiance per pixel, W/m², what the bound of `lights` removes. Behind the lights of all bounces, theirs holds
/// those on emissive triangles.
pub fn compensate<S: Shadow>(
    gathered: &mut [Vec4],
    paths: &Paths<'_>,
    lights: &Lights<'_, S>,
    camera: &GBuffer,
) {
    let pixels = gathered.par_iter_mut().enumerate().with_min_len(256).filter(|(i, _)| camera.is_surface(*i));
    pixels.for_each(|(i, e)| {
        let part = lights.parts.of_pixel(i as u32, camera.size[0]);
        let mut choices = Choices::of(e.w);
        let more =
            paths.residual((i as u32, part), (camera.position[i], camera.normal[i]), lights, &mut choices);
        *e = (e.truncate() + more).extend(choices.number());
    });
}

impl Paths<'_> {
    fn residual<S: Shadow>(
        &self,
        (i, part): (u32, u32),
        (p, n): (Vec3, Vec3),
        lights: &Lights<'_, S>,
        choices: &mut Choices,
    ) -> Vec3 {
        let number = |salt| pixel_number(i, self.seed, salt);
        let unit = self.accel.unit();
        let (t, b) = math::orthonormal_basis(n);
        let w = hemisphere_cosine(Vec2::new(number(0x101), number(0x102)));
        let direction = t * w.x + b * w.y + n * w.z;
        let origin = math::offset_ray_origin_scaled(p, n, unit);
        // Beyond this even surfaces that face each other end the path.
        let u = number(0x103);
        let area = lights.summary.area;
        let t_max = (area * FRAC_1_PI * (self.paths - u) / u.max(LEAST_NUMBER)).sqrt();
        let ray = Ray { origin, direction, t_max };
        let Some(hit) = self.accel.closest_hit(&ray) else { return Vec3::ZERO };
        let Some(surface) = self.fitted.surfaces.get(hit.triangle as usize) else { return Vec3::ZERO };
        let normal = surface.facing(direction);
        let kernel = w.z * -normal.dot(direction) * FRAC_1_PI / (hit.t * hit.t);
        let share = unbounded_share(kernel, area);
        let probability = (self.paths * share).min(1.0);
        if u >= probability {
            return Vec3::ZERO;
        }
        choices.note(hit.triangle);
        let q = origin + direction * hit.t;
        let range = 0..lights.parts.run() * self.bounces;
        // Few pixels come here: they can afford more than their own part, of which one light may stand for all of many.
        let (parts, some) = (lights.parts.interleave * lights.parts.interleave, self.parts);
        let mut light = Vec3::ZERO;
        for k in 0..some {
            let part = (part + k * parts / some) % parts;
            light += self.emitted(part, (q, normal), lights, number(0x204 + k), choices);
            light += lights.at(part, range.clone(), (q, normal), (self.tests, number(0x104 + k)), choices);
        }
        let light = light / some as f32 + self.punctual(q, normal, choices);
        surface.albedo * light * (share / probability)
    }

    /// Irradiance of the punctual lights, W/m².
    fn punctual(&self, q: Vec3, normal: Vec3, choices: &mut Choices) -> Vec3 {
        let origin = math::offset_ray_origin_scaled(q, normal, self.accel.unit());
        let mut sum = Vec3::ZERO;
        for l in &self.accel.scene().lights {
            let s = l.sample(q);
            let cosine = normal.dot(s.direction);
            if cosine > 0.0 && s.irradiance.max_element() > 0.0 && s.irradiance.is_finite() {
                let blocked = self.accel.any_hit(&Ray { origin, direction: s.direction, t_max: s.distance });
                choices.note(blocked.into());
                if !blocked {
                    sum += s.irradiance * cosine;
                }
            }
        }
        sum
    }

    /// Irradiance of a part of the virtual lights on emissive triangles, W/m², one of which is asked: `u` in `[0, 1)` draws it in
    /// proportion to what it would give.
    fn emitted<S: Shadow>(
        &self,
        part: u32,
        (q, normal): (Vec3, Vec3),
        lights: &Lights<'_, S>,
        u: f32,
        choices: &mut Choices,
    ) -> Vec3 {
        let parts = lights.parts.interleave * lights.parts.interleave;
        let run = (self.fitted.from_emitters / parts) as usize;
        let first = (lights.parts.per_bounce * lights.parts.bounces) as usize + part as usize * run;
        let given = |vpl: &Vpl| vpl.flux * unshadowed_factor(vpl, vpl.area, q, normal);
        let mut total = 0.0;
        for vpl in &lights.vpls[first..first + run] {
            total += luminance(given(vpl));
        }
        let mut running = 0.0;
        for (k, vpl) in lights.vpls[first..first + run].iter().enumerate() {
            let e = given(vpl);
            let weight = luminance(e);
            running += weight;
            if running > u * total {
                let visible = Rays(self.accel).visible(0, vpl, q, normal);
                choices.note(2 * k as u32 + u32::from(visible));
                return if visible { e * (total / weight * parts as f32) } else { Vec3::ZERO };
            }
        }
        Vec3::ZERO
    }
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    #[test]
    fn the_least_number_is_that_of_the_shader() {
        use indirect_gpu::shaders::INSTANT_RADIOSITY_COMPENSATE;
        testkit::layout::check_constant(&INSTANT_RADIOSITY_COMPENSATE, "LEAST_NUMBER", super::LEAST_NUMBER)
            .unwrap();
    }
}
