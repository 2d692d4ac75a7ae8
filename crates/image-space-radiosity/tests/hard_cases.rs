//! Images and scenes that break formulas: finite, bounded and right all the same.
#![cfg(feature = "cpu")]
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use common::{corner, flat_gather, from_maps, light, lights, noise_gbuffer, noise_rsm, render, spot, view};
use glam::Vec3;
use image_space_radiosity::layout::state;
use image_space_radiosity::{Error, Form, Lights, Method, Options, Params, Setup, cpu};
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::GBuffer;
use indirect_core::settings::Settings;

/// Every kind of light and every method, with default parameters.
fn setups() -> [Setup; 5] {
    [
        (Lights::Hierarchical, Method::Gather),
        (Lights::Basic, Method::Gather),
        (Lights::Flat, Method::Gather),
        (Lights::Flat, Method::Splat),
        (Lights::Basic, Method::BoundedSplat),
    ]
    .map(|(lights, method)| setup(lights, method))
}

fn setup(lights: Lights, method: Method) -> Setup {
    let options = Options { resolution: 32, lights, coarsest: 4, cells: 8, method, ..Options::default() };
    Setup { options, ..Setup::default() }
}

#[test]
fn any_size_is_the_flat_gather_at_thresholds_of_zero() {
    let scene = corner(lights()[0], 1.0);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let params = Params { depth: 0.0, normal: 0.0, tau: 0.0, ..Params::default() };
    let setup = Setup { params, ..setup(Lights::Hierarchical, Method::Gather) };
    for size in [[1, 1], [2, 1], [1, 13], [64, 64], [65, 63], [31, 17]] {
        let camera = cast::gbuffer(&accel, &view(1.0), size);
        let found = cpu::indirect(&cpu::Frame::new(&accel, &view(1.0), &camera, &setup)).unwrap();
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
    for setup in setups() {
        for size in [[1, 1], [67, 33], [0, 0], [0, 5]] {
            let camera = GBuffer::new(size);
            let found = from_maps(rsm.clone(), &camera, &setup).unwrap();
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
    let found = from_maps(rsm, &camera, &setup(Lights::Flat, Method::Gather)).unwrap();
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
        for setup in setups() {
            let found = render(&scene, [33, 21], 1.0, &setup);
            assert!(found.image.pixels.iter().all(|p| *p == Vec3::ZERO), "{setup:?}");
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
        for setup in setups() {
            let render = |scale: f32, power: f32| {
                let mut scene = corner(kind_at(scale), scale);
                scene.lights[0].power *= power;
                render(&scene, [67, 41], scale, &setup)
            };
            let one = render(1.0, 1.0);
            // Powers of two, so that scaling is exact and every decision falls alike.
            for (scale, power) in [(1.0 / 1024.0, 1.0), (1024.0, 1.0), (1.0, 65536.0)] {
                let other = render(scale, power);
                assert_eq!(one.states, other.states, "{setup:?} {scale}");
                assert_eq!(one.cuts, other.cuts, "{setup:?} {scale} {power}");
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
            for setup in setups() {
                for &form in Form::ALL {
                    let setup = Setup { params: Params { form, ..setup.params }, ..setup.clone() };
                    let found = render(&scene, [33, 21], 1.0, &setup);
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
    let setup = setup(Lights::Flat, Method::Gather);
    let options = Options { resolution: 8, cells: 1, ..setup.options };
    let found = from_maps(rsm, &camera, &Setup { options, ..setup }).unwrap();
    let blocks = cpu::Blocks::new(&camera, &found.blocks);
    let covered: u32 = found.fragments.nodes.iter().map(|n| blocks.at(*n as usize).pixels).sum();
    let surfaces = (0..camera.len()).filter(|i| camera.is_surface(*i)).count();
    assert_eq!(covered as usize, surfaces);
    assert_eq!(found.image.non_finite(), 0);
    println!("{surfaces} surface pixels, {} fragments", found.fragments.nodes.len());
}

#[test]
fn settings_out_of_range_are_refused() {
    let ok = setup(Lights::Hierarchical, Method::Gather).options;
    assert_eq!(ok.validate(), Ok(()));
    let bad = [
        Options { resolution: 0, ..ok },
        Options { block: 9, ..ok },
        Options { method: Method::Splat, ..ok },
        Options { lights: Lights::Basic, coarsest: 0, ..ok },
        Options { coarsest: 8, finest: 4, ..ok },
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
        Params { depth: -0.1, ..ok },
        Params { patch_normal: f32::NAN, ..ok },
    ];
    for params in bad {
        assert!(params.validate().is_err(), "{params:?}");
    }
    let (rsm, camera) = (noise_rsm(16, 1, 1, 0.0), GBuffer::new([4, 4]));
    let error = from_maps(rsm, &camera, &setup(Lights::Flat, Method::Gather)).unwrap_err();
    assert!(matches!(error, Error::BadOption(_)), "{error}");
}
