//! `tree`: a binary tree over any list of virtual point lights, so that a receiver's cut costs less than the list.
//!
//! 1. `keys`: each light's place along a space-filling curve through the lights' bounding box, lights that face alike
//!    together;
//! 2. `sort`: by key, equal keys in the order of the list; lights without flux last;
//! 3. `leaves`, `parents`: a balanced tree over the sorted order, level by level ([`TreeLayout`]): sums of flux and
//!    area, means weighted
//!    by flux, bounds of position and normal, and one light drawn in proportion to flux that represents all beneath;
//! 4. `reach`: the bound of each branch's error solved for the distance.
//!
//! Trees of point lights for cuts by a bound of their error: Walter et al. 2005, "Lightcuts"; one light in proportion
//! to flux for each cluster likewise. A sorted order instead of agglomeration: Lauterbach et al. 2009, "Fast BVH
//! Construction on GPUs".

use core::f32::consts::{FRAC_1_PI, PI};

use glam::Vec3;
use indirect_core::math::versine_of_sum;
use indirect_sampling::rng::{hash_combine, unit_f32};
use rayon::prelude::*;

use super::reach::{ALWAYS, reach};
use crate::{
    layout::{Branch, Vpl},
    selection::Bound,
    tree::TreeLayout,
};

const SAMPLES: usize = TreeLayout::SAMPLES as usize;

/// The key of a light without flux, after all others.
const UNLIT: u32 = u32::MAX;

/// Elements per parallel piece.
const PIECE: usize = 1024;

/// A binary tree over a list of virtual point lights.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LightTree {
    /// Where the levels lie.
    pub layout: TreeLayout,
    /// Index of each light in the list, in the order of the tree.
    pub order: Vec<u32>,
    /// The branches, for [`traverse`](super::traverse).
    pub branches: Vec<Branch>,
}

impl LightTree {
    /// The tree over `vpls`, of which those beyond [`TreeLayout::MAX_LIGHTS`], without flux or with anything that is
    /// not finite count as unlit. Until [`Self::solve_reach`] a cut is every light of the list.
    ///
    /// `seed` decides which light represents those beneath a branch: each with the probability of its share of their
    /// flux, so that over seeds a test of its visibility is right in the mean.
    #[must_use]
    pub fn new(vpls: &[Vpl], seed: u32) -> Self {
        let mut tree = Self::default();
        tree.rebuild(vpls, seed);
        tree
    }

    /// [`Self::new`] in the memory of a tree that is no longer needed: for lists that change from frame to frame.
    pub fn rebuild(&mut self, vpls: &[Vpl], seed: u32) {
        let vpls = &vpls[..vpls.len().min(TreeLayout::MAX_LIGHTS as usize)];
        let Self { layout, order, branches } = self;
        *layout = TreeLayout::new(vpls.len() as u32);
        *order = sort(&keys(vpls));
        branches.resize(layout.len() as usize, Branch::default());
        let leaves = &mut branches[layout.offset(0) as usize..];
        leaves.par_iter_mut().zip(&*order).enumerate().with_min_len(PIECE).for_each(|(i, (out, &vpl))| {
            *out = Branch { next: layout.next(0, i as u32), ..leaf(vpl, &vpls[vpl as usize]) };
        });
        for level in 1..layout.levels() {
            let (coarse, fine) = branches.split_at_mut(layout.offset(level - 1) as usize);
            let fine = &fine[..layout.count(level - 1) as usize];
            let offset = layout.offset(level) as usize;
            coarse[offset..].par_iter_mut().enumerate().with_min_len(PIECE).for_each(|(i, out)| {
                let second = fine.get(2 * i + 1).copied().unwrap_or_default();
                let (next, child) = (layout.next(level, i as u32), layout.child(level, i as u32));
                let u = unit_f32(hash_combine(seed, (offset + i) as u32));
                *out = Branch { next, child, ..parent(&fine[2 * i], &second, u) };
            });
        }
    }

    /// The branches of a level, 0 being the lights; none beyond the root.
    #[must_use]
    pub fn level(&self, level: usize) -> &[Branch] {
        &self.branches[self.layout.offset(level) as usize..][..self.layout.count(level) as usize]
    }

    /// The branches that stand for the light of all: of the finest level where no more than [`TreeLayout::SOURCES`]
    /// have flux, those that do.
    fn sources(&self) -> &[Branch] {
        let lit = self.level(0).partition_point(|leaf| leaf.weight() > 0.0);
        let (mut level, mut count) = (0, lit);
        while count > TreeLayout::SOURCES as usize {
            level += 1;
            count = lit.div_ceil(1 << level);
        }
        &self.level(level)[..count]
    }

    /// Mean over receivers and channels of the irradiance that the lights would cast if all faced them, W/m²: `Σ
    /// Φ/(π(d² + r²))` over up to 64 branches, at up to 256 receivers spread over the lists. Thresholds are shares of
    /// it: it follows the lights' power, and scaling the scene does not change its ratio to any other irradiance.
    /// Receivers whose normal is 0 do not count.
    #[must_use]
    pub fn reference_irradiance(&self, positions: &[Vec3], normals: &[Vec3]) -> f32 {
        let sources = self.sources();
        let n = positions.len().min(normals.len());
        let samples = n.min(SAMPLES);
        let mut sums = [(0.0, 0_u32); SAMPLES];
        for (i, sum) in sums.iter_mut().enumerate().take(samples) {
            let receiver = (i * n + n / 2) / samples;
            if normals[receiver] != Vec3::ZERO {
                *sum = (irradiance_at(sources, positions[receiver]), 1);
            }
        }
        // In the order of the twin's threads.
        let mut half = SAMPLES / 2;
        while half > 0 {
            for i in 0..half {
                sums[i] = (sums[i].0 + sums[i + half].0, sums[i].1 + sums[i + half].1);
            }
            half /= 2;
        }
        let (sum, count) = sums[0];
        if count > 0 { sum / count as f32 } else { 0.0 }
    }

    /// Sets [`Branch::reach`] to the distance below which a branch's bound exceeds `threshold`, W/m²: a share τ of
    /// [`Self::reference_irradiance`], 0.003 say. 0 makes every light part of every cut.
    pub fn solve_reach(&mut self, bound: Bound, threshold: f32) {
        let inner = self.layout.inner() as usize;
        self.branches[..inner].par_iter_mut().with_min_len(PIECE).for_each(|branch| {
            branch.reach = if branch.weight() > 0.0 { reach(branch, bound, threshold) } else { 0.0 };
        });
    }
}

/// Mean over the channels of the irradiance that the lights would cast at a point if all faced it.
fn irradiance_at(sources: &[Branch], position: Vec3) -> f32 {
    let mut sum = 0.0;
    for source in sources {
        let weight = source.weight();
        if weight > 0.0 {
            let v = source.position - position;
            let d2 = v.dot(v) + source.radius * source.radius;
            sum += weight / (3.0 * PI * d2.max(f32::MIN_POSITIVE));
        }
    }
    sum
}

/// Whether a light takes part.
fn is_lit(vpl: &Vpl) -> bool {
    let finite =
        vpl.position.is_finite() && vpl.normal.is_finite() && vpl.flux.is_finite() && vpl.area.is_finite();
    finite && vpl.flux.x + vpl.flux.y + vpl.flux.z > 0.0
}

/// `keys`: which way a light faces, 3 bits, and its place along the curve, 29 bits.
fn keys(vpls: &[Vpl]) -> Vec<u32> {
    let empty = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let join = |a: (Vec3, Vec3), b: (Vec3, Vec3)| (a.0.min(b.0), a.1.max(b.1));
    let lit = vpls.par_iter().with_min_len(PIECE).filter(|v| is_lit(v));
    let (low, high) = lit.fold(|| empty, |a, v| join(a, (v.position, v.position))).reduce(|| empty, join);
    let scale = cells_per_metre((high - low).max_element());
    let of = |vpl: &Vpl| if is_lit(vpl) { key(vpl, low, scale) } else { UNLIT };
    vpls.par_iter().with_min_len(PIECE).map(of).collect()
}

/// Cells along a side of the bounding cube.
const CELLS: f32 = 1024.0;

/// Its last bits are left out, so that a division that errs in them, as those of GPUs do, gives the same.
fn cells_per_metre(extent: f32) -> f32 {
    if extent > 1e-30 && extent < 1e30 {
        f32::from_bits((CELLS / extent).to_bits() & 0xffff_f000)
    } else {
        0.0
    }
}

fn key(vpl: &Vpl, low: Vec3, scale: f32) -> u32 {
    let cell = ((vpl.position - low) * scale).min(Vec3::splat(CELLS - 1.0));
    (facing(vpl.normal) << 29) | (curve([cell.x as u32, cell.y as u32, cell.z as u32]) >> 1)
}

/// The axis, 0 to 5, that a normal is nearest to.
fn facing(normal: Vec3) -> u32 {
    let a = normal.abs();
    let axis = if a.x >= a.y && a.x >= a.z { 0 } else { 1 + u32::from(a.y < a.z) };
    2 * axis + u32::from(normal[axis as usize] < 0.0)
}

/// Bits of the three coordinates by turns (Morton order), 10 of each.
fn curve(cell: [u32; 3]) -> u32 {
    let [x, y, z] = cell.map(|c| {
        let c = (c | (c << 16)) & 0x0300_00ff;
        let c = (c | (c << 8)) & 0x0300_f00f;
        let c = (c | (c << 4)) & 0x030c_30c3;
        (c | (c << 2)) & 0x0924_9249
    });
    (x << 2) | (y << 1) | z
}

/// `sort`: the indices of the keys in ascending order, equal ones as they come. By digits from the last on (radix
/// sort).
fn sort(keys: &[u32]) -> Vec<u32> {
    const DIGIT: u32 = 11;
    let mut order: Vec<u32> = (0..keys.len() as u32).collect();
    let mut sorted = vec![0; keys.len()];
    for shift in [0, DIGIT, 2 * DIGIT] {
        let digit = |i: u32| (keys[i as usize] >> shift) as usize & ((1 << DIGIT) - 1);
        let mut places = [0_u32; 1 << DIGIT];
        for key in keys {
            places[(key >> shift) as usize & ((1 << DIGIT) - 1)] += 1;
        }
        let mut first = 0;
        for place in &mut places {
            first += core::mem::replace(place, first);
        }
        for &i in &order {
            let place = &mut places[digit(i)];
            sorted[*place as usize] = i;
            *place += 1;
        }
        core::mem::swap(&mut order, &mut sorted);
    }
    order
}

/// The branch of light `i`: a disc.
fn leaf(i: u32, vpl: &Vpl) -> Branch {
    if !is_lit(vpl) {
        return Branch::default();
    }
    Branch {
        position: vpl.position,
        area: vpl.area,
        normal: vpl.normal,
        flux: vpl.flux,
        representative: i,
        radius: (vpl.area.max(0.0) * FRAC_1_PI).sqrt(),
        ..Branch::default()
    }
}

/// The branch above two, of which the second, or both, may be without flux. `u` in `[0, 1)` draws the representative.
fn parent(a: &Branch, b: &Branch, u: f32) -> Branch {
    let mut light = Branch { flux: a.flux + b.flux, area: a.area + b.area, ..Branch::default() };
    let total = light.weight();
    if total <= 0.0 {
        return light;
    }
    let (first, second) = (a.weight(), b.weight());
    light.representative = if u * total < first { a.representative } else { b.representative };
    let (sa, sb) = (first / total, second / total);
    light.position = a.position * sa + b.position * sb;
    let axis = a.normal * sa + b.normal * sb;
    let length = axis.dot(axis).sqrt();
    let cancelled = length < 1e-3;
    // Normals that cancel: the brighter is better than none, the cone is everything.
    let brighter = if first >= second { a.normal } else { b.normal };
    light.normal = if cancelled { brighter } else { axis * (1.0 / length) };
    for child in [a, b] {
        if child.weight() > 0.0 {
            let v = child.position - light.position;
            light.radius = light.radius.max(v.dot(v).sqrt() + child.radius);
            let offset = child.normal - light.normal;
            light.versine = light.versine.max(versine_of_sum(0.5 * offset.dot(offset), child.versine));
        }
    }
    if cancelled {
        light.versine = 2.0;
    }
    light.reach = ALWAYS;
    light
}
