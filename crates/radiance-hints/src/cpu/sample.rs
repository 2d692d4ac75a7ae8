//! `sample`: lists of samples (virtual point lights) that hints share, drawn from the maps.

use glam::{Vec2, Vec3};
use indirect_core::math::luminance;
use indirect_sampling::{
    mapping,
    rng::hash_combine,
    sobol,
    warp::{Empty, Warp},
};
use rayon::prelude::*;
use rsm::{Map, Rsm};

use crate::{layout::Sample, settings::Sampling, setup::Draw, volume::Lattice};

/// [`Draw::samples`] samples for each of [`Draw::lists`] lists, list after list. A slot that found no reflecting texel
/// holds [`Sample::default`], whose flux is 0.
#[must_use]
pub fn sample(rsm: &Rsm, lattice: &Lattice, draw: &Draw) -> Vec<Sample> {
    let Draw { sampling, disc: share, samples, seed } = *draw;
    let slots = draw.lists(lattice.hints()) * samples;
    match sampling {
        Sampling::Importance | Sampling::Nearby => {
            let shares: Vec<f32> = rsm.maps.iter().map(|m| luminance(m.pyramid.top().reflected)).collect();
            (0..slots)
                .into_par_iter()
                .map(|slot| {
                    importance(rsm, &shares, sobol::sample_2d(index_of(slot, samples), seed), samples)
                })
                .collect()
        }
        Sampling::Disc => (0..slots)
            .into_par_iter()
            .map(|slot| disc(rsm, lattice.position(slot / samples), slot, share, samples, seed))
            .collect(),
    }
}

/// The index of a slot's point in the sequence: each list begins at an aligned block of a power of two, so that its points are
/// well distributed also where its length is no power of two.
const fn index_of(slot: u32, count: u32) -> u32 {
    (slot / count) * count.next_power_of_two() + slot % count
}

/// A sample at texel `texel` of map `map` that stands for `scale` texels.
pub(super) fn sample_of_texel(rsm: &Rsm, map: usize, texel: u32, scale: f32) -> Sample {
    let Map { surface, texels, .. } = &rsm.maps[map];
    let (i, t) = (texel as usize, &texels[texel as usize]);
    Sample {
        position: surface.position[i],
        area: t.area * scale,
        normal: surface.normal[i],
        map: map as u32,
        flux: t.reflected * scale,
        texel,
        incident: t.incident * scale,
        pad1: 0.0,
    }
}

/// [`Sampling::Importance`] and the lists of [`Sampling::Nearby`]: a map in proportion to its reflected luminance, then a
/// texel of it (Clarberg et al. 2005).
fn importance(rsm: &Rsm, shares: &[f32], u: Vec2, count: u32) -> Sample {
    let mut total = 0.0;
    for share in shares {
        total += share;
    }
    // The map in whose share of the total u.x falls; rounding at the end falls to the last map that has any.
    let mut chosen = usize::MAX;
    let mut fraction = 0.0;
    let mut x = u.x * total;
    for (i, &share) in shares.iter().enumerate() {
        if share > 0.0 {
            chosen = i;
            fraction = x / share;
            if x < share {
                break;
            }
            x -= share;
        }
    }
    let Some(map) = rsm.maps.get(chosen) else { return Sample::default() };
    let nodes = &map.pyramid.nodes;
    let warp = Warp::new(map.surface.size, |i| luminance(nodes[i].reflected), Empty::Error);
    let Ok(warp) = warp else { return Sample::default() };
    let drawn = warp.sample(Vec2::new(fraction, u.y));
    let texel = drawn.texel[1] * map.surface.size[0] + drawn.texel[0];
    let p = shares[chosen] / total * drawn.pdf;
    sample_of_texel(rsm, chosen, texel, 1.0 / (p * count as f32))
}

/// [`Sampling::Disc`]: a texel of the disc around the hint's projection into a map; slot `k` draws from map `k mod maps`.
fn disc(rsm: &Rsm, hint: Vec3, slot: u32, fraction: f32, count: u32, seed: u32) -> Sample {
    let maps = rsm.maps.len() as u32;
    if maps == 0 {
        return Sample::default();
    }
    let (list, k) = (slot / count, slot % count);
    let map = k % maps;
    // Samples of this list that are drawn from this map.
    let share = (count - map).div_ceil(maps);
    let n = rsm.resolution as f32;
    let Some(centre) = rsm.maps[map as usize].view.image_point(hint) else { return Sample::default() };
    let radius = (fraction * core::f32::consts::FRAC_1_PI).sqrt();
    let u = sobol::sample_2d(k / maps, hash_combine(seed, list));
    let at = (centre + mapping::disc_concentric(u) * radius) * n;
    if !(at.x >= 0.0 && at.y >= 0.0 && at.x < n && at.y < n) {
        return Sample::default();
    }
    let texel = at.y as u32 * rsm.resolution + at.x as u32;
    if luminance(rsm.maps[map as usize].texels[texel as usize].reflected) <= 0.0 {
        return Sample::default();
    }
    sample_of_texel(rsm, map as usize, texel, fraction * n * n / share as f32)
}
