//! The inner loop of `gather`: one chunk of VPLs at one block of receivers.

use core::f32::consts::PI;

use super::receivers::{Block, LANES, Lanes};
use crate::layout::Vpl;

/// VPLs that are summed before their sum is added to a receiver: what one uniform buffer binding holds on the GPU.
pub const CHUNK: usize = 1024;

/// Smallest denominator: receivers that coincide with a VPL get 0 (their numerator is 0) instead of 0/0.
pub(super) const LEAST_DENOMINATOR: f32 = 1e-37;

/// The sum over one chunk for one block. Inlined into each instruction set's copy of it, see `simd.rs`.
#[inline(always)]
pub(super) fn gather_block(vpls: &[Vpl], block: &Block, area_scale: f32) -> [Lanes; 3] {
    let (p, n) = (&block.position, &block.normal);
    let mut sum = [Lanes::default(); 3];
    for vpl in vpls {
        let area = vpl.area * area_scale;
        for k in 0..LANES {
            let vx = vpl.position.x - p[0][k];
            let vy = vpl.position.y - p[1][k];
            let vz = vpl.position.z - p[2][k];
            let d2 = vx * vx + vy * vy + vz * vz;
            let ci = n[0][k] * vx + n[1][k] * vy + n[2][k] * vz;
            let cj = -(vpl.normal.x * vx + vpl.normal.y * vy + vpl.normal.z * vz);
            let denominator = d2 * (PI * d2 + area);
            let w = at_least(ci, 0.0) * at_least(cj, 0.0) / at_least(denominator, LEAST_DENOMINATOR);
            sum[0][k] += vpl.flux.x * w;
            sum[1][k] += vpl.flux.y * w;
            sum[2][k] += vpl.flux.z * w;
        }
    }
    sum
}

/// `max` as one instruction: `f32::max` spends two more on NaN.
#[inline(always)]
fn at_least(value: f32, least: f32) -> f32 {
    if value > least { value } else { least }
}
