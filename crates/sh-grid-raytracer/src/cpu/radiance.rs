//! `sort`, `radiance`, `levels`: the flux that the surfaces of each cell reflect (§3.3).

use glam::{Vec3, Vec4};
use indirect_core::sort::radix_sort_pairs;
use rayon::prelude::*;

use crate::layout::{Faces, StoredPhoton};
use crate::pyramid::Pyramid;
use crate::voxels::{Voxels, face_shares};

/// Photons of a sorted list that one thread sums: however many lie in one cell, none sums more.
pub const RUN: u32 = 128;

/// The photons in the order of their cells; those of a cell in the order of the list. The array \[B\] of the paper's figure 3.
#[must_use]
pub fn sort(photons: &[StoredPhoton]) -> Vec<u32> {
    let mut cells: Vec<u32> = photons.iter().map(|p| p.cell).collect();
    let mut order: Vec<u32> = (0..photons.len() as u32).collect();
    radix_sort_pairs(&mut cells, &mut order, u32::BITS);
    order
}

/// Where runs of the sorted list begin: at every [`RUN`]th photon, and where the cell changes. \[C\] to \[E\] of figure 3.
#[must_use]
pub fn runs(photons: &[StoredPhoton], order: &[u32]) -> Vec<u32> {
    let cell = |i: u32| photons[order[i as usize] as usize].cell;
    (0..order.len() as u32).filter(|&i| i % RUN == 0 || cell(i) != cell(i - 1)).collect()
}

/// The flux through the faces of each boundary cell and the area that sent it. The same photons give the same bits on any number of
/// threads: sums run in the order of the list, run by run, then cell by cell.
#[must_use]
pub fn radiance(photons: &[StoredPhoton], order: &[u32], voxels: &Voxels, printed: bool) -> Vec<Faces> {
    let begins = runs(photons, order);
    let run = |k: usize| {
        let end = begins.get(k + 1).map_or(order.len(), |e| *e as usize);
        let mut sums = [Vec3::ZERO; 6];
        for &i in &order[begins[k] as usize..end] {
            let photon = &photons[i as usize];
            sums.iter_mut().zip(face_shares(photon.axis)).for_each(|(s, w)| *s += photon.flux * w);
        }
        sums
    };
    let sums: Vec<[Vec3; 6]> = (0..begins.len()).into_par_iter().with_min_len(16).map(run).collect();
    let face = voxels.grid.cell * voxels.grid.cell;
    let empty = |areas: &[f32; 6]| Faces {
        faces: areas.map(|a| Vec4::new(0.0, 0.0, 0.0, if printed { face } else { a })),
    };
    let mut all: Vec<Faces> = voxels.areas.iter().map(empty).collect();
    for (begin, sums) in begins.iter().zip(sums) {
        let cell = photons[order[*begin as usize] as usize].cell;
        all[cell as usize].faces.iter_mut().zip(sums).for_each(|(f, s)| *f += s.extend(0.0));
    }
    all
}

/// Adds the coarser levels, each the sum of the one before.
pub fn levels(faces: &mut Vec<Faces>, pyramid: &Pyramid) {
    faces.truncate(pyramid.levels.first().map_or(0, |l| l.count as usize));
    let base = faces.len();
    for level in pyramid.levels.iter().skip(1) {
        let sum = |i: u32| {
            let mut sum = Faces::default();
            for child in &pyramid.children[i as usize - base] {
                if let Some(c) = faces.get(*child as usize) {
                    sum.faces.iter_mut().zip(c.faces).for_each(|(s, f)| *s += f);
                }
            }
            sum
        };
        let next: Vec<Faces> = (level.first..level.first + level.count).map(sum).collect();
        faces.extend(next);
    }
}
