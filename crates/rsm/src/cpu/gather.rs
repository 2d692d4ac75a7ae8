//! `gather`: the irradiance that virtual point lights (VPLs) cast on receivers, without visibility.
//!
//! ```text
//! E_i = Σ_j Φ_j cosθ_i cosθ_j / (π d² + A_j)
//! ```
//!
//! with the disc form; the point form has `A_j = 0`. The kernel knows nothing of maps: any list of VPLs and any list of
//! receivers will do.
//!
//! With `v = p_j − p_i` unnormalized the cosines' roots fall away, and one division per pair is left:
//! `(n_i·v)(−n_j·v) / (d²(π d² + A_j))`. VPLs are summed in order in chunks of [`CHUNK`], and the chunks' sums in order, as
//! the GPU does it; a receiver's lane sees the same operations whatever the instruction set, so results repeat bit for bit.

use glam::Vec3;
use rayon::prelude::*;

use super::kernel::CHUNK;
use super::receivers::{LANES, Lanes, Receivers};
use super::simd;
use crate::{layout::Vpl, selection::Form};

/// Blocks of receivers per parallel piece: a chunk of VPLs stays in the first-level cache meanwhile.
const PIECE: usize = 64;

/// Irradiance per receiver, W/m², in the order of `receivers`.
#[must_use]
pub fn gather(vpls: &[Vpl], receivers: &Receivers, form: Form) -> Vec<Vec3> {
    let kernel = simd::kernel();
    let area_scale = form.area_scale();
    let mut irradiance = vec![[Lanes::default(); 3]; receivers.blocks.len()];
    irradiance.par_chunks_mut(PIECE).zip(receivers.blocks.par_chunks(PIECE)).for_each(|(out, blocks)| {
        for chunk in vpls.chunks(CHUNK) {
            for (e, block) in out.iter_mut().zip(blocks) {
                let sum = kernel.gather_block(chunk, block, area_scale);
                for axis in 0..3 {
                    for lane in 0..LANES {
                        e[axis][lane] += sum[axis][lane];
                    }
                }
            }
        }
    });
    let lanes = (0..receivers.len).map(|i| (&irradiance[i / LANES], i % LANES));
    lanes.map(|(e, lane)| Vec3::new(e[0][lane], e[1][lane], e[2][lane])).collect()
}
