//! Ambient cubes as Bevy's irradiance volume, and spherical harmonics as three.js's light probes.

use core::f32::consts::PI;

use glam::{UVec3, Vec3};
use indirect_accel::Accel;
use indirect_scene::ktx2;
use reference_pathtracer::Settings;
use serde::Serialize;
use sh_math::{Quadrature, ShL2};

use super::check::{Points, error};
use super::grid::Grid;
use super::irradiance::{Made, irradiance};
use crate::cli::{BakeArgs, BakeFormat};
use crate::failure::{self, Failure, Outcome};
use crate::say;

/// Irradiance of a radiance field of the bands l is A_l times it: π, 2π/3, π/4.
const COSINE: [f32; 3] = [PI, 2.0 * PI / 3.0, PI / 4.0];

/// The rule over which irradiance is projected: exact for its own bands up to 2 beside the 6 above, of which band 4 is the first and has
/// 1/24 of the light of band 0.
const DEGREE: usize = 8;

/// What a probe holds.
#[derive(Debug, Clone)]
struct Probe {
    /// Ambient cube of irradiance, W/m²: faces +X, −X, +Y, −Y, +Z, −Z.
    cube: [Vec3; 6],
    /// Radiance that arrives, W/(sr·m²).
    radiance: ShL2<Vec3>,
}

#[derive(Debug, Serialize)]
struct Volume<'a> {
    #[serde(flatten)]
    made: &'a Made,
    format: &'static str,
    /// Probes along each axis.
    resolution: [u32; 3],
    /// Centre of the box that the texture fills, metres: the translation of the entity that carries it.
    translation: [f32; 3],
    /// Size of the box, metres: its scale.
    scale: [f32; 3],
    /// The values are irradiance over π, W/(sr·m²): times albedo they are radiance. Intensity 1 in units of the scene.
    unit: &'static str,
    /// Probes that are inside of something and hold the mean of their neighbours.
    filled: Vec<usize>,
    file: &'static str,
}

#[derive(Debug, Serialize)]
struct Harmonics<'a> {
    #[serde(flatten)]
    made: &'a Made,
    format: &'static str,
    /// Probes along each axis; x is fastest in the file, then y, then z.
    resolution: [u32; 3],
    /// Where the first probe is, metres.
    origin: [f32; 3],
    /// From probe to probe, metres.
    spacing: [f32; 3],
    unit: &'static str,
    filled: Vec<usize>,
    /// float32, little-endian: 9 coefficients of 3 channels for each probe, in the order and with the signs of `SphericalHarmonics3`.
    file: &'static str,
}

pub(crate) fn run(
    accel: &Accel<'_>,
    grid: &Grid,
    settings: &Settings,
    args: &BakeArgs,
    made: &Made,
    points: &Points,
) -> Outcome {
    let probes = bake(accel, grid, settings, args)?;
    let filled: Vec<usize> = (0..probes.len()).filter(|i| grid.inside[*i]).collect();
    let UVec3 { x, y, z } = grid.resolution;
    say(format!("{x}×{y}×{z} probes, {} of them inside of something and filled", filled.len()));
    let resolution = grid.resolution.to_array();
    if args.format.contains(&BakeFormat::Bevy) {
        let (size, texels) = volume(grid, &probes);
        let bytes = ktx2::encode_volume(size, &texels).map_err(|e| Failure::Check(e.to_string()))?;
        let path = args.out.join("irradiance_volume.ktx2");
        failure::write(&path, bytes)?;
        let extent = grid.cell * grid.resolution.as_vec3();
        let about = Volume {
            made,
            format: "bevy irradiance volume",
            resolution,
            translation: (grid.min + 0.5 * extent).to_array(),
            scale: extent.to_array(),
            unit: "irradiance / pi, W/(sr m^2)",
            filled: filled.clone(),
            file: "irradiance_volume.ktx2",
        };
        failure::write_json(&args.out.join("irradiance_volume.json"), &about)?;
        report("ambient cubes", &path, points, |p, n| PI * ambient(grid, &probes, p, n));
    }
    if args.format.contains(&BakeFormat::Three) {
        let path = args.out.join("probes.bin");
        let floats = probes.iter().flat_map(|p| p.radiance.0).flat_map(|c| c.to_array());
        failure::write(&path, floats.flat_map(f32::to_le_bytes).collect::<Vec<u8>>())?;
        let about = Harmonics {
            made,
            format: "three.js SphericalHarmonics3",
            resolution,
            origin: (grid.min + 0.5 * grid.cell).to_array(),
            spacing: grid.cell.to_array(),
            unit: "radiance, W/(sr m^2)",
            filled,
            file: "probes.bin",
        };
        failure::write_json(&args.out.join("probes.json"), &about)?;
        report("spherical harmonics", &path, points, |p, n| {
            let near = neighbours(grid, p);
            let sum = near.iter().map(|(i, w)| probes[*i].radiance.irradiance(n.to_array()) * *w);
            sum.sum::<Vec3>()
        });
    }
    failure::write_json(&args.out.join("check.json"), points)
}

fn report(what: &str, path: &std::path::Path, points: &Points, baked: impl Fn(Vec3, Vec3) -> Vec3) {
    say(format!("{}: {what}", path.display()));
    for (where_, list) in [("at probes", &points.at_probes), ("anywhere between", &points.between)] {
        if !list.is_empty() {
            let (percent, noise) = (100.0 * error(list, &baked), 100.0 * points.noise);
            let count = list.len();
            say(format!(
                "  irradiance {where_}: {percent:.2} % rms of the path tracer's at {count} points (its noise {noise:.2} %)"
            ));
        }
    }
}

/// Normals at which a probe's irradiance is estimated, with their shares of the sphere, sr.
fn directions() -> Vec<(Vec3, f32)> {
    let mut directions = Vec::new();
    Quadrature::new(DEGREE).for_each(|d, weight| {
        directions.push((glam::DVec3::from_array(d).as_vec3(), weight as f32));
    });
    directions
}

/// How much each face of an ambient cube adds for a normal: the square of the normal's component towards it.
fn faces(n: Vec3) -> [f32; 6] {
    core::array::from_fn(|face| {
        let towards = if face % 2 == 0 { n[face / 2] } else { -n[face / 2] };
        towards.max(0.0).powi(2)
    })
}

/// Ambient cubes that are the best fit, by least squares over all normals: better than irradiance at the axes, of which the interpolation
/// between them knows too little.
struct Cubes {
    /// The inverse of the faces' products, integrated over the sphere.
    inverse: [[f64; 6]; 6],
}

impl Cubes {
    fn new(directions: &[(Vec3, f32)]) -> Self {
        let mut rows = [[0.0; 12]; 6];
        for (direction, weight) in directions {
            let f = faces(*direction).map(f64::from);
            for i in 0..6 {
                for k in 0..6 {
                    rows[i][k] += f[i] * f[k] * f64::from(*weight);
                }
            }
        }
        // Gauss and Jordan; the matrix is positive definite, so that no pivot vanishes.
        for (i, row) in rows.iter_mut().enumerate() {
            row[6 + i] = 1.0;
        }
        for i in 0..6 {
            let pivot = rows[i].map(|v| v / rows[i][i]);
            for (k, row) in rows.iter_mut().enumerate() {
                let factor = row[i];
                if k != i {
                    row.iter_mut().zip(pivot).for_each(|(v, p)| *v -= factor * p);
                }
            }
            rows[i] = pivot;
        }
        Self { inverse: rows.map(|row| core::array::from_fn(|k| row[6 + k])) }
    }

    fn fit(&self, directions: &[(Vec3, f32)], values: &[Vec3]) -> [Vec3; 6] {
        let mut moments = [glam::DVec3::ZERO; 6];
        for ((direction, weight), value) in directions.iter().zip(values) {
            for (m, f) in moments.iter_mut().zip(faces(*direction)) {
                *m += value.as_dvec3() * f64::from(f * weight);
            }
        }
        self.inverse.map(|row| {
            let sum: glam::DVec3 = row.iter().zip(moments).map(|(r, m)| m * *r).sum();
            sum.as_vec3().max(Vec3::ZERO)
        })
    }
}

/// All probes, filled.
fn bake(accel: &Accel<'_>, grid: &Grid, settings: &Settings, args: &BakeArgs) -> Outcome<Vec<Probe>> {
    let directions = directions();
    let cubes = Cubes::new(&directions);
    let free = grid.positions().zip(&grid.inside).filter(|(_, inside)| !**inside);
    let receivers: Vec<_> = free.flat_map(|(p, _)| directions.iter().map(move |(n, _)| (p, *n))).collect();
    let (found, _) = irradiance(accel, &receivers, settings, args.component, "probes")?;
    let mut made = found.chunks(directions.len());
    let nothing = Probe { cube: [Vec3::ZERO; 6], radiance: ShL2::default() };
    let mut probes: Vec<Probe> = Vec::with_capacity(grid.inside.len());
    for inside in &grid.inside {
        let Some(values) = (if *inside { None } else { made.next() }) else {
            probes.push(nothing.clone());
            continue;
        };
        let mut irradiance = ShL2::<Vec3>::default();
        for ((direction, weight), value) in directions.iter().zip(values) {
            irradiance.project_add(direction.to_array(), *value * *weight);
        }
        let mut radiance = irradiance;
        for (i, c) in radiance.0.iter_mut().enumerate() {
            *c /= COSINE[sh_math::band(i)];
        }
        probes.push(Probe { cube: cubes.fit(&directions, values), radiance });
    }
    grid.fill(&mut probes, |near| {
        let share = 1.0 / near.len() as f32;
        let mut mean = nothing.clone();
        for p in near {
            mean.cube.iter_mut().zip(p.cube).for_each(|(m, v)| *m += v * share);
            mean.radiance.0.iter_mut().zip(p.radiance.0).for_each(|(m, v)| *m += v * share);
        }
        mean
    });
    Ok(probes)
}

/// The texture of an irradiance volume: the six faces of the ambient cubes side by side, positive ones in the lower half along y, the axes one
/// after the other along z; irradiance over π.
fn volume(grid: &Grid, probes: &[Probe]) -> ([u32; 3], Vec<Vec3>) {
    let UVec3 { x, y, z } = grid.resolution;
    let size = [x, 2 * y, 3 * z];
    let mut texels = vec![Vec3::ZERO; (size[0] * size[1] * size[2]) as usize];
    for (i, probe) in (0_u32..).zip(probes) {
        let at = [i % x, i / x % y, i / (x * y)];
        for (face, value) in (0_u32..).zip(probe.cube) {
            let (axis, negative) = (face / 2, face % 2);
            let (row, slice) = (at[1] + negative * y, at[2] + axis * z);
            texels[((slice * size[1] + row) * size[0] + at[0]) as usize] = value / PI;
        }
    }
    (size, texels)
}

/// Probes around a point and their shares, as a texture is filtered that is clamped at its borders.
fn neighbours(grid: &Grid, p: Vec3) -> [(usize, f32); 8] {
    let last = grid.resolution.as_vec3() - 1.0;
    let at = ((p - grid.min) / grid.cell - 0.5).clamp(Vec3::ZERO, last);
    let low = at.floor().min((last - 1.0).max(Vec3::ZERO));
    let share = at - low;
    core::array::from_fn(|corner| {
        let bit = |axis: u32| (corner as u32 >> axis) & 1;
        let cell = (low.as_uvec3() + UVec3::new(bit(0), bit(1), bit(2))).min(grid.resolution - 1);
        let weight: f32 =
            (0..3).map(|a| if bit(a) == 1 { share[a as usize] } else { 1.0 - share[a as usize] }).product();
        let index = (cell.z * grid.resolution.y + cell.y) * grid.resolution.x + cell.x;
        (index as usize, weight)
    })
}

/// Irradiance over π from ambient cubes: faces weigh the squares of the normal's components.
fn ambient(grid: &Grid, probes: &[Probe], p: Vec3, n: Vec3) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for (i, weight) in neighbours(grid, p) {
        for (value, share) in probes[i].cube.iter().zip(faces(n)) {
            sum += *value * (share * weight / PI);
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(resolution: [u32; 3]) -> Grid {
        let resolution = UVec3::from(resolution);
        let inside = vec![false; resolution.element_product() as usize];
        Grid { resolution, min: Vec3::new(-1.0, 2.0, 0.5), cell: Vec3::new(0.5, 1.0, 2.0), inside }
    }

    #[test]
    fn cubes_are_fitted_exactly_where_they_can_be_and_best_where_not() {
        let directions = directions();
        let cubes = Cubes::new(&directions);
        let wanted: [Vec3; 6] =
            core::array::from_fn(|i| Vec3::new(1.0 + i as f32, 0.5, 2.0 - 0.3 * i as f32));
        let of = |cube: &[Vec3; 6], n| cube.iter().zip(faces(n)).map(|(c, f)| *c * f).sum::<Vec3>();
        let values: Vec<_> = directions.iter().map(|(n, _)| of(&wanted, *n)).collect();
        for (found, wanted) in cubes.fit(&directions, &values).iter().zip(wanted) {
            assert!((*found - wanted).length() < 1e-5, "{found} {wanted}");
        }
        // Light from one side: the squared error over the sphere is below that of irradiance at the axes.
        let side = Vec3::new(1.0, 0.4, -0.2).normalize();
        let values: Vec<_> = directions.iter().map(|(n, _)| Vec3::splat(n.dot(side).max(0.0))).collect();
        let axes = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
        let sampled = axes.map(|n| Vec3::splat(n.dot(side).max(0.0)));
        let squared = |cube: &[Vec3; 6]| {
            directions
                .iter()
                .zip(&values)
                .map(|((n, w), v)| w * (of(cube, *n) - *v).length_squared())
                .sum::<f32>()
        };
        let (best, at_axes) = (squared(&cubes.fit(&directions, &values)), squared(&sampled));
        assert!(best < 0.95 * at_axes, "{best} {at_axes}");
    }

    #[test]
    fn textures_are_laid_out_as_bevys_shader_reads_them() {
        let grid = grid([3, 2, 2]);
        let probe = |i: usize| Probe {
            cube: core::array::from_fn(|face| Vec3::new(i as f32, face as f32, 1.0) * PI),
            radiance: ShL2::default(),
        };
        let probes: Vec<_> = (0..12).map(probe).collect();
        let (size, texels) = volume(&grid, &probes);
        assert_eq!(size, [3, 4, 6]);
        let at = |x: u32, y: u32, z: u32| texels[((z * size[1] + y) * size[0] + x) as usize];
        // Probe (2, 1, 1) is number 11: +X, then −X a half further along y, Y a third and Z two thirds further along z.
        for (place, face) in [
            ([2, 1, 1], 0.0),
            ([2, 3, 1], 1.0),
            ([2, 1, 3], 2.0),
            ([2, 3, 3], 3.0),
            ([2, 1, 5], 4.0),
            ([2, 3, 5], 5.0),
        ] {
            let [x, y, z] = place;
            assert!((at(x, y, z) - Vec3::new(11.0, face, 1.0)).length() < 1e-5, "{place:?}");
        }
    }

    #[test]
    fn neighbours_share_a_point_as_a_clamped_filter_does() {
        let grid = grid([3, 1, 2]);
        let positions: Vec<_> = grid.positions().collect();
        for (i, p) in positions.iter().enumerate() {
            let whole: f32 = neighbours(&grid, *p).iter().filter(|(k, _)| *k == i).map(|n| n.1).sum();
            assert!((whole - 1.0).abs() < 1e-6, "{i}");
        }
        // A linear function along x and z is reproduced between probes; beyond them the border's value holds.
        let f = |p: Vec3| 2.0 * p.x - 3.0 * p.z;
        let read = |p: Vec3| neighbours(&grid, p).iter().map(|(i, w)| f(positions[*i]) * w).sum::<f32>();
        let p = Vec3::new(-0.1, 9.0, 2.0);
        assert!((read(p) - f(p)).abs() < 1e-5);
        let far = Vec3::new(-9.0, 2.5, 2.0);
        assert!((read(far) - f(Vec3::new(-0.75, 2.5, 2.0))).abs() < 1e-5);
    }

    #[test]
    fn harmonics_are_those_that_three_js_evaluates() {
        // Its constants (src/math/SphericalHarmonics3.js), as facts: 0.282095; 0.488603 of y, z, x; 1.092548 of xy, yz; 0.315392 of 3z² − 1;
        // 1.092548 of xz; 0.546274 of x² − y².
        let n = Vec3::new(0.48, -0.6, 0.64);
        let Vec3 { x, y, z } = n;
        let theirs = [
            0.282_095,
            0.488_603 * y,
            0.488_603 * z,
            0.488_603 * x,
            1.092_548 * x * y,
            1.092_548 * y * z,
            0.315_392 * (3.0 * z * z - 1.0),
            1.092_548 * x * z,
            0.546_274 * (x * x - y * y),
        ];
        for (i, theirs) in theirs.iter().enumerate() {
            let mut sh = ShL2::<f32>::default();
            sh.0[i] = 1.0;
            assert!((sh.evaluate(n.to_array()) - theirs).abs() < 1e-5, "{i}");
        }
    }
}
