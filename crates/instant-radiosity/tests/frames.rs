//! What is kept from frame to frame.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use common::{Stage, corner, lights, most, options, square, still, view};
use glam::Vec3;
use indirect_core::{Material, Scene, View};
use indirect_technique::cpu::Fit;
use instant_radiosity::{InstantRadiosity, Options, Output, Params, Switch};

const SIZE: [u32; 2] = [64, 40];

fn sum(o: &Output) -> f64 {
    o.image.pixels.iter().map(|p| f64::from(p.x + p.y + p.z)).sum()
}

fn rms(a: &Output, b: &Output) -> f64 {
    let square = |(a, b): (&Vec3, &Vec3)| f64::from((*a - *b).length_squared());
    let all: f64 = a.image.pixels.iter().zip(&b.image.pixels).map(square).sum();
    let unit: f64 = b.image.pixels.iter().map(|p| f64::from(p.length_squared())).sum();
    (all / unit).sqrt()
}

/// Many lights, all asked, no interleaving: what fewer converge to.
fn converged(stage: &Stage<'_>) -> Output {
    let options = Options { vpls: 4096, shadow_rays: 16, compensate: Switch::Off, ..still(options()) };
    stage.run(&stage.setup(options, Params { seed: 77, ..Params::default() }), 1, Output::default())
}

#[test]
fn thirty_two_frames_are_as_good_as_four_times_the_lights() {
    let scene = corner(lights()[0], 1.0);
    let stage = Stage::new(&scene, view(1.0), SIZE);
    let truth = converged(&stage);
    let error = |vpls: u32, history: Switch, frames: u32| -> f64 {
        let options = Options { vpls, history, compensate: Switch::Off, ..options() };
        let of = |seed| {
            let setup = stage.setup(options, Params { seed, ..Params::default() });
            rms(&stage.run(&setup, frames, Output::default()), &truth)
        };
        (0..4).map(of).sum::<f64>() / 4.0
    };
    let (reused, one, four) =
        (error(64, Switch::On, 32), error(64, Switch::Off, 1), error(256, Switch::Off, 1));
    println!("64 lights: {one:.4} alone, {reused:.4} with history; 256 lights: {four:.4}");
    assert!(reused < four && four < one, "{reused} {four} {one}");
}

#[test]
fn without_history_a_still_scene_does_not_change() {
    let scene = corner(lights()[1], 1.0);
    let stage = Stage::new(&scene, view(1.0), SIZE);
    let setup = stage.setup(still(options()), Params::default());
    let first = stage.run(&setup, 1, Output::default());
    assert_eq!(stage.run(&setup, 2, first.clone()).image, first.image);
}

#[test]
fn what_is_not_finite_is_gone_in_the_next_frame() {
    let scene = corner(lights()[0], 1.0);
    let stage = Stage::new(&scene, view(1.0), SIZE);
    let setup = stage.setup(options(), Params::default());
    let mut past = stage.run(&setup, 4, Output::default());
    let h = past.history.as_mut().unwrap();
    for (k, poison) in [f32::NAN, f32::INFINITY, -f32::INFINITY].into_iter().enumerate() {
        for i in (k * 100)..(k * 100 + 50) {
            h.irradiance[i] = glam::Vec4::splat(poison);
            h.irradiance[i + 1200].x = poison;
        }
    }
    let next = stage.run(&setup, 1, past);
    assert!(next.image.pixels.iter().all(|p| p.is_finite()));
    assert!(next.history.unwrap().irradiance.iter().all(|p| p.is_finite()));
}

#[test]
fn a_light_that_goes_off_leaves_nothing() {
    let scene = corner(lights()[0], 1.0);
    let stage = Stage::new(&scene, view(1.0), SIZE);
    let setup = stage.setup(options(), Params::default());
    let past = stage.run(&setup, 16, Output::default());
    let before = sum(&past);
    let mut dark = scene.clone();
    dark.lights[0].power = Vec3::ZERO;
    let stage = Stage::new(&dark, view(1.0), SIZE);
    let left = sum(&stage.run(&setup, 3, past.clone())) / before;
    println!("{:.4} left after 3 frames", left);
    assert!(left < 0.5, "{left}");
    // The control: a past that is never doubted fades as slowly as its confidence says, 0.9³.
    let setup = stage.setup(options(), Params { changed: 0.0, outliers: 0.0, ..Params::default() });
    let left = sum(&stage.run(&setup, 3, past)) / before;
    assert!(left > 0.7, "{left}");
}

#[test]
fn a_step_of_the_light_is_followed_within_eight_frames() {
    let scene = corner(lights()[0], 1.0);
    let stage = Stage::new(&scene, view(1.0), SIZE);
    let setup = stage.setup(options(), Params::default());
    let past = stage.run(&setup, 32, Output::default());
    let before = sum(&past);
    let mut brighter = scene.clone();
    brighter.lights[0].power *= 2.0;
    let stage = Stage::new(&brighter, view(1.0), SIZE);
    let after = sum(&stage.run(&setup, 8, past));
    println!("{:.3} of the step after 8 frames", after / before - 1.0);
    assert!(after > 1.9 * before, "{}", after / before);
}

#[test]
fn a_camera_cut_and_another_size_start_anew() {
    let scene = corner(lights()[0], 1.0);
    let stage = Stage::new(&scene, view(1.0), SIZE);
    let setup = stage.setup(options(), Params::default());
    let past = stage.run(&setup, 8, Output::default());
    // The back of the wall: nothing of the old image is there.
    let behind = View {
        origin: Vec3::new(0.3, 2.0, -3.0),
        forward: Vec3::Z,
        right: -Vec3::X,
        up: Vec3::Y,
        ..view(1.0)
    };
    let turned = Stage::new(&scene, behind, SIZE);
    let cut = turned.run(&setup, 1, past.clone());
    let fresh = turned.run(&setup, 1, Output { frame: past.frame, ..Output::default() });
    assert_eq!(cut.image, fresh.image);
    // The same view at another resolution keeps its past.
    let larger = Stage::new(&scene, view(1.0), [96, 60]);
    let resized = larger.run(&setup, 1, past);
    assert!(resized.image.pixels.iter().all(|p| p.is_finite()));
    let h = resized.history.unwrap();
    let kept = h.normals.iter().filter(|n| n.w > 1.0).count();
    let seen = (0..larger.camera.len()).filter(|i| larger.camera.is_surface(*i)).count();
    // But for silhouettes, and the floor far away, where a pixel spans more depth than the tolerance.
    assert!(kept * 10 > seen * 8, "{kept} of {seen}");
}

/// A board moves sideways before a wall. What it uncovers has no past, by an exact mask: the pixel's place in the frame before was covered.
#[test]
fn what_is_uncovered_has_no_past() {
    let mut scene =
        Scene { materials: vec![Material::diffuse("grey", Vec3::splat(0.6))], ..Scene::default() };
    square(&mut scene, Vec3::new(0.0, 2.0, -2.0), Vec3::X, Vec3::Y, 3.0, 0);
    square(&mut scene, Vec3::ZERO, Vec3::X, -Vec3::Z, 3.0, 0);
    square(&mut scene, Vec3::new(0.0, 1.5, 0.0), Vec3::X, Vec3::Y, 0.6, 0);
    scene.lights.push(common::light(lights()[0]));
    let mut moved = scene.clone();
    moved.mesh.positions.iter_mut().rev().take(4).for_each(|p| p.x += 0.3);
    let (a, b) = (Stage::new(&scene, view(1.0), SIZE), Stage::new(&moved, view(1.0), SIZE));
    for motion in [Switch::Off, Switch::On] {
        let mut setup = a.setup(Options { motion, ..options() }, Params::default());
        let past = a.run(&setup, 8, Output::default());
        InstantRadiosity::refit(&mut setup, &b.accel);
        let next = b.run(&setup, 1, past);
        let h = next.history.unwrap();
        let (mut uncovered, mut followed, mut board) = (0, 0, 0);
        for i in 0..b.camera.len() {
            if !b.camera.is_surface(i) {
                continue;
            }
            if b.camera.triangle[i] >= 4 {
                board += 1;
                followed += usize::from(h.normals[i].w > 1.0);
            } else if a.camera.triangle[i] >= 4 {
                uncovered += 1;
                // The camera stands still: rounding gives a neighbour that was seen a millionth of a weight.
                assert!(h.normals[i].w < 1.001, "{motion:?}: pixel {i} has a past that it was not seen in");
            }
        }
        println!("{motion:?}: {uncovered} uncovered, {followed} of {board} followed");
        assert!(uncovered > 20 && board > 100);
        // Followed, the board keeps its past but for what enters at its leading edge.
        assert!(motion == Switch::Off || followed * 20 > board * 19, "{followed} of {board}");
    }
}

#[test]
fn a_still_frame_repeats_its_places() {
    let scene = corner(lights()[0], 1.0);
    let stage = Stage::new(&scene, view(1.0), SIZE);
    let mut setup = stage.setup(Options { motion: Switch::On, ..options() }, Params::default());
    InstantRadiosity::refit(&mut setup, &stage.accel);
    assert!(!setup.fitted.moved());
    let o = stage.run(&setup, 1, Output::default());
    assert!(o.before.is_empty());
    assert!(most(&o.image.pixels) > 0.0);
}
