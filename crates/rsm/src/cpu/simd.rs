//! The gather's kernel compiled once per instruction set, and the choice among them at run time.
//!
//! The only unsafe code of the crate: the call into a function that was compiled for AVX2, made after the processor said
//! that it has it. No intrinsics: the kernel is plain arithmetic over arrays that the compiler vectorises. It has no fused
//! operation, so all copies give the same bits.

#![allow(unsafe_code, reason = "calling a #[target_feature] function after detecting the feature")]

use super::kernel::gather_block;
use super::receivers::{Block, Lanes};
use super::walk::{Tile, gather_cut};
use crate::layout::{Branch, Vpl};

/// The gather's kernel for an instruction set that this processor has.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kernel(InstructionSet);

/// Private, so that nothing but [`kernel`] can claim that the processor has one.
#[derive(Debug, Clone, Copy)]
enum InstructionSet {
    /// What the crate was compiled for.
    Baseline,
    /// 256-bit vectors.
    #[cfg(target_arch = "x86_64")]
    Avx2,
}

/// The fastest kernel of this processor.
pub(super) fn kernel() -> Kernel {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        return Kernel(InstructionSet::Avx2);
    }
    Kernel(InstructionSet::Baseline)
}

impl Kernel {
    /// See [`gather_block`].
    pub(super) fn gather_block(self, vpls: &[Vpl], block: &Block, area_scale: f32) -> [Lanes; 3] {
        match self.0 {
            InstructionSet::Baseline => gather_block(vpls, block, area_scale),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `Avx2` is only made by `kernel`, after the processor reported AVX2.
            InstructionSet::Avx2 => unsafe { gather_block_avx2(vpls, block, area_scale) },
        }
    }

    /// See [`gather_cut`].
    pub(super) fn gather_cut(
        self,
        tree: &[Branch],
        tile: (&Tile, &Block),
        area_scale: f32,
        lights: &mut Vec<Vpl>,
    ) -> ([Lanes; 3], u32) {
        match self.0 {
            InstructionSet::Baseline => gather_cut(tree, tile, area_scale, lights),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `Avx2` is only made by `kernel`, after the processor reported AVX2.
            InstructionSet::Avx2 => unsafe { gather_cut_avx2(tree, tile, area_scale, lights) },
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn gather_cut_avx2(
    tree: &[Branch],
    tile: (&Tile, &Block),
    area_scale: f32,
    lights: &mut Vec<Vpl>,
) -> ([Lanes; 3], u32) {
    gather_cut(tree, tile, area_scale, lights)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn gather_block_avx2(vpls: &[Vpl], block: &Block, area_scale: f32) -> [Lanes; 3] {
    gather_block(vpls, block, area_scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn every_kernel_gives_the_same_bits() {
        let vpls: Vec<Vpl> = (0..100)
            .map(|i| {
                let t = i as f32;
                let n = Vec3::new(t.sin(), -1.0, t.cos()).normalize();
                Vpl::new(Vec3::new(t.cos(), 2.0, (2.0 * t).sin()), n, Vec3::new(1.0, t, 0.1), 0.01 * t)
            })
            .collect();
        let receivers: super::super::receivers::Receivers =
            (0..8).map(|i| (Vec3::X * 0.3 * i as f32, Vec3::Y)).collect();
        let block = receivers.first_block();
        let baseline = Kernel(InstructionSet::Baseline).gather_block(&vpls, block, 1.0);
        assert_eq!(kernel().gather_block(&vpls, block, 1.0), baseline);
        assert!(baseline[0].iter().all(|e| *e > 0.0));
    }
}
