//! Probes on a regular grid.

use glam::{UVec3, Vec3};
use indirect_accel::Accel;
use indirect_core::Ray;
use indirect_sampling::mapping::sphere_uniform;
use indirect_sampling::sobol;

use crate::cli::BakeArgs;
use crate::failure::{Failure, Outcome};

/// Probes along the longest side of the scene where nothing else is asked for.
const DEFAULT_PROBES: f32 = 12.0;

/// Most probes: 51 irradiances each.
const MOST: u64 = 1 << 20;

/// Rays that tell whether a probe is inside of something.
const RAYS: u32 = 64;

/// A probe is inside where more than this share of the surfaces that it sees turn their backs.
const INSIDE: f32 = 0.25;

/// The middles of equal cells of a box.
#[derive(Debug, Clone)]
pub(crate) struct Grid {
    /// Cells along each axis.
    pub(crate) resolution: UVec3,
    /// Smallest corner of the box, metres.
    pub(crate) min: Vec3,
    /// Size of a cell, metres.
    pub(crate) cell: Vec3,
    /// Probes inside of something, whose light is that of their neighbours.
    pub(crate) inside: Vec<bool>,
}

impl Grid {
    pub(crate) fn new(accel: &Accel<'_>, args: &BakeArgs) -> Outcome<Self> {
        let bounds = accel.scene().bounds().filter(|b| b.diagonal() > 0.0);
        let bounds =
            bounds.ok_or_else(|| Failure::Input(format!("{}: a scene without extent", args.scene)))?;
        let extent = bounds.extent().max(Vec3::splat(1e-3 * bounds.diagonal()));
        let along =
            |spacing: f32| (extent / spacing).round().max(Vec3::ONE).min(Vec3::splat(4096.0)).as_uvec3();
        let resolution = match (args.probes, args.spacing) {
            (Some(probes), _) => UVec3::from(probes),
            (None, Some(spacing)) if spacing > 0.0 && spacing.is_finite() => along(spacing),
            (None, Some(spacing)) => {
                return Err(Failure::Input(format!(
                    "--spacing {spacing}: must be a positive number of metres"
                )));
            }
            (None, None) => along(extent.max_element() / DEFAULT_PROBES).max(UVec3::splat(2)),
        };
        let count = resolution.to_array().iter().map(|n| u64::from(*n)).product::<u64>();
        if count > MOST {
            let wanted = "at most 2^20: fewer --probes, or a larger --spacing";
            return Err(Failure::Input(format!("{count} probes: {wanted}")));
        }
        let mut grid =
            Self { resolution, min: bounds.min, cell: extent / resolution.as_vec3(), inside: Vec::new() };
        grid.inside = grid.positions().map(|p| is_inside(accel, p)).collect();
        if grid.inside.iter().all(|i| *i) {
            return Err(Failure::Input(format!(
                "{}: all probes are inside of something: bake more",
                args.scene
            )));
        }
        Ok(grid)
    }

    /// Where the probes are: x fastest, then y, then z.
    pub(crate) fn positions(&self) -> impl Iterator<Item = Vec3> + '_ {
        let UVec3 { x, y, z } = self.resolution;
        (0..x * y * z).map(move |i| {
            let cell = UVec3::new(i % x, i / x % y, i / (x * y));
            self.min + (cell.as_vec3() + 0.5) * self.cell
        })
    }

    /// Overwrites what probes inside of something hold by the mean of the neighbours that have something, until all have.
    pub(crate) fn fill<T: Clone>(&self, values: &mut [T], mean: impl Fn(&[&T]) -> T) {
        let [x, y, z] = self.resolution.to_array().map(|n| n as usize);
        let mut known: Vec<bool> = self.inside.iter().map(|i| !i).collect();
        while known.iter().any(|k| !k) {
            let (before, held) = (values.to_vec(), known.clone());
            for i in (0..values.len()).filter(|i| !held[*i]) {
                let at = [i % x, i / x % y, i / (x * y)];
                let mut near = Vec::new();
                for (axis, (stride, size)) in [(1, x), (x, y), (x * y, z)].into_iter().enumerate() {
                    if at[axis] > 0 && held[i - stride] {
                        near.push(&before[i - stride]);
                    }
                    if at[axis] + 1 < size && held[i + stride] {
                        near.push(&before[i + stride]);
                    }
                }
                if !near.is_empty() {
                    values[i] = mean(&near);
                    known[i] = true;
                }
            }
        }
    }
}

/// Whether most of what is seen from `p` turns its back: single-sided surfaces only, the others have none.
pub(crate) fn is_inside(accel: &Accel<'_>, p: Vec3) -> bool {
    let scene = accel.scene();
    let (mut backs, mut seen) = (0, 0);
    for i in 0..RAYS {
        let direction = sphere_uniform(sobol::sample_2d(i, 0x1b5));
        if let Some(hit) = accel.closest_hit(&Ray::new(p, direction)) {
            seen += 1;
            let material = scene.mesh.materials[hit.triangle as usize] as usize;
            let back = scene.mesh.geometric_normal(hit.triangle).dot(direction) > 0.0;
            backs += u32::from(back && !scene.materials[material].double_sided);
        }
    }
    backs as f32 > INSIDE * seen as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use indirect_accel::BuildPreset;
    use indirect_core::{Material, Scene};

    #[test]
    fn probes_inside_of_a_box_are_found_and_filled() {
        let mut scene =
            Scene { materials: vec![Material::diffuse("", Vec3::splat(0.5))], ..Scene::default() };
        let half = 0.4;
        for (n, s, t) in
            [(Vec3::X, Vec3::Y, Vec3::Z), (Vec3::Y, Vec3::Z, Vec3::X), (Vec3::Z, Vec3::X, Vec3::Y)]
        {
            for side in [half, -half] {
                let t = t * side;
                let s = s * half;
                scene.mesh.push_polygon(
                    &[n * side - s - t, n * side + s - t, n * side + s + t, n * side - s + t],
                    0,
                );
            }
        }
        let accel = Accel::build(&scene, BuildPreset::Fast);
        assert!(is_inside(&accel, Vec3::ZERO) && is_inside(&accel, Vec3::splat(0.3)));
        assert!(!is_inside(&accel, Vec3::splat(0.6)) && !is_inside(&accel, Vec3::X));
        let grid = Grid {
            resolution: UVec3::splat(3),
            min: Vec3::splat(-1.5),
            cell: Vec3::ONE,
            inside: (0..27).map(|i| i == 13 || i == 14).collect(),
        };
        let positions: Vec<_> = grid.positions().collect();
        assert_eq!(
            (positions[0], positions[13], positions[1]),
            (Vec3::NEG_ONE, Vec3::ZERO, Vec3::new(0.0, -1.0, -1.0))
        );
        let mut values: Vec<f32> = (0..27).map(|i| i as f32).collect();
        grid.fill(&mut values, |near| near.iter().copied().sum::<f32>() / near.len() as f32);
        // Neighbours of 13 but 14: 12, 10, 16, 4, 22; of 14 but 13: 11, 17, 5, 23.
        assert_eq!((values[13], values[14], values[12]), (12.8, 14.0, 12.0));
    }
}
