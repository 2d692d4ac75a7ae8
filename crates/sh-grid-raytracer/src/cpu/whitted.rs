//! A Whitted ray tracer whose diffuse surfaces are lit by the field (§4): mirrors, glass and shadows by recursion, glossy surfaces by
//! the field against a lobe. What a material does not have costs nothing.

use core::f32::consts::{FRAC_1_PI, PI};

use glam::{Vec2, Vec3};
use indirect_accel::Accel;
use indirect_core::{Image, Ray, Scene, Surface, View, math};
use indirect_sampling::rng::hash_combine;
use indirect_sampling::sobol;
use photon_tracing::cpu::{emitter_point, pick};
use photon_tracing::{Emitter, Sources};
use rayon::prelude::*;
use sh_math::Zonal;

use crate::cpu::field::MOST_COEFFICIENTS;
use crate::cpu::interpolate::{Field, Local};

/// Roughness up to which a metal is a mirror.
pub const MIRROR: f32 = 0.1;

/// A shadow ray towards a light ends this share of the way before it, so that a light that sits on a surface is not shadowed by it.
const SHADOW_END: f32 = 1.0 - 1.0 / 65536.0;

/// A ray tracer and what it traces.
#[derive(Debug, Clone, Copy)]
pub struct Whitted<'a> {
    /// The scene.
    pub accel: &'a Accel<'a>,
    /// Its indirect light.
    pub field: Field<'a>,
    /// Emissive triangles, for direct light; the punctual lights are the scene's.
    pub sources: &'a Sources,
    /// Reflections and refractions that follow each other, at most.
    pub depth: u32,
    /// Points on emissive triangles that each surface point asks.
    pub emitter_points: u32,
    /// Directions of a glossy surface that are drawn from its lobe: N_g of §4.3; 0: the field against the lobe in closed form.
    pub glossy_samples: u32,
    /// Chooses them.
    pub seed: u32,
}

/// A surface that a ray met, and what it does with light.
struct Point {
    surface: Surface,
    /// Normals on the ray's side.
    geometric: Vec3,
    shading: Vec3,
    /// Share that a metal reflects.
    specular: Vec3,
    roughness: f32,
    transmission: f32,
    ior: f32,
    /// Whether the ray comes from the side that the triangle faces.
    front: bool,
}

impl Point {
    fn at(scene: &Scene, triangle: u32, (u, v): (f32, f32), direction: Vec3) -> Self {
        let surface = scene.surface(triangle, u, v);
        let (geometric, shading) = surface.facing(-direction);
        let material = &scene.materials[surface.material as usize];
        let (specular, roughness) = scene.specular(triangle, u, v);
        Self {
            front: surface.geometric_normal.dot(direction) < 0.0,
            surface,
            geometric,
            shading,
            specular,
            roughness,
            transmission: material.transmission,
            ior: material.ior,
        }
    }
}

impl Whitted<'_> {
    /// What a camera sees: all light, W/(sr·m²).
    #[must_use]
    pub fn render(&self, view: &View, size: [u32; 2]) -> Image {
        let pixel = |i: u32| {
            let ray = view.ray(Vec2::new((i % size[0]) as f32 + 0.5, (i / size[0]) as f32 + 0.5), size);
            self.radiance(&ray, hash_combine(self.seed, i), 0)
        };
        let pixels = (0..size[0] * size[1]).into_par_iter().with_min_len(64).map(pixel).collect();
        Image { size, pixels }
    }

    /// Radiance that comes back along a ray, W/(sr·m²).
    fn radiance(&self, ray: &Ray, seed: u32, depth: u32) -> Vec3 {
        let scene = self.accel.scene();
        let Some(hit) = self.accel.closest_hit(ray) else { return Vec3::ZERO };
        let point = Point::at(scene, hit.triangle, (hit.u, hit.v), ray.direction);
        let material = &scene.materials[point.surface.material as usize];
        let mut sum = Vec3::ZERO;
        if material.is_emissive() && (point.front || material.double_sided) {
            sum += scene.emission(hit.triangle, hit.u, hit.v);
        }
        let opaque = 1.0 - point.transmission;
        let diffuse = point.surface.albedo * opaque;
        let glossy = point.specular != Vec3::ZERO && point.roughness > MIRROR;
        if diffuse != Vec3::ZERO || glossy {
            let local = self.field.at(point.surface.position, point.geometric);
            if diffuse != Vec3::ZERO {
                let e = self.direct(&point, seed) + local.irradiance(point.shading);
                sum += diffuse * FRAC_1_PI * e;
            }
            if glossy {
                sum += point.specular * self.glossy(&local, &point, ray.direction, seed);
            }
        }
        if depth < self.depth {
            if point.specular != Vec3::ZERO && point.roughness <= MIRROR {
                let next = self.leaving(&point, reflect(ray.direction, point.shading), true);
                sum += point.specular * self.radiance(&next, hash_combine(seed, 1), depth + 1);
            }
            if point.transmission > 0.0 {
                sum += self.through(&point, ray.direction, seed, depth) * point.transmission;
            }
        }
        sum
    }

    /// Glass: what is reflected by Fresnel's share, and the rest refracted.
    fn through(&self, point: &Point, direction: Vec3, seed: u32, depth: u32) -> Vec3 {
        let ratio = if point.front { 1.0 / point.ior } else { point.ior };
        let (refracted, share) = refract(direction, point.shading, ratio);
        let mut sum = Vec3::ZERO;
        if share > 0.0 {
            let next = self.leaving(point, reflect(direction, point.shading), true);
            sum += self.radiance(&next, hash_combine(seed, 2), depth + 1) * share;
        }
        if share < 1.0 {
            let next = self.leaving(point, refracted, false);
            let tint = self.accel.scene().materials[point.surface.material as usize].base_color;
            sum += tint * self.radiance(&next, hash_combine(seed, 3), depth + 1) * (1.0 - share);
        }
        sum
    }

    /// A ray from a point, on the side from which it was seen or through it.
    fn leaving(&self, point: &Point, direction: Vec3, same_side: bool) -> Ray {
        let n = if same_side { point.geometric } else { -point.geometric };
        Ray::new(math::offset_ray_origin_scaled(point.surface.position, n, self.accel.unit()), direction)
    }

    /// The field against a Phong lobe about the mirrored ray (§4.3), as a share of what a mirror would show.
    fn glossy(&self, local: &Local, point: &Point, direction: Vec3, seed: u32) -> Vec3 {
        let r = reflect(direction, point.shading);
        // The exponent whose lobe is as wide as that of glTF's roughness.
        let alpha = (point.roughness * point.roughness).max(1e-3);
        let exponent = (2.0 / (alpha * alpha) - 2.0).max(1.0);
        if self.glossy_samples > 0 {
            return self.glossy_sampled(local, point.shading, (r, exponent), seed);
        }
        let lobe = Zonal::<MOST_COEFFICIENTS>::phong(f64::from(exponent)).normalized();
        local.sh.convolve(&lobe).evaluate(r.to_array()).truncate().max(Vec3::ZERO)
    }

    fn glossy_sampled(&self, local: &Local, n: Vec3, (r, exponent): (Vec3, f32), seed: u32) -> Vec3 {
        let (t, b) = math::orthonormal_basis(r);
        let mut sum = Vec3::ZERO;
        for k in 0..self.glossy_samples {
            let w =
                indirect_sampling::mapping::phong_lobe(sobol::sample_2d(k, hash_combine(seed, 5)), exponent);
            let d = t * w.x + b * w.y + r * w.z;
            if d.dot(n) > 0.0 {
                sum += local.evaluate(d).truncate();
            }
        }
        (sum / self.glossy_samples as f32).max(Vec3::ZERO)
    }

    /// Irradiance of lights and emissive triangles, W/m².
    fn direct(&self, point: &Point, seed: u32) -> Vec3 {
        let (p, unit) = (point.surface.position, self.accel.unit());
        let origin = math::offset_ray_origin_scaled(p, point.geometric, unit);
        let mut sum = Vec3::ZERO;
        for light in &self.accel.scene().lights {
            let s = light.sample(p);
            let cosine = point.shading.dot(s.direction);
            if cosine > 0.0 && point.geometric.dot(s.direction) > 0.0 && s.irradiance != Vec3::ZERO {
                let t_max = if s.distance.is_finite() { s.distance * SHADOW_END } else { f32::INFINITY };
                if !self.accel.any_hit(&Ray { origin, direction: s.direction, t_max }) {
                    sum += s.irradiance * cosine;
                }
            }
        }
        let emitters = self.sources.emitters();
        if emitters.is_empty() || self.emitter_points == 0 {
            return sum;
        }
        let mut asked = Vec3::ZERO;
        for k in 0..self.emitter_points {
            let u = sobol::sample_2d(k, hash_combine(seed, 7));
            let (i, rest) = pick(emitters.len(), |i| emitters[i].upto, u.x);
            let before = if i == 0 { 0.0 } else { emitters[i - 1].upto };
            let share = emitters[i].upto - before;
            asked += self.emitted(&emitters[i], share, Vec2::new(rest, u.y), origin, point);
        }
        sum + asked / self.emitter_points as f32
    }

    /// Irradiance from a point of an emissive triangle that is drawn with the probability `share`; bounded close to it, which darkens a little.
    fn emitted(&self, e: &Emitter, share: f32, u: Vec2, origin: Vec3, point: &Point) -> Vec3 {
        let (q, normal) = emitter_point(e, u);
        let v = q - point.surface.position;
        let d2 = v.length_squared();
        let w = v * d2.max(f32::MIN_POSITIVE).sqrt().recip();
        let (here, there) = (point.shading.dot(w), -normal.dot(w));
        if here <= 0.0 || there <= 0.0 || point.geometric.dot(w) <= 0.0 || d2 <= 0.0 || share <= 0.0 {
            return Vec3::ZERO;
        }
        let to = math::offset_ray_origin_scaled(q, normal, self.accel.unit());
        if self.accel.any_hit(&Ray { origin, direction: to - origin, t_max: 1.0 }) {
            return Vec3::ZERO;
        }
        let area = 0.5 * e.edge_u.cross(e.edge_v).length() * if e.two_sided == 1 { 2.0 } else { 1.0 };
        // No nearer than the triangle is large: one of few points would shine like a star.
        let kernel = here * there / (d2 + area * share.min(1.0) * FRAC_1_PI / self.emitter_points as f32);
        e.radiance * (kernel * area / share).min(2.0 * PI)
    }
}

fn reflect(d: Vec3, n: Vec3) -> Vec3 {
    d - n * (2.0 * d.dot(n))
}

/// A refracted direction, for a ratio of the refractive indices before and behind, and the share of light that is reflected instead
/// (Fresnel's equations for unpolarised light); 1 where all is.
fn refract(d: Vec3, n: Vec3, ratio: f32) -> (Vec3, f32) {
    let cos_in = (-d.dot(n)).clamp(0.0, 1.0);
    let sin2 = ratio * ratio * (1.0 - cos_in * cos_in);
    if sin2 >= 1.0 {
        return (d, 1.0);
    }
    let cos_out = (1.0 - sin2).sqrt();
    let across = (ratio * cos_in - cos_out) / (ratio * cos_in + cos_out);
    let along = (cos_in - ratio * cos_out) / (cos_in + ratio * cos_out);
    let direction = d * ratio + n * (ratio * cos_in - cos_out);
    (direction, 0.5 * (across * across + along * along))
}
