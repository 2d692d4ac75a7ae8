//! Points in the air at which baked probes are held against the path tracer.

use glam::Vec3;
use indirect_accel::Accel;
use indirect_core::{Image, Ray};
use indirect_sampling::mapping::sphere_uniform;
use indirect_sampling::sobol;
use reference_pathtracer::{Samples, Settings};
use serde::Serialize;

use super::grid::{Grid, is_inside};
use super::irradiance::irradiance;
use crate::cli::Component;
use crate::failure::Outcome;

/// How many times as many samples as a probe's irradiance the truth takes, and how many at least.
const MORE: u64 = 8;
const LEAST: u64 = 16_384;

/// A point, a normal, and the irradiance there.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct Point {
    pub(crate) position: [f32; 3],
    pub(crate) normal: [f32; 3],
    pub(crate) irradiance: [f32; 3],
}

/// Points and the truth there.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Points {
    /// Standard error of the truth over its mean.
    pub(crate) noise: f64,
    /// Points at probes, with other normals than those that were baked.
    pub(crate) at_probes: Vec<Point>,
    /// Points anywhere in the grid's box where a probe could be.
    pub(crate) between: Vec<Point>,
}

impl Points {
    /// `count` points of each kind; none for 0.
    pub(crate) fn new(
        accel: &Accel<'_>,
        grid: &Grid,
        count: u32,
        settings: &Settings,
        component: Component,
    ) -> Outcome<Self> {
        let mut receivers = Vec::new();
        let free: Vec<Vec3> =
            grid.positions().zip(&grid.inside).filter(|(_, inside)| !**inside).map(|(p, _)| p).collect();
        let normal = |i: u32| sphere_uniform(sobol::sample_2d(i, 0x0c4e));
        for i in 0..count {
            let chosen = (sobol::sample_1d(i, 0x51ab) * free.len() as f32) as usize;
            receivers.push((free[chosen.min(free.len() - 1)], normal(i)));
        }
        // Interpolation needs a probe on either side.
        let (low, size) =
            (grid.min + 0.5 * grid.cell, grid.cell * (grid.resolution.as_vec3() - 1.0).max(Vec3::ZERO));
        let mut tried = 0;
        while receivers.len() < 2 * count as usize && tried < 64 * count {
            let xy = sobol::sample_2d(tried, 0x7e57);
            let p = low + size * Vec3::new(xy.x, xy.y, sobol::sample_1d(tried, 0xbead));
            tried += 1;
            // Where all that surrounds a point is farther than some of a cell, so that light has something to vary over.
            if !is_inside(accel, p) && clearance(accel, p) > 0.05 * grid.cell.min_element() {
                receivers.push((p, normal(tried + 1000)));
            }
        }
        if receivers.is_empty() {
            return Ok(Self { noise: 0.0, at_probes: Vec::new(), between: Vec::new() });
        }
        let spp = (MORE * settings.samples.spp()).clamp(LEAST, 1 << 24);
        let samples = Samples::count(spp as u32);
        let settings = Settings { samples, seed: settings.seed.wrapping_add(0x0a11), ..*settings };
        let (found, noise) =
            irradiance(accel, &receivers, &settings, component, "irradiance to check against")?;
        let mut points: Vec<Point> = receivers
            .iter()
            .zip(&found)
            .map(|((p, n), e)| Point {
                position: p.to_array(),
                normal: n.to_array(),
                irradiance: e.to_array(),
            })
            .collect();
        let between = points.split_off(count as usize);
        Ok(Self { noise, at_probes: points, between })
    }
}

/// Distance to the nearest of what 16 rays meet.
fn clearance(accel: &Accel<'_>, p: Vec3) -> f32 {
    let rays = (0..16).map(|i| Ray::new(p, sphere_uniform(sobol::sample_2d(i, 0x3a1))));
    rays.filter_map(|r| accel.closest_hit(&r)).map(|h| h.t).fold(f32::INFINITY, f32::min)
}

/// Root mean square of the difference of what `baked` holds at points over that of the truth.
pub(crate) fn error(points: &[Point], baked: impl Fn(Vec3, Vec3) -> Vec3) -> f64 {
    let image = |pixels: Vec<Vec3>| Image { size: [pixels.len() as u32, 1], pixels };
    let truth = image(points.iter().map(|p| p.irradiance.into()).collect());
    let found = image(points.iter().map(|p| baked(p.position.into(), p.normal.into())).collect());
    testkit::own_renderer::relative_rms(&found, &truth)
}
