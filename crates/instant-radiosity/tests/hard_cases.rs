//! Scenes and settings that break formulas: finite and bounded all the same.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use common::{Stage, corner, lamp, light, lights, most, options, still, view};
use glam::Vec3;
use indirect_core::{LightKind, Material, Scene};
use instant_radiosity::{Bounce, Gather, Options, Output, Params, Switch, Visibility, cpu};

const SIZE: [u32; 2] = [32, 20];

fn render(scene: &Scene, scale: f32, options: Options) -> Output {
    let stage = Stage::new(scene, view(scale), SIZE);
    stage.run(&stage.setup(options, Params::default()), 2, Output::default())
}

fn all() -> Vec<Options> {
    vec![
        options(),
        Options { compensate: Switch::Off, ..options() },
        Options { visibility: Visibility::Off, ..options() },
        Options { interleave: 1, shadow_rays: 0, ..still(options()) },
        Options { interleave: 7, vpls: 1, bounces: 1, ..options() },
        Options {
            visibility: Visibility::Maps,
            bounce: Bounce::Points,
            points: 500,
            points_per_map: 64,
            ..options()
        },
        Options { bounce: Bounce::Brightest, points: 1, ..options() },
        Options { gather: Gather::Cuts, ..options() },
        Options { gather: Gather::Cuts, compensate: Switch::Off, interleave: 3, shadow_rays: 0, ..options() },
    ]
}

fn finite(o: &Output) {
    assert!(o.image.pixels.iter().all(|p| p.is_finite() && p.min_element() >= 0.0));
}

#[test]
fn nothing_to_see_or_no_light_is_black() {
    let mut dark = corner(lights()[0], 1.0);
    dark.lights.clear();
    let mut black = corner(lights()[0], 1.0);
    black.lights[0].power = Vec3::ZERO;
    let mut empty = Scene { materials: vec![Material::default()], ..Scene::default() };
    empty.lights.push(light(lights()[1]));
    let away = corner(
        LightKind::Spot { position: Vec3::Y * 3.0, direction: Vec3::Y, inner_angle: 0.1, outer_angle: 0.2 },
        1.0,
    );
    for options in all() {
        for scene in [&dark, &black, &empty, &Scene::default(), &away] {
            let o = render(scene, 1.0, options);
            assert_eq!(most(&o.image.pixels), 0.0);
        }
    }
}

#[test]
fn albedos_of_zero_and_one_stay_finite() {
    for albedo in [0.0, 1.0] {
        let mut scene = corner(lights()[1], 1.0);
        scene.materials.iter_mut().for_each(|m| m.base_color = Vec3::splat(albedo));
        for options in all() {
            let o = render(&scene, 1.0, Options { bounces: 4, ..options });
            finite(&o);
            assert_eq!(most(&o.image.pixels) > 0.0, albedo > 0.0);
        }
    }
}

/// A closed white box keeps all light for ever; the tail must not.
#[test]
fn a_white_furnace_has_a_bounded_tail() {
    let mut scene = indirect_scene::fixtures::build("sphere_furnace").unwrap();
    scene.materials.iter_mut().for_each(|m| m.base_color = Vec3::ONE);
    let stage = Stage::new(&scene, scene.cameras[0].view(SIZE), SIZE);
    let o = stage.run(&stage.setup(options(), Params::default()), 1, Output::default());
    finite(&o);
    assert!(o.summary.tail.max_element() <= 1.0 / (1.0 - cpu::MOST_KEPT) * 1.0001);
}

#[test]
fn lights_in_surfaces_and_at_receivers_stay_finite() {
    for position in
        [Vec3::ZERO, Vec3::new(0.0, 1e-6, 0.0), Vec3::new(0.4, 0.5, -0.5), Vec3::new(0.0, 1e-3, -1.999)]
    {
        let scene = corner(LightKind::Point { position }, 1.0);
        for options in all() {
            finite(&render(&scene, 1.0, options));
        }
    }
}

/// How far the brightest pixel of single frames is above that of the truth, corners included.
#[test]
fn no_pixel_is_far_brighter_than_the_brightest_of_the_truth() {
    let scene = indirect_scene::fixtures::build("cornell_spot").unwrap();
    let stage = Stage::new(&scene, scene.cameras[0].view([64, 64]), [64, 64]);
    let converged = Options { vpls: 4096, ..still(Options::default()) };
    let truth =
        most(&stage.run(&stage.setup(converged, Params::default()), 1, Output::default()).image.pixels);
    for seed in 0..8 {
        let setup = stage.setup(still(Options::default()), Params { seed, ..Params::default() });
        let found = most(&stage.run(&setup, 1, Output::default()).image.pixels);
        println!("{found} against {truth}");
        // Eight seeds gave 0.85 to 1.22 of it, 0.98 ± 0.12: five deviations.
        assert!(found < 1.6 * truth, "{found} {truth}");
    }
}

#[test]
fn extreme_scales_and_distances_stay_finite() {
    for scale in [1e-3_f32, 1e5] {
        for scene in [corner(lights()[0], scale), lamp(scale)] {
            for options in all() {
                finite(&render(&scene, scale, options));
            }
        }
    }
    // 10⁵ m from the origin.
    let mut far = corner(lights()[0], 1.0);
    let away = Vec3::splat(1e5);
    far.mesh.positions.iter_mut().for_each(|p| *p += away);
    if let LightKind::Spot { position, .. } = &mut far.lights[0].kind {
        *position += away;
    }
    let mut view = view(1.0);
    view.origin += away;
    let stage = Stage::new(&far, view, SIZE);
    finite(&stage.run(&stage.setup(options(), Params::default()), 2, Output::default()));
}

#[test]
fn degenerate_triangles_and_emitters_are_left_out() {
    let mut scene = lamp(1.0);
    let n = scene.mesh.positions.len() as u32;
    scene.mesh.positions.extend([Vec3::ONE; 3]);
    scene.mesh.normals.extend([Vec3::Y; 3]);
    scene.mesh.triangles.push([n, n + 1, n + 2]);
    scene.mesh.materials.push(2);
    for options in all() {
        finite(&render(&scene, 1.0, options));
    }
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    use indirect_core::settings::Settings;
    for (options, name) in [
        (Options { resolution: 0, ..Options::default() }, "resolution"),
        (Options { vpls: 0, ..Options::default() }, "vpls"),
        (Options { interleave: 9, ..Options::default() }, "interleave"),
        (Options { vpls: 65_536, interleave: 1, ..Options::default() }, "vpls"),
        (
            Options { vpls: 65_536, interleave: 7, bounces: 16, gather: Gather::Cuts, ..Options::default() },
            "vpls",
        ),
    ] {
        let error = options.validate().unwrap_err().to_string();
        assert!(error.contains(name), "{error}");
    }
}
