//! `gather` by cuts: each tile of 4×2 pixels takes its own cut through a tree over all virtual lights of all bounces (Walter et al. 2005,
//! "Lightcuts"; a cut for a tile of receivers: Nichols, Shopf & Wyman 2009, §3.5.1).
//!
//! ```text
//! E_i = Σ_b Φ_b V_ib k/(1 + A k),   b in the cut of the tile of pixel i
//! ```
//!
//! Where paths carry what the bound removes, `A` is that of all lights ([`Summary::area`](crate::layout::Summary)); else a branch's own, the
//! sum of those beneath. Shadow tests go to branches in proportion to what they would give, and within a branch to one of its lights in
//! proportion to its flux, drawn anew for each pixel: right in the mean, and the pixels of a block do not share an error (after Yuksel 2019,
//! "Stochastic Lightcuts").

use glam::{Vec3, Vec4};
use indirect_core::{GBuffer, math::luminance};
use indirect_sampling::rng::{hash_combine, unit_f32};
use rayon::prelude::*;
use rsm::cpu::LightTree;
use rsm::{Branch, TILE, Vpl};

use super::gather::{Choices, Lights, Parts, pixel_number, unshadowed_factor};
use super::shadow::Shadow;
use crate::layout::Summary;

/// Pixels of a tile, across and down.
pub const TILE_SIZE: [u32; 2] = [4, 2];

/// Branches of the tree that a tile visits before it takes the rest of them as they come: software renderers end a shader's loops after
/// 65 535 rounds, and a walk that is cut short would lose light.
pub const MOST_VISITED: u32 = 16_384;

/// Levels that a draw descends before it takes the representative of what it has reached: where the tree no longer fits a cache, each
/// level costs as much as a shadow ray, and sixteen choices are enough to tell neighbours apart.
const DESCENT: u32 = 4;

/// Distinguishes the numbers that draw lights beneath branches.
const DRAWS: u32 = 0x201;

/// The virtual lights of all bounces with the flux that receivers see: that of the last bounce stands for all that would follow.
#[must_use]
pub fn tailed(vpls: &[Vpl], parts: &Parts, summary: &Summary) -> Vec<Vpl> {
    let count = (parts.per_bounce * parts.bounces) as usize;
    let last = (parts.per_bounce * (parts.bounces - 1)) as usize;
    let flux = |i, flux| if i >= last { flux * summary.tail } else { flux };
    vpls.iter().take(count).enumerate().map(|(i, v)| Vpl { flux: flux(i, v.flux), ..*v }).collect()
}

/// Irradiance per pixel, W/m², of the tile's cut through `tree`, and a number that differs where another light was asked or another
/// answer given. The tree is one over [`tailed`] lights, its reach solved. `tests` shadow tests for each pixel; 0: the representative of
/// each branch of the cut is tested.
#[must_use]
pub fn gather_cuts<S: Shadow>(
    lights: &Lights<'_, S>,
    tree: &LightTree,
    camera: &GBuffer,
    tests: u32,
    seed: u32,
) -> Vec<Vec4> {
    let width = camera.size[0];
    let mut gathered = vec![Vec4::ZERO; camera.len()];
    let rows = gathered.par_chunks_mut(((width * TILE_SIZE[1]) as usize).max(1)).enumerate();
    rows.for_each_init(Cut::default, |cut, (row, out)| {
        let first = row as u32 * TILE_SIZE[1] * width;
        for left in (0..width).step_by(TILE_SIZE[0] as usize) {
            let Some(tile) = PixelTile::new(camera, first + left) else { continue };
            cut.find(lights, tree, &tile);
            for lane in (0..TILE).filter(|&lane| tile.pixels[lane].is_some()) {
                let pixel = tile.pixels[lane].unwrap_or_default();
                out[(pixel - first) as usize] = cut.light(lights, tree, &tile, (lane, pixel), (tests, seed));
            }
        }
    });
    gathered
}

/// The pixels of a tile that see a surface.
struct PixelTile {
    pixels: [Option<u32>; TILE],
    position: [Vec3; TILE],
    normal: [Vec3; TILE],
    low: Vec3,
    high: Vec3,
}

impl PixelTile {
    /// The tile whose first pixel is `first`; `None` where no pixel of it sees a surface.
    fn new(camera: &GBuffer, first: u32) -> Option<Self> {
        let [width, height] = camera.size;
        let (x0, y0) = (first % width, first / width);
        let mut tile = Self {
            pixels: [None; TILE],
            position: [Vec3::ZERO; TILE],
            normal: [Vec3::ZERO; TILE],
            low: Vec3::MAX,
            high: Vec3::MIN,
        };
        for lane in 0..TILE {
            let (x, y) = (x0 + lane as u32 % TILE_SIZE[0], y0 + lane as u32 / TILE_SIZE[0]);
            if x >= width || y >= height {
                continue;
            }
            let pixel = y * width + x;
            if camera.is_surface(pixel as usize) {
                tile.pixels[lane] = Some(pixel);
                let p = camera.position[pixel as usize];
                tile.position[lane] = p;
                tile.normal[lane] = camera.normal[pixel as usize];
                (tile.low, tile.high) = (tile.low.min(p), tile.high.max(p));
            }
        }
        tile.pixels.iter().any(Option::is_some).then_some(tile)
    }

    /// Squared distance of the pixels' bounding box.
    #[inline]
    fn distance2(&self, p: Vec3) -> f32 {
        let v = p.max(self.low).min(self.high) - p;
        v.dot(v)
    }
}

/// The cut of a tile: branches, and for each the luminance of its flux and what part of it arrives at each pixel, 1/m².
#[derive(Default)]
struct Cut {
    branches: Vec<u32>,
    luminance: Vec<f32>,
    factors: Vec<[f32; TILE]>,
}

impl Cut {
    fn find<S: Shadow>(&mut self, lights: &Lights<'_, S>, tree: &LightTree, tile: &PixelTile) {
        self.branches.clear();
        self.luminance.clear();
        self.factors.clear();
        let (mut i, mut visited) = (0, 0);
        while let Some(branch) = tree.branches.get(i as usize) {
            visited += 1;
            let near = branch.reach > 0.0 && tile.distance2(branch.position) < branch.reach * branch.reach;
            if near && visited < MOST_VISITED {
                i = branch.child;
                continue;
            }
            if branch.weight() > 0.0 {
                let vpl = branch.vpl();
                let area = if lights.compensated { lights.summary.area } else { branch.area };
                let mut factor = [0.0; TILE];
                for (lane, f) in factor.iter_mut().enumerate() {
                    *f = unshadowed_factor(&vpl, area, tile.position[lane], tile.normal[lane]);
                }
                self.branches.push(i);
                self.luminance.push(luminance(branch.flux));
                self.factors.push(factor);
            }
            i = branch.next;
        }
    }

    fn light<S: Shadow>(
        &self,
        lights: &Lights<'_, S>,
        tree: &LightTree,
        tile: &PixelTile,
        (lane, pixel): (usize, u32),
        (tests, seed): (u32, u32),
    ) -> Vec4 {
        let (p, n) = (tile.position[lane], tile.normal[lane]);
        let (mut sum, mut choices) = (Vec3::ZERO, Choices::default());
        // Neighbours by which a cut differs are a choice as well.
        choices.note(self.branches.len() as u32);
        if tests == 0 {
            for (&i, factor) in self.branches.iter().zip(&self.factors) {
                let branch = &tree.branches[i as usize];
                let factor = factor[lane];
                if factor > 0.0 && lights.asks(branch.representative, p, n, &mut choices) {
                    sum += branch.flux * factor;
                }
            }
            return sum.extend(choices.number());
        }
        let weights = || self.luminance.iter().zip(&self.factors).map(|(l, f)| l * f[lane]);
        let mut total = 0.0;
        weights().for_each(|weight| total += weight);
        if total <= 0.0 {
            return sum.extend(choices.number());
        }
        // Evenly spaced places on the running sum, as for the lights of a part.
        let step = total / tests as f32;
        let (mut next, mut running) = (pixel_number(pixel, seed, 0) * step, 0.0);
        let key = hash_combine(hash_combine(pixel, seed), DRAWS);
        for (k, weight) in weights().enumerate() {
            running += weight;
            if weight > 0.0 && running > next {
                let times = ((running - next) / step).ceil();
                next += times * step;
                let i = self.branches[k];
                let light = draw(&tree.branches, tree.layout.inner(), i, key);
                if lights.asks(light, p, n, &mut choices) {
                    sum += tree.branches[i as usize].flux * (times * step / self.luminance[k]);
                }
            }
        }
        sum.extend(choices.number())
    }
}

/// One of the lights beneath a branch, in proportion to its flux: of all in the mean over trees and keys, of up to [`DESCENT`] levels over
/// keys alone. The `inner` first branches have children.
#[inline]
fn draw(branches: &[Branch], inner: u32, mut i: u32, key: u32) -> u32 {
    for _ in 0..DESCENT {
        if i >= inner {
            break;
        }
        let own = &branches[i as usize];
        let first = &branches[own.child as usize];
        let mut chosen = own.child;
        // A branch whose first child is its last has one.
        if first.next != own.next {
            let second = &branches[first.next as usize];
            let (a, b) = (first.weight(), second.weight());
            if unit_f32(hash_combine(key, i)) * (a + b) >= a {
                chosen = first.next;
            }
        }
        i = chosen;
    }
    branches[i as usize].representative
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    #[cfg(feature = "gpu")]
    #[test]
    fn constants_and_structs_are_those_of_the_shaders() {
        use crate::layout::FrameSettings;
        use indirect_gpu::shaders::{
            INSTANT_RADIOSITY_CUTS, INSTANT_RADIOSITY_CUTS_MAPS, INSTANT_RADIOSITY_CUTS_OPEN,
            INSTANT_RADIOSITY_TAILED,
        };
        use testkit::layout::{check, check_constant};
        for module in [&INSTANT_RADIOSITY_CUTS, &INSTANT_RADIOSITY_CUTS_MAPS, &INSTANT_RADIOSITY_CUTS_OPEN] {
            check_constant(module, "TILE_WIDTH", TILE_SIZE[0]).unwrap();
            check_constant(module, "TILE_HEIGHT", TILE_SIZE[1]).unwrap();
            check_constant(module, "MOST_VISITED", MOST_VISITED).unwrap();
            check_constant(module, "DESCENT", DESCENT).unwrap();
            check_constant(module, "DRAWS", DRAWS).unwrap();
            check::<Branch>(module).unwrap();
            check::<Vpl>(module).unwrap();
            check::<Summary>(module).unwrap();
            check::<FrameSettings>(module).unwrap();
        }
        check::<FrameSettings>(&INSTANT_RADIOSITY_TAILED).unwrap();
    }

    #[test]
    fn lights_are_drawn_in_proportion_to_their_flux() {
        for count in [1_u32, 2, 3, 7, 12, 16] {
            let vpls: Vec<Vpl> = (0..count)
                .map(|i| Vpl::new(Vec3::X * i as f32, Vec3::Y, Vec3::splat((i * i % 5) as f32), 0.01))
                .collect();
            let tree = LightTree::new(&vpls, 3);
            let total: f32 = vpls.iter().map(|v| v.flux.x).sum();
            if total <= 0.0 {
                continue;
            }
            let mut found = vec![0_u32; count as usize];
            let n = 20_000;
            for key in 0..n {
                found[draw(&tree.branches, tree.layout.inner(), 0, key) as usize] += 1;
            }
            let off = |share: &dyn Fn(&Vpl) -> f32| {
                vpls.iter()
                    .zip(&found)
                    .map(|(v, &f)| (f as f32 / n as f32 - share(v)).abs())
                    .fold(0.0, f32::max)
            };
            // Five standard deviations of a share of one half: 5/(2 √20 000).
            assert!(off(&|v| v.flux.x / total) < 0.018, "{count}: {found:?}");
            // A fault: all alike.
            assert!(count < 3 || off(&|_| 1.0 / count as f32) > 0.018, "{count} passed");
        }
    }
}
