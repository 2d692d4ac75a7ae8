use core::f64::consts::PI;

use glam::{DVec3, Vec2, Vec3};
use indirect_core::{Scene, math};
use indirect_sampling::mapping::triangle_uniform;

use crate::layout::Emitter;

/// Samples per side of a textured triangle over which emission and albedo are averaged.
const SAMPLES: u32 = 4;

/// The emissive triangles of a scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Emitters {
    /// Those whose flux is not 0, in the scene's order.
    pub triangles: Vec<Emitter>,
    /// Luminance of the flux of all, W.
    pub luminance: f32,
    /// Flux of all, W.
    pub flux: Vec3,
}

impl Emitters {
    /// Looks at all triangles of a scene. Each has the flux `π L A`, twice that where its material is double-sided; `L` is the mean over
    /// the triangle, the holes of an alpha test counted as 0.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let mesh = &scene.mesh;
        let (mut triangles, mut emitted, mut all) = (Vec::new(), 0.0_f64, DVec3::ZERO);
        for (t, &m) in (0..).zip(&mesh.materials) {
            let material = &scene.materials[m as usize];
            if !material.is_emissive() {
                continue;
            }
            let radiance = mean_emission(scene, t);
            let sides = if material.double_sided { 2.0 } else { 1.0 };
            let area = f64::from(mesh.area(t));
            let flux = f64::from(math::luminance(radiance)) * area * sides * PI;
            if flux <= 0.0 || !flux.is_finite() {
                continue;
            }
            emitted += flux;
            all += radiance.as_dvec3() * (area * sides * PI);
            let [a, b, c] = mesh.corners(t);
            triangles.push(Emitter {
                corner: a,
                upto: emitted as f32,
                edge_u: b - a,
                two_sided: material.double_sided.into(),
                edge_v: c - a,
                pad0: 0,
                radiance,
                pad1: 0,
            });
        }
        for e in &mut triangles {
            e.upto = (f64::from(e.upto) / emitted) as f32;
        }
        Self { triangles, luminance: emitted as f32, flux: all.as_vec3() }
    }
}

/// The mean of `at(u, v)` over the solid parts of a triangle, and the share of it that is solid, both from 4 × 4 points.
#[must_use]
pub fn solid_mean(scene: &Scene, triangle: u32, at: impl Fn(f32, f32) -> Vec3) -> (Vec3, f32) {
    let n = SAMPLES;
    let (mut sum, mut solid) = (Vec3::ZERO, 0.0);
    for i in 0..n * n {
        let u = Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32;
        let b = triangle_uniform(u);
        if scene.is_solid(triangle, b.x, b.y) {
            sum += at(b.x, b.y);
            solid += 1.0;
        }
    }
    (if solid > 0.0 { sum / solid } else { Vec3::ZERO }, solid / (n * n) as f32)
}

/// Mean emitted radiance of a triangle, the holes of its alpha test counted as 0.
fn mean_emission(scene: &Scene, triangle: u32) -> Vec3 {
    let (radiance, solid) = solid_mean(scene, triangle, |u, v| scene.emission(triangle, u, v));
    radiance * solid
}
