//! Small scenes and helpers that several tests share.
#![allow(dead_code, reason = "each test binary uses its own part")]

use glam::Vec3;
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::math::{luminance, orthonormal_basis};
use indirect_core::{GBuffer, Image, Scene, View};
use indirect_sampling::mapping::{hemisphere_cosine, triangle_uniform};
use indirect_sampling::rng::{hash_combine, unit_f32};
use indirect_sampling::sobol;
use indirect_technique::cpu::{Fit, run};
use reference_pathtracer::{Bounces, Components, Samples, Settings, render};
use sh_grid_raytracer::cpu::{Frame, Lookup, levels, radiance, sort};
use sh_grid_raytracer::layout::{Faces, StoredPhoton};
use sh_grid_raytracer::{Fitted, Options, Output, Params, Setup, ShGridRaytracer};
#[allow(unused_imports, reason = "each test binary uses its own part")]
pub(crate) use testkit::scenes::{corner, lamp, light, lights, square, view};

/// A closed box of the half sides `half` around `centre`, whose sides face inwards.
pub(crate) fn inside(scene: &mut Scene, centre: Vec3, half: Vec3, material: u32) {
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let mut n = Vec3::ZERO;
            n[axis] = sign;
            let u =
                Vec3::from_array(core::array::from_fn(|i| if i == (axis + 1) % 3 { half[i] } else { 0.0 }));
            let v =
                Vec3::from_array(core::array::from_fn(|i| if i == (axis + 2) % 3 { half[i] } else { 0.0 }));
            let c = centre + n * half;
            let (u, v) = if sign > 0.0 { (v, u) } else { (u, v) };
            scene.mesh.push_polygon(&[c - u - v, c + u - v, c + u + v, c - u + v], material);
        }
    }
}

pub(crate) fn options() -> Options {
    Options { grid: 12, photons: 4096, bounces: 3, directions: 80, samples: 16, ..Options::default() }
}

/// A scene made ready, with its camera.
pub(crate) struct Stage<'a> {
    pub(crate) accel: Accel<'a>,
    pub(crate) view: View,
    pub(crate) camera: GBuffer,
}

impl<'a> Stage<'a> {
    pub(crate) fn new(scene: &'a Scene, view: View, size: [u32; 2]) -> Self {
        let accel = Accel::build(scene, BuildPreset::Fast);
        let camera = cast::gbuffer(&accel, &view, size);
        Self { accel, view, camera }
    }

    pub(crate) fn setup(&self, options: Options, params: Params) -> Setup {
        ShGridRaytracer::fit(&self.accel, options, params).unwrap()
    }

    pub(crate) fn run(&self, setup: &Setup) -> Output {
        let mut output = Output::default();
        run::<ShGridRaytracer>(&self.frame(setup), &mut output);
        output
    }

    pub(crate) fn frame<'b>(&'b self, setup: &'b Setup) -> Frame<'b, Setup> {
        Frame::new(&self.accel, &self.view, &self.camera, setup)
    }
}

/// Largest component of all pixels.
pub(crate) fn most(pixels: &[Vec3]) -> f32 {
    pixels.iter().map(|p| p.max_element()).fold(0.0, f32::max)
}

/// A camera that sees these points of triangles, with the normals of the sides that it sees.
pub(crate) fn points(seen: &[(Vec3, Vec3)]) -> GBuffer {
    let mut camera = GBuffer::new([seen.len() as u32, 1]);
    camera.triangle.fill(0);
    camera.position = seen.iter().map(|s| s.0).collect();
    camera.normal = seen.iter().map(|s| s.1).collect();
    camera.albedo.fill(Vec3::ONE);
    camera
}

/// `side`² points on each triangle pair of a box made by [`inside`], with the normals to its middle.
pub(crate) fn points_inside(centre: Vec3, half: Vec3, side: u32) -> Vec<(Vec3, Vec3)> {
    let mut all = Vec::new();
    for (axis, sign) in (0..3).flat_map(|a| [(a, -1.0), (a, 1.0)]) {
        for k in 0..side * side {
            let at = |i: u32| 2.0 * (i as f32 + 0.5) / side as f32 - 1.0;
            let mut p = Vec3::ZERO;
            p[axis] = sign;
            p[(axis + 1) % 3] = at(k % side);
            p[(axis + 2) % 3] = at(k / side);
            let mut n = Vec3::ZERO;
            n[axis] = -sign;
            all.push((centre + p * half, n));
        }
    }
    all
}

/// Photons that give sides of triangles a radiosity, W/m²: `of(triangle, front)`. They are evenly spread, `per_face` on the area of a
/// cell's face, and leave with the density of the cosine.
pub(crate) fn shine(
    accel: &Accel<'_>,
    fitted: &Fitted,
    per_face: f32,
    printed: bool,
    of: impl Fn(u32, bool) -> f32,
) -> Vec<StoredPhoton> {
    let (mesh, grid) = (&accel.scene().mesh, &fitted.voxels.grid);
    let mut photons = Vec::new();
    for triangle in 0..mesh.triangles.len() as u32 {
        let ([a, b, c], area) = (mesh.corners(triangle), mesh.area(triangle));
        let count = (area / (grid.cell * grid.cell) * per_face).ceil() as u32;
        for front in [true, false] {
            let radiosity = of(triangle, front);
            if radiosity <= 0.0 {
                continue;
            }
            let n = mesh.geometric_normal(triangle) * if front { 1.0 } else { -1.0 };
            let (t, s) = orthonormal_basis(n);
            for i in 0..count {
                let u = triangle_uniform(sobol::sample_2d(i, 2 * triangle + u32::from(front)));
                let w = hemisphere_cosine(sobol::sample_2d(i, 99 + 2 * triangle + u32::from(front)));
                let p = a + (b - a) * u.x + (c - a) * u.y;
                photons.push(StoredPhoton {
                    flux: Vec3::splat(radiosity * area / count as f32),
                    cell: fitted.voxels.boundary_at(grid.local(p)).unwrap(),
                    axis: if printed { t * w.x + s * w.y + n * w.z } else { n },
                    photon: photons.len() as u32,
                });
            }
        }
    }
    photons
}

/// The R-grid with all levels.
pub(crate) fn faces(photons: &[StoredPhoton], fitted: &Fitted, printed: bool) -> Vec<Faces> {
    let mut faces = radiance(photons, &sort(photons), &fitted.voxels, printed);
    levels(&mut faces, &fitted.pyramid);
    faces
}

/// Reads it with the parameters' defaults.
pub(crate) fn lookup<'a>(fitted: &'a Fitted, faces: &'a [Faces], printed: bool) -> Lookup<'a> {
    Lookup { pyramid: &fitted.pyramid, faces, least_area: Params::default().least_area, printed }
}

/// Number `i` of a sequence of numbers in `[0, 1)`.
pub(crate) fn random(i: u32, k: u32) -> f32 {
    unit_f32(hash_combine(hash_combine(17, i), k))
}

/// The path tracer's indirect light, twice, with different random numbers.
pub(crate) fn reference(stage: &Stage<'_>, bounces: Bounces, samples: u32) -> [Image; 2] {
    [5, 6].map(|seed| {
        let settings = Settings {
            components: Components::Indirect,
            bounces,
            samples: Samples::count(samples),
            seed,
            ..Settings::default()
        };
        render(&stage.accel, &stage.view, stage.camera.size, &settings).unwrap().indirect
    })
}

/// `rel_rmse` and `bias` of the luminance. The product of the differences from two independent truths has their noise in it only by
/// chance, not in the mean, as a square would.
pub(crate) fn compared(image: &Image, truths: &[Image; 2]) -> (f64, f64) {
    let l = |image: &Image, i: usize| f64::from(luminance(image.pixels[i]));
    let (mut square, mut difference, mut sum) = (0.0, 0.0, 0.0);
    for i in 0..image.pixels.len() {
        let [a, b] = [0, 1].map(|k| l(image, i) - l(&truths[k], i));
        square += a * b;
        difference += 0.5 * (a + b);
        sum += 0.5 * (l(&truths[0], i) + l(&truths[1], i));
    }
    let n = image.pixels.len() as f64;
    ((square / n).max(0.0).sqrt() / (sum / n), difference / sum)
}
