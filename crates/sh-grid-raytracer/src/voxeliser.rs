//! Makes the grids of a scene, and follows what moves in it (§3.1).

use glam::{UVec3, Vec2, Vec3};
use indirect_accel::Accel;
use indirect_core::{Mesh, math, octahedral};
use indirect_sampling::mapping::hemisphere_cosine;
use indirect_sampling::rng::{hash_combine, unit_f32};
use rayon::prelude::*;

use crate::cpu::gets_away;
use crate::grid::{FINE, Grid, NONE};
use crate::layout::Voxel;
use crate::overlap::{Part, TriangleBox};
use crate::voxels::{Voxels, face_shares};

/// How it is asked how much of a surface's light gets out of the gaps that it lies in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Openness {
    /// Points on the surfaces of a face's area; 0: all light gets away.
    pub points: u32,
    /// How far light must get, in cells.
    pub reach: f32,
}

/// The cells of a scene and the triangles in each, so that only those are made anew in which something moved.
#[derive(Debug, Clone, PartialEq)]
pub struct Voxeliser {
    grid: Grid,
    openness: Openness,
    /// Numbers of cells with the triangles that pass through them, ordered by both.
    touched: Vec<(u32, u32)>,
    /// Cells in the order of their numbers.
    cells: Vec<Cell>,
}

impl Voxeliser {
    /// Voxelises all triangles. The same scene gives the same cells on any number of threads.
    #[must_use]
    pub fn new(accel: &Accel<'_>, grid: Grid, openness: Openness) -> Self {
        let mesh = &accel.scene().mesh;
        let all: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        let mut new = Self { grid, openness, touched: touched(mesh, &grid, &all), cells: Vec::new() };
        new.cells = new.made(accel, |_| true);
        new
    }

    /// Follows triangles of the numbers `moved`, in order, that lie elsewhere now. What does not fit into the grid is left out.
    pub fn update(&mut self, accel: &Accel<'_>, moved: &[u32]) {
        let is_moved = |t: u32| moved.binary_search(&t).is_ok();
        let mut dirty = vec![false; self.grid.len()];
        // What moves in a cell decides what gets away from those around it.
        let radius = self.openness.reach.ceil().max(1.0) as u32;
        let mut mark = |pairs: &[(u32, u32)]| {
            let of_moved = pairs.iter().filter(|(_, t)| is_moved(*t));
            of_moved.for_each(|(cell, _)| mark_around(&self.grid, *cell, radius, &mut dirty));
        };
        mark(&self.touched);
        self.touched.retain(|(_, t)| !is_moved(*t));
        let new = touched(&accel.scene().mesh, &self.grid, moved);
        mark(&new);
        self.touched.extend(new);
        self.touched.par_sort_unstable();
        let made = self.made(accel, |cell| dirty[cell as usize]);
        self.cells.retain(|c| !dirty[c.number as usize]);
        self.cells.extend(made);
        self.cells.sort_unstable_by_key(|c| c.number);
    }

    /// Makes the cells that `which` accepts.
    fn made(&self, accel: &Accel<'_>, which: impl Fn(u32) -> bool) -> Vec<Cell> {
        let t = &self.touched;
        let starts: Vec<usize> = (0..t.len()).filter(|&i| i == 0 || t[i - 1].0 != t[i].0).collect();
        let ends = starts.iter().skip(1).copied().chain([t.len()]);
        let ranges: Vec<_> = starts.iter().copied().zip(ends).filter(|(a, _)| which(t[*a].0)).collect();
        let of = |&(a, b): &(usize, usize)| Cell::of(accel, &self.grid, self.openness, &t[a..b]);
        let made: Vec<Cell> = ranges.par_iter().map(of).collect();
        made.into_iter().filter(|c| !c.normals.is_empty()).collect()
    }

    /// The grids.
    #[must_use]
    pub fn voxels(&self) -> Voxels {
        let mut v = Voxels { grid: self.grid, index: vec![NONE; self.grid.len()], ..Voxels::default() };
        for cell in &self.cells {
            v.index[cell.number as usize] = v.cells.len() as u32;
            v.cells.push(cell.number);
            v.voxels.push(Voxel { first_normal: v.normals.len() as u32, ..cell.voxel });
            v.normals.extend(&cell.normals);
            v.areas.push(cell.areas);
        }
        v.boundary = v.cells.len() as u32;
        let mut active = vec![false; v.index.len()];
        self.cells.iter().for_each(|c| mark_around(&self.grid, c.number, 1, &mut active));
        for (number, _) in (0..).zip(active).filter(|(_, active)| *active) {
            let place = &mut v.index[number as usize];
            if *place == NONE {
                *place = v.cells.len() as u32;
                v.cells.push(number);
            }
        }
        v
    }
}

/// Marks a cell and those no more than `radius` cells away along any axis.
fn mark_around(grid: &Grid, number: u32, radius: u32, marks: &mut [bool]) {
    let c = grid.cell_of(number);
    let (low, high) = (c.saturating_sub(UVec3::splat(radius)), (c + radius).min(grid.size - 1));
    for z in low.z..=high.z {
        for y in low.y..=high.y {
            for x in low.x..=high.x {
                marks[grid.number(UVec3::new(x, y, z)) as usize] = true;
            }
        }
    }
}

/// Triangles per task.
const CHUNK: usize = 256;

/// Numbers of the cells that triangles pass through, with the triangles; ordered by both.
fn touched(mesh: &Mesh, grid: &Grid, triangles: &[u32]) -> Vec<(u32, u32)> {
    let of_chunk = |chunk: &[u32]| {
        let mut found = Vec::new();
        for &triangle in chunk {
            if let Some(t) = TriangleBox::new(mesh.corners(triangle), grid) {
                t.for_cells(grid.size, |cell| found.push((grid.number(cell), triangle)));
            }
        }
        found
    };
    let mut all = triangles.par_chunks(CHUNK).map(of_chunk).collect::<Vec<_>>().concat();
    all.par_sort_unstable();
    all
}

/// A cell and what lies in it.
#[derive(Debug, Clone, PartialEq)]
struct Cell {
    number: u32,
    voxel: Voxel,
    normals: Vec<u32>,
    areas: [f32; 6],
}

impl Cell {
    /// The cell of all `touched`.
    fn of(accel: &Accel<'_>, grid: &Grid, openness: Openness, touched: &[(u32, u32)]) -> Self {
        let number = touched[0].0;
        let at = grid.cell_of(number);
        let mut sums = [Vec3::ZERO; (FINE * FINE * FINE) as usize];
        let mut voxel = Voxel::default();
        let mut parts = Vec::with_capacity(touched.len());
        let mut areas = [0.0; 6];
        for &(_, triangle) in touched {
            let Some(t) = TriangleBox::new(accel.scene().mesh.corners(triangle), grid) else { continue };
            let normal = t.normal();
            t.for_fine_cells(at, |bit| {
                voxel.set(bit);
                let sum = &mut sums[bit as usize];
                *sum += if sum.dot(normal) < 0.0 { -normal } else { normal };
            });
            let part = Part::of(t.corners(), at);
            let area = part.area() * grid.cell * grid.cell;
            let both = face_shares(normal).into_iter().zip(face_shares(-normal));
            areas.iter_mut().zip(both).for_each(|(sum, (front, back))| *sum += area * (front + back));
            parts.push((part, normal));
        }
        let mut open = Open::new(number, openness, parts.iter().map(|(part, _)| part.area()).sum());
        parts.iter().for_each(|(part, normal)| open.ask(accel, grid, at, part, *normal));
        areas.iter_mut().zip(open.shares()).for_each(|(a, share)| *a *= share);
        let set = (0..FINE * FINE * FINE).filter(|&bit| voxel.has(bit));
        let normals = set.map(|bit| octahedral::pack(sums[bit as usize])).collect();
        Self { number, voxel, normals, areas }
    }
}

/// Area, in faces, below which a cell is asked at fewer points.
const LEAST_ASKED: f32 = 1e-3;

/// Asks how much of the light of a cell's surfaces gets away from them.
struct Open {
    reach: f32,
    seed: u32,
    /// Points on an area of a face.
    rate: f32,
    /// Points so far, with their fraction.
    points: f32,
    /// Rays, and those that got away, by face.
    asked: [f32; 6],
    away: [f32; 6],
}

impl Open {
    /// For a cell with surfaces of an area, in faces: the points of a face even on less, since what is divided by few of them is too
    /// large in the mean.
    fn new(seed: u32, openness: Openness, area: f32) -> Self {
        let points = unit_f32(hash_combine(seed, 0));
        let rate = openness.points as f32 / area.clamp(LEAST_ASKED, 1.0);
        Self { reach: openness.reach, seed, rate, points, asked: [0.0; 6], away: [0.0; 6] }
    }

    /// One ray from either side of points on a part of a triangle in the cell `at`, evenly spread over the areas of all parts.
    fn ask(&mut self, accel: &Accel<'_>, grid: &Grid, at: UVec3, part: &Part, normal: Vec3) {
        let first = self.points.ceil() as u32;
        self.points += part.area() * self.rate;
        for k in first..self.points.ceil() as u32 {
            let u = |i: u32| unit_f32(hash_combine(hash_combine(self.seed, k), i));
            let p = grid.origin + (part.point(Vec2::new(u(0), u(1))) + at.as_vec3()) * grid.cell;
            for (n, i) in [(normal, 2), (-normal, 4)] {
                let w = hemisphere_cosine(Vec2::new(u(i), u(i + 1)));
                let (t, b) = math::orthonormal_basis(n);
                let direction = t * w.x + b * w.y + n * w.z;
                let away = gets_away(accel, (p, n), direction, self.reach * grid.cell);
                for (f, share) in face_shares(n).into_iter().enumerate() {
                    self.asked[f] += share;
                    self.away[f] += if away { share } else { 0.0 };
                }
            }
        }
    }

    /// By face; 1 where nothing was asked.
    fn shares(&self) -> [f32; 6] {
        let share = |f: usize| if self.asked[f] > 0.0 { self.away[f] / self.asked[f] } else { 1.0 };
        core::array::from_fn(share)
    }
}
