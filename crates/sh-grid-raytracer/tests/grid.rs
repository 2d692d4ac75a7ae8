//! The grids: no hole in the surfaces' cells, no area or flux lost, the same on any number of threads.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use common::{Stage, corner, lamp, lights, options, view};
use glam::{DVec3, UVec3, Vec3};
use indirect_accel::{Accel, BuildPreset};
use indirect_core::{Material, Ray, Scene};
use proptest::prelude::*;
use sh_grid_raytracer::cpu::{first_voxel, levels, radiance, sort};
use sh_grid_raytracer::layout::{StoredPhoton, Voxel};
use sh_grid_raytracer::{FINE, Fitted, Options, Output, Params, Voxels};

/// A corner, two edges and the factor of their length.
type Triangle = ([f32; 3], [f32; 3], [f32; 3], f32);

/// Triangles of all sizes in a cube.
fn soup(triangles: &[Triangle]) -> Scene {
    let materials = vec![Material::diffuse("grey", Vec3::splat(0.5))];
    let mut scene = Scene { materials, ..Scene::default() };
    for &(a, b, c, size) in triangles {
        let a = Vec3::from(a);
        scene.mesh.push_polygon(&[a, a + Vec3::from(b) * size, a + Vec3::from(c) * size], 0);
    }
    scene
}

fn fit(accel: &Accel<'_>, grid: u32) -> Fitted {
    Fitted::new(accel, &Options { grid, open_points: 0, ..options() })
}

/// Number of a fine cell in its cell.
fn bit(fine: UVec3) -> u32 {
    (fine.z * FINE + fine.y) * FINE + fine.x
}

/// Whether the fine cell that holds a point, in units of cells, is one that surfaces pass through.
fn is_marked(voxels: &Voxels, local: Vec3) -> bool {
    voxels.boundary_at(local).is_some_and(|place| {
        let fine = ((local - local.floor()) * FINE as f32).as_uvec3().min(UVec3::splat(FINE - 1));
        voxels.voxels[place as usize].has(bit(fine))
    })
}

/// A fault: of the marked fine cells only those whose centre is within half of their side of a triangle, straight above it.
fn by_centres(voxels: &Voxels, scene: &Scene) -> Voxels {
    let mut thin = voxels.clone();
    let triangles: Vec<_> = (0..scene.mesh.triangles.len() as u32)
        .map(|t| (scene.mesh.corners(t).map(|c| voxels.grid.local(c)), scene.mesh.geometric_normal(t)))
        .collect();
    for (place, voxel) in voxels.voxels.iter().enumerate() {
        let cell = voxels.grid.cell_of(voxels.cells[place]).as_vec3();
        let mut kept = Voxel { first_normal: voxel.first_normal, ..Voxel::default() };
        for b in (0..FINE * FINE * FINE).filter(|b| voxel.has(*b)) {
            let fine = UVec3::new(b % FINE, b / FINE % FINE, b / (FINE * FINE));
            let centre = cell + (fine.as_vec3() + 0.5) / FINE as f32;
            let holds = triangles.iter().any(|([p, q, r], n)| {
                let above = |a: Vec3, b: Vec3| (b - a).cross(centre - a).dot(*n) >= 0.0;
                (centre - *p).dot(*n).abs() <= 0.5 / FINE as f32
                    && above(*p, *q)
                    && above(*q, *r)
                    && above(*r, *p)
            });
            if holds {
                kept.set(b);
            }
        }
        thin.voxels[place] = kept;
    }
    thin
}

/// Rays from within the grid to points of triangles: hits, hits in cells that are not marked, and those before which no voxel is found.
fn holes(accel: &Accel<'_>, voxels: &Voxels, targets: &[(usize, [f32; 2], [f32; 3])]) -> [u32; 3] {
    let (scene, grid) = (accel.scene(), &voxels.grid);
    let mut count = [0; 3];
    for &(triangle, [u, v], from) in targets {
        let [a, b, c] = scene.mesh.corners((triangle % scene.mesh.triangles.len()) as u32);
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let target = a + (b - a) * u + (c - a) * v;
        let origin = grid.origin + Vec3::from(from) * grid.size.as_vec3() * grid.cell;
        let direction = (target - origin).normalize_or(Vec3::X);
        let Some(hit) = accel.closest_hit(&Ray::new(origin, direction)) else { continue };
        // Surfaces beside the origin are not seen by design.
        let t = hit.t / grid.cell;
        if t < 4.0 / FINE as f32 {
            continue;
        }
        count[0] += 1;
        let local = grid.local(origin);
        count[1] += u32::from(!is_marked(voxels, local + direction * t));
        let found = first_voxel(voxels, local, direction, f32::INFINITY);
        // No later than the hit and a fine cell.
        count[2] += u32::from(!found.is_some_and(|f| f.t <= t + 1.0 / FINE as f32));
    }
    count
}

fn triangles() -> impl Strategy<Value = Vec<Triangle>> {
    let point = || [0.0..1.0_f32, 0.0..1.0_f32, 0.0..1.0_f32];
    let edge = || [-1.0..1.0_f32, -1.0..1.0_f32, -1.0..1.0_f32];
    let size = prop_oneof![Just(1.0_f32), Just(0.2), Just(0.02)];
    proptest::collection::vec((point(), edge(), edge(), size), 1..12)
}

fn targets() -> impl Strategy<Value = Vec<(usize, [f32; 2], [f32; 3])>> {
    let from = [0.01..0.99_f32, 0.01..0.99_f32, 0.01..0.99_f32];
    proptest::collection::vec((any::<usize>(), [0.0..1.0_f32, 0.0..1.0_f32], from), 64)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_ray_that_hits_a_triangle_passes_a_voxel(triangles in triangles(), targets in targets(), grid in 1..24_u32) {
        let scene = soup(&triangles);
        let accel = Accel::build(&scene, BuildPreset::Fast);
        let voxels = fit(&accel, grid).voxels;
        let [_, unmarked, missed] = holes(&accel, &voxels, &targets);
        prop_assert_eq!((unmarked, missed), (0, 0));
    }

    #[test]
    fn no_area_is_lost(triangles in triangles(), grid in 1..24_u32) {
        let scene = soup(&triangles);
        let accel = Accel::build(&scene, BuildPreset::Fast);
        let fitted = fit(&accel, grid);
        let area: f64 = (0..scene.mesh.triangles.len() as u32).map(|t| f64::from(scene.mesh.area(t))).sum();
        let mut faces = radiance(&[], &[], &fitted.voxels, false);
        levels(&mut faces, &fitted.pyramid);
        for level in &fitted.pyramid.levels {
            let of = &faces[level.first as usize..][..level.count as usize];
            let sum: f64 = of.iter().flat_map(|f| f.faces).map(|f| f64::from(f.w)).sum();
            // Both sides; clipping rounds to some 1e-6 of a cell.
            prop_assert!((sum / (2.0 * area) - 1.0).abs() < 1e-4, "{} {}", sum, 2.0 * area);
        }
    }
}

#[test]
fn cells_that_are_chosen_by_their_centres_have_holes() {
    let scene = corner(lights()[0], 1.0);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let voxels = fit(&accel, 12).voxels;
    let x = |i: u32, k: u32| common::random(i, k);
    let targets: Vec<_> = (0..4096)
        .map(|i| (i as usize, [x(i, 0), x(i, 1)], [x(i, 2), x(i, 3), x(i, 4)].map(|v| 0.01 + 0.98 * v)))
        .collect();
    let [hits, unmarked, missed] = holes(&accel, &voxels, &targets);
    assert!(hits > 2000 && unmarked == 0 && missed == 0, "{hits} {unmarked} {missed}");
    let [_, unmarked, missed] = holes(&accel, &by_centres(&voxels, &scene), &targets);
    println!("by centres, of {hits} hits {unmarked} lie in no voxel, {missed} rays miss");
    assert!(unmarked > 0, "{unmarked} passed");
}

/// The R-grid holds what was stored, at every level.
#[test]
fn no_flux_is_lost() {
    for scene in [corner(lights()[1], 1.0), lamp(1.0)] {
        let stage = Stage::new(&scene, view(1.0), [1, 1]);
        let setup = stage.setup(options(), Params::default());
        let o = stage.run(&setup);
        let stored: DVec3 = o.stored.iter().map(|p| p.flux.as_dvec3()).sum();
        assert!(stored.min_element() > 0.0);
        let off = |faces: &[sh_grid_raytracer::layout::Faces]| {
            let sum: DVec3 = faces.iter().flat_map(|f| f.faces).map(|f| f.truncate().as_dvec3()).sum();
            ((sum - stored) / stored).abs().max_element()
        };
        for level in &setup.fitted.pyramid.levels {
            let of = &o.faces[level.first as usize..][..level.count as usize];
            // Roundings of sums of some hundreds of photons and of their shares.
            assert!(off(of) < 1e-5, "{}", off(of));
        }
        // A fault: a level without one of its cells.
        let level = setup.fitted.pyramid.levels[1];
        let of = &o.faces[level.first as usize..][..level.count as usize];
        let brightest = |f: &sh_grid_raytracer::layout::Faces| f.faces.iter().map(|f| f.x).sum::<f32>();
        let i = (0..of.len()).max_by(|a, b| brightest(&of[*a]).total_cmp(&brightest(&of[*b]))).unwrap();
        assert!(off(&[&of[..i], &of[i + 1..]].concat()) > 1e-5);
    }
}

#[test]
fn threads_do_not_matter() {
    for (scene, options) in
        [(corner(lights()[0], 1.0), options()), (lamp(1.0), Options { photons: 20_000, ..options() })]
    {
        let on = |threads| -> (Voxels, Output) {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let stage = Stage::new(&scene, view(1.0), [40, 25]);
                let setup = stage.setup(options, Params::default());
                (Voxels::clone(&setup.fitted.voxels), stage.run(&setup))
            })
        };
        let (one, four) = (on(1), on(4));
        assert!(one.0 == four.0, "voxels");
        let (a, b) = (one.1, four.1);
        assert!(a.stored == b.stored && a.order == b.order && a.faces == b.faces && a.field == b.field);
        // Floats that are equal, not only near: none of them is −0 or NaN.
        assert!(a.irradiance == b.irradiance && a == b);
        // What another seed gives is seen to differ.
        let stage = Stage::new(&scene, view(1.0), [40, 25]);
        let other = stage.run(&stage.setup(options, Params { seed: 1, ..Params::default() }));
        assert!(other.stored != a.stored && other.field != a.field);
    }
}

/// Photons of a cell stay in the order of the list.
#[test]
fn sorting_is_stable() {
    let photons: Vec<StoredPhoton> = (0..50_000)
        .map(|i| StoredPhoton {
            cell: (common::random(i, 0) * 300.0) as u32,
            photon: i,
            ..StoredPhoton::default()
        })
        .collect();
    let order = sort(&photons);
    let key = |i: u32| (photons[i as usize].cell, i);
    assert_eq!(order.len(), photons.len());
    assert!(order.windows(2).all(|w| key(w[0]) < key(w[1])));
    // The same cells in the reverse order of the list are refused.
    let mut wrong: Vec<u32> = (0..photons.len() as u32).rev().collect();
    wrong.sort_by_key(|&i| photons[i as usize].cell);
    assert!(!wrong.windows(2).all(|w| key(w[0]) < key(w[1])));
}
