use glam::Vec2;
use indirect_core::Scene;
use indirect_sampling::halton::{Halton, Scrambling};
use indirect_sampling::mapping::triangle_uniform;
use indirect_sampling::rng::{philox4x32, unit_f64};

use crate::layout::ScenePoint;
use crate::settings::Placement;

/// Points in the unit cube, one per index.
pub(crate) struct Cube {
    /// Bases 5, 2 and 3: the triangle is chosen by the coarsest, the place in it by the finest two.
    halton: Option<[Halton; 3]>,
    seed: u32,
}

impl Cube {
    pub(crate) fn new(placement: Placement, seed: u32) -> Self {
        let halton = match placement {
            Placement::LowDiscrepancy => {
                Some([2, 0, 1].map(|d| Halton::dimension(d, Scrambling::Owen(seed))))
            }
            Placement::Random => None,
        };
        Self { halton, seed }
    }

    pub(crate) fn point(&self, index: u32) -> [f64; 3] {
        if let Some(halton) = &self.halton {
            return core::array::from_fn(|k| halton[k].fraction(index.into()).to_f64());
        }
        let key = [self.seed, 0x1517];
        let [a, b, c, d] = philox4x32([index, 0, 0, 0], key);
        let [e, f, ..] = philox4x32([index, 1, 0, 0], key);
        [[a, b], [c, d], [e, f]].map(|[high, low]| unit_f64(u64::from(high) << 32 | u64::from(low)))
    }
}

/// `count` points on the scene's triangles, in proportion to area times the weight of the material: one number of the sequence
/// chooses the triangle, two the place in it.
///
/// `weights` has one weight per material, `≥ 0`; where it is shorter, the rest have weight 1. What has weight 0 is left out. The
/// areas of the points sum to that of the triangles with weight, group by group of equal weights (as far as a group has
/// points). Empty where nothing has an area. The same arguments give the same points.
#[must_use]
pub fn place(scene: &Scene, count: u32, weights: &[f32], placement: Placement, seed: u32) -> Vec<ScenePoint> {
    let mesh = &scene.mesh;
    let weight_of = |triangle: usize| {
        let material = mesh.materials.get(triangle).map_or(0, |m| *m as usize);
        weights.get(material).copied().unwrap_or(1.0)
    };
    // Running sums of area × weight over the triangles that have any; the groups of equal weight: weight, area, points.
    let mut sums: Vec<f64> = Vec::new();
    let mut triangles: Vec<(u32, usize)> = Vec::new();
    let mut groups: Vec<(f32, f64, u32)> = Vec::new();
    let mut total = 0.0_f64;
    for i in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(i as u32).map(|p| p.as_dvec3());
        let area = 0.5 * (b - a).cross(c - a).length();
        let weight = weight_of(i);
        let share = area * f64::from(weight);
        if share > 0.0 && share.is_finite() {
            let group = groups.iter().position(|g| g.0 == weight).unwrap_or(groups.len());
            if group == groups.len() {
                groups.push((weight, 0.0, 0));
            }
            groups[group].1 += area;
            total += share;
            sums.push(total);
            triangles.push((i as u32, group));
        }
    }
    if triangles.is_empty() || !total.is_finite() {
        return Vec::new();
    }
    let cube = Cube::new(placement, seed);
    let mut chosen: Vec<(ScenePoint, usize)> = (0..count)
        .map(|i| {
            let [x, y, z] = cube.point(i);
            let found = sums.partition_point(|sum| *sum <= x * total).min(triangles.len() - 1);
            let uv = triangle_uniform(Vec2::new(y as f32, z as f32));
            let (triangle, group) = triangles[found];
            groups[group].2 += 1;
            (ScenePoint { triangle, u: uv.x, v: uv.y, area: 0.0 }, group)
        })
        .collect();
    for (p, group) in &mut chosen {
        let (_, area, count) = groups[*group];
        p.area = (area / f64::from(count.max(1))) as f32;
    }
    chosen.into_iter().map(|(p, _)| p).collect()
}
