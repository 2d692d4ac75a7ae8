//! Visibility by shadow maps of coarse patches, each estimate with a fault that the same test refuses.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use common::{corner, frame, lights, noise_rsm, view};
use glam::Vec3;
use image_space_radiosity::cpu::{self, Patches, Tiles};
use image_space_radiosity::{
    Fitted, ImageSpaceRadiosity, Lights, Method, Options, Output, Params, Pyramids, Setup, Visibility,
};
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::math::offset_ray_origin_scaled;
use indirect_core::settings::Settings as _;
use indirect_core::{GBuffer, Image, Ray, Scene, View};
use indirect_technique::cpu::Fit;
use reference_pathtracer::{Bounces, Components, Samples, Settings, render};
use rsm::Vpl;

const SIZE: [u32; 2] = [96, 96];

fn maps(lights: Lights) -> Options {
    Options { lights, visibility: Visibility::Maps, ..Options::default() }
}

struct Stage<'a> {
    accel: Accel<'a>,
    view: View,
    camera: GBuffer,
    /// One bounce with visibility.
    truth: Image,
}

impl<'a> Stage<'a> {
    fn new(scene: &'a Scene, samples: u32) -> Self {
        let accel = Accel::build(scene, BuildPreset::Fast);
        let view = scene.cameras[0].view(SIZE);
        let camera = cast::gbuffer(&accel, &view, SIZE);
        let settings = Settings {
            components: Components::Indirect,
            bounces: Bounces::Count(1),
            samples: Samples::count(samples),
            seed: 5,
            ..Settings::default()
        };
        let truth = render(&accel, &view, SIZE, &settings).unwrap().indirect;
        Self { accel, view, camera, truth }
    }

    fn setup(&self, options: Options, seed: u32) -> Setup {
        ImageSpaceRadiosity::fit(&self.accel, options, Params { seed, ..Params::default() }).unwrap()
    }

    fn run(&self, setup: &Setup) -> Output {
        cpu::indirect(&frame(&self.accel, &self.view, &self.camera, setup)).unwrap()
    }

    /// The image of a frame whose lights reach fragments where `visible` says so.
    fn with(&self, setup: &Setup, o: &Output, visible: impl Fn(u32, Vec3, Vec3) -> bool + Sync) -> Image {
        let (positions, normals) = (&o.fragments.positions, &o.fragments.normals);
        let at = |light: u32, i: usize| visible(light, positions[i], normals[i]);
        let (gathered, _) = cpu::traverse_visible(&o.tree, positions, normals, setup.params.form, at);
        let p = Pyramids::new(&setup.options, SIZE);
        let blocks = cpu::Blocks::new(&self.camera, &o.blocks);
        let mut e = cpu::pull(&blocks, &o.states, &o.fragments, &gathered, &p.pixels, p.block);
        cpu::push(&blocks, &o.states, &p.pixels, p.block, &mut e);
        indirect_filter::cpu::shade(&self.camera, &e.pixels)
    }

    /// Whether a ray from the point of a shadow map reaches a receiver; `beyond` where either faces away.
    fn ray(&self, light: &Vpl, p: Vec3, n: Vec3, beyond: bool) -> bool {
        let v = p - light.position;
        if light.normal.dot(v) <= 0.0 || n.dot(v) >= 0.0 {
            return beyond;
        }
        let unit = self.accel.unit();
        let from = offset_ray_origin_scaled(p, n, unit);
        let to = offset_ray_origin_scaled(light.position, light.normal, unit);
        !self.accel.any_hit(&Ray { origin: from, direction: to - from, t_max: 1.0 })
    }

    /// Root mean square error over the truth's mean, and relative error of the mean.
    fn error(&self, found: &Image) -> (f64, f64) {
        let (mut square, mut mean, mut bias) = (0.0, 0.0, 0.0);
        for (x, r) in found.pixels.iter().zip(&self.truth.pixels) {
            let (x, r) = (x.as_dvec3(), r.as_dvec3());
            square += (x - r).length_squared() / 3.0;
            mean += r.element_sum() / 3.0;
            bias += (x - r).element_sum() / 3.0;
        }
        let n = found.pixels.len() as f64;
        ((square / n).sqrt() / (mean / n), bias / mean)
    }
}

/// With rays to the points of shadow maps in place of the maps: what remains is the choice of points.
#[test]
fn points_of_shadow_maps_see_in_the_mean_what_their_patches_see() {
    let scene = indirect_scene::fixtures::build("two_rooms").unwrap();
    let stage = Stage::new(&scene, 1024);
    let judge = |beyond: bool, shift: u32| {
        let all: Vec<_> = (0..4)
            .map(|seed| {
                let setup =
                    stage.setup(Options { points: 1, points_per_map: 1, ..maps(Lights::Hierarchical) }, seed);
                let o = stage.run(&setup);
                let n = o.shadow_lights.len() as u32;
                let asked = |light: u32| &o.shadow_lights[((light + shift) % n) as usize];
                stage.error(&stage.with(&setup, &o, |light, p, n| stage.ray(asked(light), p, n, beyond)))
            })
            .collect();
        let spread = all.iter().map(|e| e.1).fold(f64::MIN, f64::max)
            - all.iter().map(|e| e.1).fold(f64::MAX, f64::min);
        let mean = |f: fn(&(f64, f64)) -> f64| all.iter().map(f).sum::<f64>() / all.len() as f64;
        let found = (mean(|e| e.0), mean(|e| e.1));
        println!("beyond {beyond} shift {shift}: {found:.4?}, seeds within {spread:.4}");
        found
    };
    // Four seeds lie within 0.033 of each other (printed), so that their mean has a standard error of 0.008; blocks and cuts shift
    // it by 0.005 without an occluder. Three and a bit of the one and the other.
    let (rms, bias) = judge(true, 0);
    assert!(bias.abs() < 0.03 && rms < 0.15, "{rms} {bias}");
    // What lies beyond the horizon of a point is dark, or another patch is asked.
    for (rms, bias) in [judge(false, 0), judge(true, 8)] {
        assert!(bias.abs() > 0.04 || rms > 0.25, "{rms} {bias} passed");
    }
}

#[test]
fn shadow_maps_take_away_the_light_that_walls_and_boxes_stop() {
    // Of the error without visibility, what may remain: measured 0.24 and 0.60. In the Cornell box most of that is
    // the truth's noise and what blocks and cuts err.
    for (name, remains, limit) in [("two_rooms", 0.33, 0.04), ("cornell_spot", 0.7, 0.04)] {
        let scene = indirect_scene::fixtures::build(name).unwrap();
        let stage = Stage::new(&scene, 1024);
        for lights in [Lights::Hierarchical, Lights::Basic, Lights::Flat] {
            let cells = if lights == Lights::Flat { 24 } else { 16 };
            let off = stage.run(&stage.setup(Options { lights, cells, ..Options::default() }, 0));
            let setup = stage.setup(Options { cells, ..maps(lights) }, 0);
            let on = stage.run(&setup);
            let (without, with) = (stage.error(&off.image), stage.error(&on.image));
            println!("{name} {}: without {without:.4?} with {with:.4?}", lights.word());
            if lights != Lights::Hierarchical {
                assert!(with.0 < 0.97 * without.0, "{with:?} {without:?}");
                continue;
            }
            let right = |e: (f64, f64)| e.0 < remains * without.0 && e.1.abs() < limit;
            assert!(right(with), "{name}: {with:?} {without:?}");
            // Maps of other patches; of none.
            let n = on.shadow_lights.len() as u32;
            let other = stage.with(&setup, &on, |light, p, n_p| {
                cpu::light_visible(&on.shadows, (light + n / 2 + 8) % n, p, n_p)
            });
            let none = stage.with(&setup, &on, |_, _, _| true);
            for wrong in [stage.error(&other), stage.error(&none)] {
                println!("    fault {wrong:.4?}");
                assert!(!right(wrong), "{name}: {wrong:?} passed");
            }
        }
    }
}

/// Patches are drawn in proportion to flux: frequencies over many seeds against shares.
#[test]
fn draws_follow_flux() {
    const DRAWS: u32 = 4000;
    let rsm = noise_rsm(16, 2, 7, 0.2);
    let options = Options { resolution: 16, shadow_cells: 4, ..Options::default() };
    let p = Pyramids::new(&options, [8, 8]);
    let patches: Vec<_> = rsm.maps.iter().map(|map| cpu::patches(map, &p.texels)).collect();
    let patches: Vec<_> = rsm.maps.iter().zip(&patches).map(|(m, p)| Patches::new(m, p)).collect();
    let (root, l) = ((p.texels.len() - 1) as u32, p.texels.levels[p.shadow]);
    let mut drawn = vec![0_u32; 2 * l.len()];
    for seed in 0..DRAWS {
        let tiles = Tiles { layout: &p.texels, level: p.shadow, seed };
        for map in 0..2 {
            drawn[tiles.of(&patches, map, root) as usize] += 1;
        }
    }
    // χ² of 2·(16 − 1) degrees of freedom: 0.1 % of right draws exceed 59.7.
    let chi2 = |share: &dyn Fn(usize, usize) -> f64| -> f64 {
        let cell = |i: usize| {
            let expected = share(i / l.len(), i % l.len()) * f64::from(DRAWS);
            (f64::from(drawn[i]) - expected).powi(2) / expected.max(1e-9)
        };
        (0..drawn.len()).map(cell).sum()
    };
    let by_flux = |map: usize, cell: usize| {
        let weight = |node: usize| f64::from(patches[map].at(node).weight());
        weight(l.offset as usize + cell) / weight(root as usize)
    };
    let by_area = |map: usize, cell: usize| {
        let area = |node: usize| f64::from(patches[map].at(node).area);
        area(l.offset as usize + cell) / area(root as usize)
    };
    let (right, wrong) = (chi2(&by_flux), chi2(&by_area));
    println!("{right:.1} {wrong:.1}");
    assert!(right < 59.7 && wrong > 200.0, "{right} {wrong}");
}

#[test]
fn each_light_asks_a_map_that_stands_on_a_lit_texel_of_its_own_map() {
    for (resolution, shadow_cells) in [(45, 12), (16, 1), (16, 128), (2, 16), (1, 16), (7, 3)] {
        let rsm = noise_rsm(resolution, 3, resolution, 0.4);
        let scene = Scene::default();
        let accel = Accel::build(&scene, BuildPreset::Fast);
        for lights in [Lights::Hierarchical, Lights::Basic, Lights::Flat] {
            let cells = resolution.min(4);
            let (coarsest, finest) = (resolution.min(4), 8192);
            let options = Options { resolution, shadow_cells, cells, coarsest, finest, ..maps(lights) };
            let setup = ImageSpaceRadiosity::fit(&accel, options, Params::default()).unwrap();
            let camera = common::noise_gbuffer([20, 10], 4, 0.1);
            let o = common::from_maps(rsm.clone(), &camera, &setup).unwrap();
            assert_eq!(o.shadows.frames.len(), o.shadow_lights.len());
            let per_map = o.shadow_lights.len() / 3;
            let flux = |v: &[Vpl]| v.iter().map(|v| v.flux.as_dvec3()).sum::<glam::DVec3>();
            for (i, branch) in o.tree.iter().enumerate().filter(|(_, b)| b.weight() > 0.0) {
                let tile = branch.representative as usize;
                let light = &o.shadow_lights[tile];
                assert!(light.normal.is_normalized() && light.flux.element_sum() > 0.0);
                if lights != Lights::Flat {
                    assert_eq!(tile / per_map, i / (o.tree.len() / 3));
                    let at =
                        rsm.maps[tile / per_map].surface.position.iter().position(|p| *p == light.position);
                    assert!(rsm.maps[tile / per_map].texels[at.unwrap()].reflected.element_sum() > 0.0);
                }
            }
            if lights != Lights::Flat {
                let all: glam::DVec3 =
                    rsm.maps.iter().flat_map(|m| &m.texels).map(|t| t.reflected.as_dvec3()).sum();
                assert!((flux(&o.shadow_lights) - all).abs().max_element() < 1e-4 * all.max_element());
            }
        }
    }
}

/// Where nothing stands in the way the walk with maps gathers what the list does: basic clusters, a selection, cuts.
#[test]
fn without_an_occluder_lights_are_those_without_maps() {
    for (kind, lights) in lights().into_iter().zip([Lights::Basic, Lights::Flat, Lights::Hierarchical]) {
        let scene = corner(kind, 1.0);
        let (accel, view) = (Accel::build(&scene, BuildPreset::Fast), view(1.0));
        let camera = cast::gbuffer(&accel, &view, [40, 25]);
        let of = |options| {
            let setup = ImageSpaceRadiosity::fit(&accel, options, Params::default()).unwrap();
            let o = cpu::indirect(&frame(&accel, &view, &camera, &setup)).unwrap();
            (o, setup)
        };
        let base = Options { resolution: 64, points: 1000, points_per_map: 100, ..maps(lights) };
        let (off, _) = of(Options { visibility: Visibility::Off, ..base });
        assert!(off.shadow_lights.is_empty() && off.shadows.frames.is_empty());
        assert!(
            off.tree.iter().all(|b| b.representative == 0)
                && (off.tree.is_empty() || lights == Lights::Hierarchical)
        );
        let (on, setup) = of(base);
        let (p, n) = (&on.fragments.positions, &on.fragments.normals);
        let (open, _) = cpu::traverse_visible(&on.tree, p, n, setup.params.form, |_, _| true);
        let most = off.gathered.iter().fold(0.0_f32, |m, e| m.max(e.max_element()));
        // Sums of up to some thousand lights in another order.
        let off_by = |e: &[Vec3]| {
            e.iter().zip(&off.gathered).map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f32::max) / most
        };
        assert!(off_by(&open) < 1e-4, "{}", off_by(&open));
        // The tilted square shades.
        assert!(off_by(&on.gathered) > 0.01, "{}", off_by(&on.gathered));
    }
}

#[test]
fn points_follow_a_scene_that_moves() {
    let mut scene = corner(lights()[0], 1.0);
    let mut setup = {
        let accel = Accel::build(&scene, BuildPreset::Fast);
        ImageSpaceRadiosity::fit(&accel, maps(Lights::Hierarchical), Params::default()).unwrap()
    };
    let before = setup.fitted.clone();
    scene.mesh.positions.iter_mut().for_each(|p| p.x += 1.0);
    ImageSpaceRadiosity::refit(&mut setup, &Accel::build(&scene, BuildPreset::Fast));
    assert_eq!(before.points.len(), setup.fitted.points.len());
    for (a, b) in before.points.iter().zip(setup.fitted.points.iter()) {
        assert!((b.position - a.position - Vec3::X).length() < 1e-5);
    }
}

#[test]
fn what_cannot_be_is_refused_and_what_is_empty_is_dark() {
    let bad = |options: Options| options.validate().is_err();
    for method in [Method::Splat, Method::BoundedSplat] {
        assert!(bad(Options { method, ..maps(Lights::Flat) }));
    }
    assert!(bad(Options { tile: 48, ..maps(Lights::Flat) }));
    let view = view(1.0);
    // A setup that knows no scene.
    let scene = corner(lights()[0], 1.0);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let camera = cast::gbuffer(&accel, &view, [8, 8]);
    let setup = Setup { options: maps(Lights::Hierarchical), ..Setup::default() };
    assert!(cpu::indirect(&frame(&accel, &view, &camera, &setup)).is_err());
    // No lights, no triangles.
    let mut dark = corner(lights()[0], 1.0);
    dark.lights.clear();
    for scene in [dark, Scene::default()] {
        let accel = Accel::build(&scene, BuildPreset::Fast);
        let camera = cast::gbuffer(&accel, &view, [8, 8]);
        for lights in [Lights::Hierarchical, Lights::Basic, Lights::Flat] {
            let setup = ImageSpaceRadiosity::fit(&accel, maps(lights), Params::default()).unwrap();
            let o = cpu::indirect(&frame(&accel, &view, &camera, &setup)).unwrap();
            assert!(o.image.pixels.iter().all(|p| *p == Vec3::ZERO));
        }
    }
    assert_eq!(Fitted::new(&accel, &Options::default()), Fitted::default());
}
