//! Images and scenes that break formulas: finite, bounded and right all the same.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use common::{corner, flat_gather, light, lights, noise_gbuffer, noise_rsm, spot, view};
use glam::Vec3;
use image_space_radiosity::layout::state;
use image_space_radiosity::{Error, Lights, Method, Options, Params, Thresholds, cpu};
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::{GBuffer, Scene};
use rsm::{Form, Selection};

const HIERARCHICAL: Lights = Lights::Hierarchical { coarsest: 4, finest: 32 };
const BASIC: Lights = Lights::Basic { coarsest: 4, finest: 32 };
const GRID: Lights = Lights::Flat(Selection::Grid { cells: 8 });

fn settings() -> [(Lights, Method); 5] {
    [
        (HIERARCHICAL, Method::Gather),
        (BASIC, Method::Gather),
        (GRID, Method::Gather),
        (GRID, Method::Splat),
        (BASIC, Method::BoundedSplat),
    ]
}

fn options(lights: Lights, method: Method) -> Options {
    Options { resolution: 32, lights, method, coarsest_block: 6 }
}

fn render(scene: &Scene, size: [u32; 2], scale: f32, options: &Options, params: &Params) -> cpu::Output {
    let accel = Accel::build(scene, BuildPreset::Fast);
    let view = view(scale);
    let camera = cast::gbuffer(&accel, &view, size);
    cpu::indirect(&accel, &camera, &view, options, params).unwrap()
}

#[test]
fn any_size_is_the_flat_gather_at_thresholds_of_zero() {
    let scene = corner(lights()[0], 1.0);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let none = Thresholds { depth: 0.0, normal: 0.0 };
    let params = Params { blocks: none, tau: 0.0, ..Params::default() };
    for size in [[1, 1], [2, 1], [1, 13], [64, 64], [65, 63], [31, 17]] {
        let camera = cast::gbuffer(&accel, &view(1.0), size);
        let options = options(HIERARCHICAL, Method::Gather);
        let found = cpu::indirect(&accel, &camera, &view(1.0), &options, &params).unwrap();
        let expected = flat_gather(&found.rsm, &camera, Form::Disc);
        let largest = expected.iter().map(|e| e.max_element()).fold(0.0, f32::max);
        // Few pixels may see nothing that light falls on.
        assert!(largest > 0.0 || camera.len() < 100, "{size:?}");
        for (f, e) in found.image.pixels.iter().zip(&expected) {
            // Sums of a thousand positive terms in another order: some 1e-6.
            assert!((*f - *e).abs().max_element() <= 1e-5 * largest, "{size:?}: {f} {e}");
        }
    }
}

#[test]
fn an_empty_image_is_black() {
    let rsm = noise_rsm(32, 1, 1, 0.2);
    for (lights, method) in settings() {
        for size in [[1, 1], [67, 33], [0, 0], [0, 5]] {
            let camera = GBuffer::new(size);
            let (options, params) = (options(lights, method), Params::default());
            let found = cpu::indirect_from(rsm.clone(), &camera, &view(1.0), &options, &params).unwrap();
            assert!(found.fragments.nodes.is_empty());
            assert!(found.image.pixels.iter().all(|p| *p == Vec3::ZERO));
        }
    }
}

/// A plane that fills the image, seen head on: as few fragments as there are coarsest blocks.
#[test]
fn an_image_without_discontinuity_is_its_coarsest_blocks() {
    let size = [200, 130];
    let mut camera = GBuffer::new(size);
    for i in 0..camera.len() {
        let (x, y) = ((i % 200) as f32 * 0.01 - 1.0, (i / 200) as f32 * 0.01 - 0.65);
        camera.triangle[i] = 0;
        camera.depth[i] = 2.0;
        camera.position[i] = Vec3::new(x, y, -2.0);
        camera.normal[i] = Vec3::Z;
        camera.albedo[i] = Vec3::ONE;
    }
    let rsm = noise_rsm(32, 1, 5, 0.2);
    let found =
        cpu::indirect_from(rsm, &camera, &view(1.0), &options(GRID, Method::Gather), &Params::default())
            .unwrap();
    assert_eq!(found.fragments.nodes.len(), 4 * 3);
    assert!(found.states.iter().all(|s| *s == state::COVERED || *s == state::VALID));
    assert_eq!(found.image.non_finite(), 0);
    // Interpolation invents nothing: every pixel lies within the range of the fragments.
    let (low, high) = found.gathered.iter().fold((Vec3::MAX, Vec3::MIN), |(l, h), e| (l.min(*e), h.max(*e)));
    for e in &found.irradiance.pixels {
        assert!(e.cmpge(low * 0.99999).all() && e.cmple(high * 1.00001).all(), "{e}");
    }
}

#[test]
fn a_scene_without_light_is_black() {
    let mut dark = corner(lights()[0], 1.0);
    dark.lights.clear();
    let mut black = corner(lights()[0], 1.0);
    black.materials[0].base_color = Vec3::ZERO;
    let mut unseen = corner(lights()[0], 1.0);
    unseen.lights[0].kind = spot(Vec3::new(0.0, 3.0, 0.0), Vec3::new(1.0, 0.05, 0.0), 1.0, 2.0);
    for scene in [dark, black, unseen] {
        for (lights, method) in settings() {
            let found = render(&scene, [33, 21], 1.0, &options(lights, method), &Params::default());
            assert!(found.image.pixels.iter().all(|p| *p == Vec3::ZERO), "{lights:?}");
        }
    }
}

/// No constant has a unit: scaled scenes cut alike and give the same picture, and so does more power.
#[test]
fn scale_and_power_do_not_matter() {
    for kind in 0..3 {
        let kind_at = |scale: f32| match lights()[kind] {
            indirect_core::LightKind::Spot { position, direction, inner_angle, outer_angle } => {
                indirect_core::LightKind::Spot {
                    position: position * scale,
                    direction,
                    inner_angle,
                    outer_angle,
                }
            }
            indirect_core::LightKind::Point { position } => {
                indirect_core::LightKind::Point { position: position * scale }
            }
            directional => directional,
        };
        for (lights, method) in settings() {
            let render = |scale: f32, power: f32| {
                let mut scene = corner(kind_at(scale), scale);
                scene.lights[0].power *= power;
                render(&scene, [67, 41], scale, &options(lights, method), &Params::default())
            };
            let one = render(1.0, 1.0);
            // Powers of two, so that scaling is exact and every decision falls alike.
            for (scale, power) in [(1.0 / 1024.0, 1.0), (1024.0, 1.0), (1.0, 65536.0)] {
                let other = render(scale, power);
                assert_eq!(one.states, other.states, "{lights:?} {scale}");
                assert_eq!(one.cuts, other.cuts, "{lights:?} {scale} {power}");
                let directional = kind == 2;
                let gain = power * if directional { 1.0 } else { 1.0 / (scale * scale) };
                for (a, b) in one.image.pixels.iter().zip(&other.image.pixels) {
                    assert!((*a * gain - *b).abs().max_element() <= 1e-5 * gain * a.max_element(), "{a} {b}");
                }
            }
        }
    }
}

#[test]
fn lights_on_and_in_surfaces_stay_finite() {
    for position in [Vec3::new(0.0, 1e-4, 0.0), Vec3::new(0.0, 0.0, 0.0), Vec3::new(0.4, 0.5, -0.5)] {
        for power in [1e-6, 1.0, 1e6] {
            let mut scene = corner(indirect_core::LightKind::Point { position }, 1.0);
            scene.lights[0].power = Vec3::splat(power);
            for kind in lights() {
                scene.lights.push(light(kind, Vec3::ONE));
            }
            for (lights, method) in settings() {
                for form in [Form::Disc, Form::Point] {
                    let params = Params { form, ..Params::default() };
                    let found = render(&scene, [33, 21], 1.0, &options(lights, method), &params);
                    assert_eq!(found.image.non_finite(), 0);
                    assert!(found.image.pixels.iter().all(|p| p.min_element() >= 0.0));
                }
            }
        }
    }
}

/// 3840 × 2160 on the CPU, from a G-buffer of noise and planes; only that it is right, not how long it takes.
#[test]
fn an_image_of_4k_is_covered_once() {
    let size = [3840, 2160];
    let camera = noise_gbuffer(size, 3, 1.0);
    let rsm = noise_rsm(8, 1, 7, 0.2);
    let options =
        Options { resolution: 8, ..options(Lights::Flat(Selection::Grid { cells: 1 }), Method::Gather) };
    let found = cpu::indirect_from(rsm, &camera, &view(1.0), &options, &Params::default()).unwrap();
    let blocks = cpu::Blocks::new(&camera, &found.blocks);
    let covered: u32 = found.fragments.nodes.iter().map(|n| blocks.at(*n as usize).pixels).sum();
    let surfaces = (0..camera.len()).filter(|i| camera.is_surface(*i)).count();
    assert_eq!(covered as usize, surfaces);
    assert_eq!(found.image.non_finite(), 0);
    println!("{surfaces} surface pixels, {} fragments", found.fragments.nodes.len());
}

#[test]
fn options_out_of_range_are_refused() {
    let ok = options(HIERARCHICAL, Method::Gather);
    assert_eq!(ok.validate(), Ok(()));
    let bad = [
        Options { resolution: 0, ..ok },
        Options { coarsest_block: 9, ..ok },
        Options { method: Method::Splat, ..ok },
        Options { lights: Lights::Basic { coarsest: 0, finest: 4 }, ..ok },
        Options { lights: Lights::Hierarchical { coarsest: 8, finest: 4 }, ..ok },
    ];
    for options in bad {
        assert!(options.validate().is_err(), "{options:?}");
    }
    let ok = Params::default();
    let bad = [
        Params { tau: -1.0, ..ok },
        Params { tau: f32::NAN, ..ok },
        Params { cutoff: 0.0, ..ok },
        Params { margin: f32::INFINITY, ..ok },
        Params { bend: f32::NAN, ..ok },
        Params { blocks: Thresholds { depth: -0.1, normal: 0.0 }, ..ok },
        Params { patches: Thresholds { depth: 0.0, normal: f32::NAN }, ..ok },
    ];
    for params in bad {
        assert!(matches!(params.validate(), Err(Error::BadOption { .. })), "{params:?}");
    }
    let (rsm, camera) = (noise_rsm(16, 1, 1, 0.0), GBuffer::new([4, 4]));
    let other = options(GRID, Method::Gather);
    assert!(cpu::indirect_from(rsm, &camera, &view(1.0), &other, &Params::default()).is_err());
}
