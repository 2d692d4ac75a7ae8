//! The functions of the workspace's `sh/sh.wgsl`, under the same names and with the same order of operations: what a
//! shader computes, callable from Rust. Everything is RGB in `Vec3`; directions are unit vectors.

use glam::{Vec2, Vec3};

use crate::basis::basis;
use crate::sh::Sh;
use crate::zonal::Zonal;

/// The basis at `d`, `l ≤ 1`.
#[must_use]
#[inline]
pub fn sh_basis_l1(d: Vec3) -> [f32; 4] {
    basis(d)
}

/// `Σ sh_i w_i`, `l ≤ 1`; [`Sh::weigh`].
#[must_use]
#[inline]
pub fn sh_weigh_l1(sh: &Sh<4, Vec3>, w: &[f32; 4]) -> Vec3 {
    sh.weigh(w)
}

/// The value of `sh` at `d`, `l ≤ 1`; [`Sh::evaluate`].
#[must_use]
#[inline]
pub fn sh_evaluate_l1(sh: &Sh<4, Vec3>, d: Vec3) -> Vec3 {
    sh.evaluate(d)
}

/// The zonal kernel with one factor per band, turned toward `axis`, `l ≤ 1`; [`Zonal::toward`].
#[must_use]
#[inline]
pub fn sh_lobe_l1(factors: Vec2, axis: Vec3) -> [f32; 4] {
    let factors = [factors.x, factors.y];
    Zonal::from_factors(|l| f64::from(factors[l])).toward(axis).0
}

/// Irradiance on a surface with the normal `n` in the radiance field `sh`, `l ≤ 1`; [`Sh::irradiance`].
#[must_use]
#[inline]
pub fn sh_irradiance_l1(sh: &Sh<4, Vec3>, n: Vec3) -> Vec3 {
    sh.irradiance(n)
}

/// Adds a sample at `d` to a projection, `l ≤ 1`; [`Sh::project_add`].
#[inline]
pub fn sh_project_add_l1(sh: &mut Sh<4, Vec3>, d: Vec3, weighted: Vec3) {
    sh.project_add(d, weighted);
}

/// The basis at `d`, `l ≤ 2`.
#[must_use]
#[inline]
pub fn sh_basis_l2(d: Vec3) -> [f32; 9] {
    basis(d)
}

/// `Σ sh_i w_i`, `l ≤ 2`; [`Sh::weigh`].
#[must_use]
#[inline]
pub fn sh_weigh_l2(sh: &Sh<9, Vec3>, w: &[f32; 9]) -> Vec3 {
    sh.weigh(w)
}

/// The value of `sh` at `d`, `l ≤ 2`; [`Sh::evaluate`].
#[must_use]
#[inline]
pub fn sh_evaluate_l2(sh: &Sh<9, Vec3>, d: Vec3) -> Vec3 {
    sh.evaluate(d)
}

/// The zonal kernel with one factor per band, turned toward `axis`, `l ≤ 2`; [`Zonal::toward`].
#[must_use]
#[inline]
pub fn sh_lobe_l2(factors: Vec3, axis: Vec3) -> [f32; 9] {
    let factors = [factors.x, factors.y, factors.z];
    Zonal::from_factors(|l| f64::from(factors[l])).toward(axis).0
}

/// Irradiance on a surface with the normal `n` in the radiance field `sh`, `l ≤ 2`; [`Sh::irradiance`].
#[must_use]
#[inline]
pub fn sh_irradiance_l2(sh: &Sh<9, Vec3>, n: Vec3) -> Vec3 {
    sh.irradiance(n)
}

/// Adds a sample at `d` to a projection, `l ≤ 2`; [`Sh::project_add`].
#[inline]
pub fn sh_project_add_l2(sh: &mut Sh<9, Vec3>, d: Vec3, weighted: Vec3) {
    sh.project_add(d, weighted);
}
