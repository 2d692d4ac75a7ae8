//! A scene that moves: cells that are made anew are those of a scene that was always so.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use common::{inside, options, square};
use glam::{Quat, Vec3};
use indirect_accel::{Accel, BuildPreset};
use indirect_core::{Material, Scene};
use indirect_technique::cpu::Fit;
use sh_grid_raytracer::{Options, Params, Setup, ShGridRaytracer};

/// A closed room, which keeps the grid where it is, and two squares in it.
fn room() -> Scene {
    let materials = vec![Material::diffuse("grey", Vec3::splat(0.5))];
    let mut scene = Scene { materials, ..Scene::default() };
    inside(&mut scene, Vec3::new(0.0, 1.0, 0.0), Vec3::new(1.5, 1.0, 1.2), 0);
    square(&mut scene, Vec3::new(0.5, 0.7, 0.2), Vec3::X, Vec3::new(0.0, 0.6, 0.8), 0.3, 0);
    square(&mut scene, Vec3::new(-0.6, 0.9, -0.1), Vec3::Z, Vec3::Y, 0.4, 0);
    scene
}

/// The first of the squares somewhere else.
fn moved(step: u32) -> Scene {
    let mut scene = room();
    let centre = Vec3::new(0.5, 0.7, 0.2);
    let turn = Quat::from_rotation_y(0.4 * step as f32);
    let away = Vec3::new(-0.17, 0.05, 0.09) * step as f32;
    scene.mesh.positions[24..28].iter_mut().for_each(|p| *p = centre + away + turn * (*p - centre));
    scene
}

fn fresh(scene: &Scene, options: Options) -> Setup {
    ShGridRaytracer::fit(&Accel::build(scene, BuildPreset::Fast), options, Params::default()).unwrap()
}

fn follow(setup: &mut Setup, scene: &Scene) {
    ShGridRaytracer::refit(setup, &Accel::build(scene, BuildPreset::Fast));
}

fn same(a: &Setup, b: &Setup) -> bool {
    let (a, b) = (&a.fitted, &b.fitted);
    a.voxels == b.voxels && a.pyramid == b.pyramid && a.normals == b.normals && a.positions == b.positions
}

#[test]
fn what_moved_is_as_if_it_had_always_been_there() {
    let steps: Vec<Scene> = (0..5).map(moved).collect();
    for options in [options(), Options { grid: 32, ..options() }, Options { open_points: 0, ..options() }] {
        let first = fresh(&steps[0], options);
        let mut setup = first.clone();
        for (i, scene) in steps.iter().enumerate().skip(1) {
            let before = setup.clone();
            let expected = fresh(scene, options);
            // The fault of not following is one that is seen.
            assert!(!same(&before, &expected), "step {i}");
            follow(&mut setup, scene);
            assert!(same(&setup, &expected), "step {i}");
        }
        // Straight back.
        follow(&mut setup, &steps[0]);
        assert!(same(&setup, &first));
    }
}

#[test]
fn what_does_not_move_stays() {
    let scene = room();
    let first = fresh(&scene, options());
    let mut setup = first.clone();
    follow(&mut setup, &scene);
    assert!(setup == first);
}

/// A square that leaves the room is left out where the grid ends, and comes back whole.
#[test]
fn what_leaves_the_grid_is_left_out_until_it_returns() {
    let first = fresh(&room(), options());
    let mut setup = first.clone();
    let mut out = room();
    out.mesh.positions[24..28].iter_mut().for_each(|p| p.x += 100.0);
    follow(&mut setup, &out);
    assert_eq!(setup.fitted.voxels.grid, first.fitted.voxels.grid);
    let area = |s: &Setup| s.fitted.voxels.areas.iter().flatten().sum::<f32>();
    assert!(area(&setup) < area(&first));
    follow(&mut setup, &room());
    assert!(same(&setup, &first));
}
