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

use core::f32::consts::PI;

use glam::Vec3;
use indirect_core::{GBuffer, Image};
use rayon::prelude::*;

use super::simd;
use crate::{layout::Vpl, params::Form};

/// VPLs that are summed before their sum is added to a receiver: what one uniform buffer binding holds on the GPU.
pub const CHUNK: usize = 1024;

/// Receivers that the kernel treats at once.
pub(super) const LANES: usize = 8;

/// Blocks of receivers per parallel piece: a chunk of VPLs stays in the first-level cache meanwhile.
const PIECE: usize = 64;

/// Smallest denominator: receivers that coincide with a VPL get 0 (their numerator is 0) instead of 0/0.
pub(super) const LEAST_DENOMINATOR: f32 = 1e-37;

/// One value per lane.
pub(super) type Lanes = [f32; LANES];

/// Positions and normals of [`LANES`] receivers, component by component.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Block {
    position: [Lanes; 3],
    normal: [Lanes; 3],
}

/// Surface points that receive light, arranged for the kernel.
#[derive(Debug, Clone, Default)]
pub struct Receivers {
    blocks: Vec<Block>,
    len: usize,
}

impl Receivers {
    /// Number of receivers.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    #[cfg(test)]
    pub(super) fn first_block(&self) -> &Block {
        &self.blocks[0]
    }

    /// The texels of `surface` that see something, and the index of each.
    #[must_use]
    pub fn of_surface(surface: &GBuffer) -> (Self, Vec<u32>) {
        let texels: Vec<u32> =
            (0..surface.len()).filter(|&i| surface.is_surface(i)).map(|i| i as u32).collect();
        let points = texels.iter().map(|&i| (surface.position[i as usize], surface.normal[i as usize]));
        (points.collect(), texels)
    }
}

impl FromIterator<(Vec3, Vec3)> for Receivers {
    /// Collects pairs of world position, metres, and unit normal.
    fn from_iter<T: IntoIterator<Item = (Vec3, Vec3)>>(points: T) -> Self {
        let mut receivers = Self::default();
        for (position, normal) in points {
            let lane = receivers.len % LANES;
            if lane == 0 {
                receivers.blocks.push(Block::default());
            }
            if let Some(block) = receivers.blocks.last_mut() {
                for axis in 0..3 {
                    block.position[axis][lane] = position[axis];
                    block.normal[axis][lane] = normal[axis];
                }
            }
            receivers.len += 1;
        }
        receivers
    }
}

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

/// The sum over one chunk for one block. Inlined into each instruction set's copy of it, see [`simd`].
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

/// `shade`: the radiance that leaves each pixel, `ρ/π · E`, W/(sr·m²). `irradiance` belongs to the pixels `texels`; every
/// other pixel is 0.
///
/// # Panics
/// Where `texels` names a pixel that `surface` does not have.
#[must_use]
pub fn shade(surface: &GBuffer, texels: &[u32], irradiance: &[Vec3]) -> Image {
    let mut image = Image::new(surface.size);
    for (&i, e) in texels.iter().zip(irradiance) {
        image.pixels[i as usize] = surface.albedo[i as usize] * core::f32::consts::FRAC_1_PI * *e;
    }
    image
}
