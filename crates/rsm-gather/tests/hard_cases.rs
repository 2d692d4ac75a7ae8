//! Degenerate input: finite, bounded, and the same at any scale.
#![cfg(feature = "cpu")]
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

#[path = "../../rsm/tests/common/mod.rs"]
mod common;

use common::{floor_and_wall, light, lights, push_box, push_square, scaled, scene, spot};
use glam::{Mat3, Vec2, Vec3};
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::settings::Settings;
use indirect_core::{LightKind, Projection, Scene, View};
use rsm::{Select, Selection, views::views};
use rsm_gather::{Form, Options, Output, Params, Setup, cpu};

/// Options of a selection.
fn options(resolution: u32, selection: Selection) -> Options {
    let o = Options { resolution, ..Options::default() };
    match selection {
        Selection::All => Options { select: Select::All, ..o },
        Selection::Grid { cells } => Options { select: Select::Grid, cells, ..o },
        Selection::Importance { count } => Options { vpls: count, ..o },
    }
}

fn render(scene: &Scene, scale: f32, options: Options, form: Form) -> Output {
    let accel = Accel::build(scene, BuildPreset::Fast);
    let projection = Projection::Perspective { tan_half: Vec2::new(0.9, 0.6) };
    let (eye, forward) = (Vec3::new(0.5, 1.8, 3.5) * scale, Vec3::new(-0.1, -0.3, -1.0));
    let view = View::look_to(eye, forward, Vec3::Y, projection, 0.01 * scale, 100.0 * scale);
    let camera = cast::gbuffer(&accel, &view, [24, 16]);
    let setup = Setup { options, params: Params { form, seed: 5 } };
    let output = cpu::indirect(&cpu::Frame::new(&accel, &view, &camera, &setup)).unwrap();
    assert_eq!(output.image.non_finite(), 0);
    assert!(output.image.pixels.iter().all(|p| p.min_element() >= 0.0));
    output
}

const SELECTIONS: [Selection; 3] =
    [Selection::All, Selection::Grid { cells: 8 }, Selection::Importance { count: 100 }];

/// Thesis eq. 4.7, `max(1, d²)`, would fail this: nothing may depend on the metre.
#[test]
fn the_image_does_not_depend_on_the_scale() {
    for kind in lights() {
        for selection in SELECTIONS {
            let options = options(32, selection);
            let image = |s: f32| {
                let mut scene = floor_and_wall(scaled(kind, s), s);
                if !matches!(kind, LightKind::Directional { .. }) {
                    // The same irradiance at s times the distance.
                    scene.lights[0].power *= s * s;
                }
                render(&scene, s, options, Form::Disc).image
            };
            let one = image(1.0);
            let mean = one.mean().max_element();
            assert!(mean > 0.0);
            for s in [1e-3, 0.03, 1e3, 1e5] {
                let other = image(s);
                let worst = one
                    .pixels
                    .iter()
                    .zip(&other.pixels)
                    .map(|(a, b)| (*a - *b).abs().max_element())
                    .fold(0.0, f32::max);
                // Rounding moves a texel's position by 1e-7 of the scene and may move its hit across an edge: one texel of
                // 1024.
                assert!(worst < 2e-3 * mean, "{kind:?} {selection:?} {s}: {worst} of {mean}");
            }
        }
    }
}

#[test]
fn results_repeat_bit_for_bit_on_any_number_of_threads() {
    let scene = floor_and_wall(lights()[0], 1.0);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&scene, 1.0, Options { resolution: 64, ..Options::default() }, Form::Disc))
    };
    let (one, three) = (run(1), run(3));
    assert_eq!(one.image, three.image);
    assert_eq!(one.vpls, three.vpls);
    assert_eq!(one.rsm, three.rsm);
}

#[test]
fn degenerate_lights_and_surfaces_stay_finite() {
    let floor = |kind| floor_and_wall(kind, 1.0);
    let mut scenes: Vec<Scene> = vec![
        // On the floor, on a vertex, on the wall's edge, inside nothing.
        floor(LightKind::Point { position: Vec3::ZERO }),
        floor(LightKind::Point { position: Vec3::new(2.0, 0.0, 2.0) }),
        floor(spot(Vec3::new(0.0, 2.0, -2.0), Vec3::Z, 10.0, 40.0)),
        floor(spot(Vec3::Y, Vec3::NEG_Y, 0.0, 0.0)),
        floor(spot(Vec3::Y, Vec3::NEG_Y, 90.0, 90.0)),
        floor(spot(Vec3::Y, Vec3::NEG_Y, 60.0, 60.0)),
        floor(spot(Vec3::Y * 1e-6, Vec3::X, 1.0, 89.0)),
        // Along the floor and along the wall.
        floor(LightKind::Directional { direction: Vec3::X }),
        floor(LightKind::Directional { direction: Vec3::NEG_Y }),
        // Far away, and looking away.
        floor(LightKind::Point { position: Vec3::splat(1e6) }),
        floor(spot(Vec3::Y * 3.0, Vec3::Y, 10.0, 20.0)),
        Scene { lights: vec![light(lights()[1], Vec3::ONE)], ..Scene::default() },
    ];
    // A closed box around the light, seen from outside; a box around everything.
    for half in [0.3, 5.0] {
        let mut s = floor(LightKind::Point { position: Vec3::ZERO });
        push_box(&mut s, half);
        scenes.push(s);
    }
    // A single sliver.
    let mut sliver = scene(Vec3::ONE);
    sliver.mesh.push_polygon(&[Vec3::ZERO, Vec3::X, Vec3::new(0.5, 1e-6, 0.0)], 0);
    sliver.lights = lights().map(|k| light(k, Vec3::ONE)).to_vec();
    scenes.push(sliver);
    // Edge-on to a directional light: no width, no flux.
    let mut edge = scene(Vec3::ONE);
    push_square(&mut edge, Vec3::ZERO, 1.0, Mat3::IDENTITY);
    edge.lights.push(light(LightKind::Directional { direction: Vec3::X }, Vec3::ONE));
    scenes.push(edge);
    for s in &scenes {
        for selection in SELECTIONS {
            for resolution in [1, 2, 17] {
                for form in [Form::Disc, Form::Point] {
                    let output = render(s, 1.0, options(resolution, selection), form);
                    let texels = output.rsm.maps.iter().flat_map(|m| &m.texels);
                    assert!(texels.clone().all(|t| t.area.is_finite() && t.area >= 0.0));
                    assert!(
                        texels.clone().all(|t| t.incident.is_finite() && t.incident.min_element() >= 0.0)
                    );
                }
            }
        }
    }
}

#[test]
fn light_ranges_may_be_anything_positive() {
    for range in [1e-20, 1e-3, 1.0, 1e20] {
        for kind in lights() {
            let mut s = floor_and_wall(kind, 1.0);
            s.lights[0].range = Some(range);
            render(&s, 1.0, options(8, Selection::All), Form::Disc);
        }
    }
}

#[test]
fn black_surfaces_and_absent_lights_are_black() {
    let mut black = floor_and_wall(lights()[0], 1.0);
    black.materials[0].base_color = Vec3::ZERO;
    let mut dark = floor_and_wall(lights()[0], 1.0);
    dark.lights[0].power = Vec3::ZERO;
    assert!(views(&dark).is_empty());
    for s in [black, dark] {
        for selection in SELECTIONS {
            let output = render(&s, 1.0, options(16, selection), Form::Disc);
            assert!(output.vpls.is_empty() && output.image.pixels.iter().all(|p| *p == Vec3::ZERO));
        }
    }
}

#[test]
fn many_lights_share_the_budget() {
    let mut s = floor_and_wall(lights()[0], 1.0);
    let position = |i: u32| Vec3::new((i % 8) as f32 * 0.4 - 1.4, 1.0 + (i / 8) as f32 * 0.4, 0.3);
    s.lights = (0..32)
        .map(|i| match i % 3 {
            0 => light(LightKind::Point { position: position(i) }, Vec3::new(1.0, 0.5, 0.1)),
            1 => light(spot(position(i), Vec3::NEG_Y, 10.0, 70.0), Vec3::new(0.1, 0.5, 2.0)),
            _ => light(LightKind::Directional { direction: -position(i).normalize() }, Vec3::splat(0.2)),
        })
        .collect();
    let all = render(&s, 1.0, options(16, Selection::All), Form::Disc);
    let drawn = render(&s, 1.0, options(16, Selection::Importance { count: 4096 }), Form::Disc);
    assert_eq!(drawn.vpls.len(), 4096);
    // Lights of different colours are only right in expectation: 1/√4096 of spread, less by stratification.
    let (a, b) = (all.image.mean(), drawn.image.mean());
    assert!(((a - b) / a).abs().max_element() < 0.015, "{a} {b}");
}

#[test]
fn bad_options_name_themselves() {
    let bad = |options: Options| options.validate().unwrap_err().option;
    assert_eq!(bad(Options { resolution: 0, ..Options::default() }), "resolution");
    assert_eq!(bad(Options { resolution: 8193, ..Options::default() }), "resolution");
    assert_eq!(bad(Options { cells: 0, ..Options::default() }), "cells");
    assert_eq!(bad(Options { vpls: 0, ..Options::default() }), "vpls");
}
