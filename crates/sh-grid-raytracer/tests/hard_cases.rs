//! Scenes and settings that break formulas: finite and bounded all the same.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use std::f32::consts::PI;

use common::{Stage, corner, inside, lamp, light, lights, most, options, random, square, view};
use glam::{Vec3, Vec4};
use indirect_core::{LightKind, Material, Scene};
use indirect_technique::cpu::Fit;
use sh_grid_raytracer::cpu::{Field, RUN, radiance, runs, sort};
use sh_grid_raytracer::layout::StoredPhoton;
use sh_grid_raytracer::{
    Error, Gather, Grid, Options, Output, Params, Reconstruct, Setup, ShGridRaytracer, Switch, Traverse,
    Weights,
};

const SIZE: [u32; 2] = [32, 20];

fn small() -> Options {
    Options { photons: 2048, directions: 60, ..options() }
}

fn all() -> Vec<Options> {
    vec![
        small(),
        Options { traverse: Traverse::Voxels, weights: Weights::Side, order: 2, ..small() },
        Options { gather: Gather::Final, ..small() },
        Options { gather: Gather::Samples, obscurance: Switch::On, order: 4, ..small() },
        Options { footprint: Switch::On, open_points: 0, turned: Switch::Off, ..small() },
        Options {
            reconstruct: Reconstruct::AsPrinted,
            weights: Weights::AsPrinted,
            traverse: Traverse::Voxels,
            footprint: Switch::On,
            ..small()
        },
        Options { grid: 1, ..small() },
        Options { photons: 1, directions: 6, samples: 1, bounces: 1, ..small() },
        Options { gather: Gather::Final, samples: 1, ..small() },
    ]
}

fn render(scene: &Scene, scale: f32, options: Options) -> (Setup, Output) {
    let stage = Stage::new(scene, view(scale), SIZE);
    let setup = stage.setup(options, Params::default());
    let output = stage.run(&setup);
    (setup, output)
}

/// Nothing that was computed on the way is infinite or NaN, and no light is negative.
fn finite(o: &Output) {
    assert!(o.stored.iter().all(|p| p.flux.is_finite() && p.axis.is_finite()), "stored");
    assert!(o.faces.iter().flat_map(|f| f.faces).all(|f| f.is_finite() && f.min_element() >= 0.0), "faces");
    assert!(o.field.coefficients.iter().all(|c| c.is_finite()), "field");
    assert!(o.irradiance.iter().all(|e| e.is_finite() && e.min_element() >= 0.0), "irradiance");
    assert!(o.image.pixels.iter().all(|p| p.is_finite() && p.min_element() >= 0.0), "image");
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
    // A triangle without area is none.
    let mut flat = empty.clone();
    flat.mesh.push_polygon(&[Vec3::ZERO, Vec3::X, Vec3::X * 2.0], 0);
    for options in all() {
        for scene in [&dark, &black, &empty, &Scene::default(), &away, &flat] {
            let (_, o) = render(scene, 1.0, options);
            finite(&o);
            assert_eq!(most(&o.image.pixels), 0.0);
        }
    }
    // The same check refuses a scene with light.
    assert!(most(&render(&corner(lights()[0], 1.0), 1.0, small()).1.image.pixels) > 0.0);
}

/// One triangle, and a plane without thickness along each axis: nothing to send light to, so no indirect light but what three bands of
/// harmonics leave of light from behind.
#[test]
fn what_is_flat_lights_nothing() {
    let albedo = 0.5;
    let materials = vec![Material::diffuse("grey", Vec3::splat(albedo))];
    let light = light(LightKind::Point { position: Vec3::new(0.3, 0.9, 0.4) });
    let base = Scene { materials, lights: vec![light], ..Scene::default() };
    let mut triangle = base.clone();
    triangle.mesh.push_polygon(&[Vec3::ZERO, Vec3::X, Vec3::new(0.2, 0.1, -1.0)], 0);
    // With their distances from the light.
    let mut scenes = vec![(triangle, 0.6)];
    for ([u, v], distance) in
        [([Vec3::X, Vec3::NEG_Z], 0.9), ([Vec3::X, Vec3::Y], 0.4), ([Vec3::NEG_Z, Vec3::Y], 0.3_f32)]
    {
        let mut plane = base.clone();
        square(&mut plane, Vec3::ZERO, u, v, 1.0, 0);
        scenes.push((plane, distance));
    }
    let mut bright = 0.0_f32;
    for (scene, distance) in &scenes {
        // No more than its brightest point radiates: 3 W/sr, the brightest channel of the light.
        let radiance = albedo * 3.0 / (distance * distance) / PI;
        for options in all() {
            let (setup, o) = render(scene, 1.0, options);
            finite(&o);
            assert!(setup.fitted.voxels.boundary > 0);
            if options.photons > 1 {
                assert!(!o.stored.is_empty());
            }
            // Rays that start on a surface miss it; in the V-grid surfaces are as thick as cells, and what is as printed leaks.
            if options.traverse == Traverse::Rays && options.grid > 1 && options.photons > 1 {
                let found = most(&o.image.pixels) / radiance;
                if options.gather == Gather::Final {
                    assert_eq!(found, 0.0);
                } else {
                    // Σ (−1)^l A_l (2l + 1)/4π = 1/4 − 1/2 + 5/16 = 1/16 of the light from straight behind, times the albedo.
                    assert!(found < albedo / 16.0 * 1.5, "{found} {options:?}");
                    bright = bright.max(found);
                }
            }
        }
    }
    println!("at most {bright:.4} of the brightest radiance comes back");
}

/// However many photons lie in one cell, no run of them is longer than [`RUN`], and none is lost.
#[test]
fn all_photons_in_one_cell_are_summed_in_runs() {
    let mut scene =
        Scene { materials: vec![Material::diffuse("grey", Vec3::splat(0.7))], ..Scene::default() };
    inside(&mut scene, Vec3::ZERO, Vec3::ONE, 0);
    scene.lights.push(light(LightKind::Point { position: Vec3::new(0.1, 0.2, 0.0) }));
    let (setup, o) = render(&scene, 1.0, Options { grid: 1, open_points: 0, ..options() });
    finite(&o);
    assert_eq!(setup.fitted.voxels.boundary, 1);
    assert!(o.stored.len() > 4096 && o.stored.iter().all(|p| p.cell == 0));
    let longest = |begins: &[u32]| {
        let ends = begins.iter().skip(1).copied().chain([o.stored.len() as u32]);
        begins.iter().zip(ends).map(|(a, b)| b - a).max().unwrap()
    };
    let begins = runs(&o.stored, &o.order);
    assert!(longest(&begins) <= RUN, "{}", longest(&begins));
    // Runs that begin only where the cell changes are refused.
    assert!(longest(&[0]) > RUN);
    let flux: f64 = o.stored.iter().map(|p| f64::from(p.flux.x)).sum();
    let found: f64 = o.faces[0].faces.iter().map(|f| f64::from(f.x)).sum();
    assert!((found / flux - 1.0).abs() < 1e-5, "{found} {flux}");
    // No photon at all, and one.
    assert!(sort(&[]).is_empty() && runs(&[], &[]).is_empty());
    let one = [StoredPhoton { flux: Vec3::ONE, cell: 0, axis: Vec3::X, photon: 0 }];
    assert_eq!(runs(&one, &sort(&one)), [0]);
    assert_eq!(radiance(&one, &sort(&one), &setup.fitted.voxels, false)[0].faces[1].x, 1.0);
}

#[test]
fn points_on_borders_and_outside_the_volume_have_a_finite_field() {
    let scene = corner(lights()[0], 1.0);
    let stage = Stage::new(&scene, view(1.0), SIZE);
    for weights in [Weights::Visible, Weights::Side, Weights::AsPrinted] {
        let setup = stage.setup(Options { weights, ..small() }, Params::default());
        let o = stage.run(&setup);
        let field = Field {
            accel: &stage.accel,
            voxels: &setup.fitted.voxels,
            cells: &o.field.coefficients,
            coefficients: 9,
            weights,
            reach: setup.params.reach,
        };
        let grid: Grid = setup.fitted.voxels.grid;
        let sound = |p: Vec3, n: Vec3| {
            let local = field.at(p, n);
            assert!(local.sh.0.iter().all(|c| c.is_finite()) && local.irradiance(n).is_finite(), "{p} {n}");
            local
        };
        let normals = [Vec3::X, Vec3::Y, Vec3::NEG_Z, Vec3::splat(0.577_350_3)];
        let mut lit = 0;
        for n in normals {
            for i in 0..200 {
                // Corners of cells, the outermost included.
                let c = [0, 1, 2].map(|k| (random(i, k) * (grid.size.max_element() + 1) as f32).floor());
                let p = grid.origin + Vec3::from(c) * grid.cell;
                lit += u32::from(sound(p, n).irradiance(n) != Vec3::ZERO);
                // Centres, where a cell is at no distance.
                sound(grid.origin + (Vec3::from(c) + 0.5) * grid.cell, n);
            }
            for far in [Vec3::splat(1e3), Vec3::splat(-1e3), Vec3::X * 1e6] {
                assert!(sound(far, n).sh.0.iter().all(|c| *c == Vec4::ZERO), "{far}");
            }
        }
        assert!(lit > 0, "{weights:?}");
    }
}

#[test]
fn grids_hold_what_they_are_around() {
    use indirect_core::Aabb;
    for scale in [1e-30_f32, 1e-6, 1.0, 1e5, 1e30] {
        for extent in
            [Vec3::ONE, Vec3::new(1.0, 0.0, 1.0), Vec3::new(0.0, 3.0, 0.0), Vec3::new(1e-3, 1.0, 0.3)]
        {
            for resolution in [1, 2, 3, 32, 128] {
                let bounds = Aabb { min: Vec3::splat(-0.3) * scale, max: (extent - 0.3) * scale };
                let grid = Grid::around(&bounds, resolution);
                assert!(
                    grid.cell > 0.0 && grid.cell.is_finite() && grid.size.max_element() <= resolution.max(1)
                );
                for p in bounds.corners() {
                    assert!(grid.cell_at(grid.local(p)).is_some(), "{bounds:?} {resolution} {grid:?}");
                }
            }
        }
    }
    let grid = Grid::default();
    assert!(grid.cell_at(Vec3::NAN).is_none() && grid.cell_at(Vec3::ONE).is_none());
    assert!(grid.cell_at(Vec3::ZERO).is_some() && grid.cell_at(Vec3::new(0.0, -1e-30, 0.0)).is_none());
}

/// The same picture whatever the unit of length.
#[test]
fn scale_does_not_matter() {
    for options in [options(), Options { traverse: Traverse::Voxels, gather: Gather::Samples, ..options() }] {
        let expected = render(&corner(lights()[0], 1.0), 1.0, options).1.image;
        for scale in [1e-3_f32, 1024.0, 1e3] {
            let found = render(&corner(lights()[0], scale), scale, options).1.image;
            let (a, b) = (found.mean(), expected.mean());
            // Photons that rounding sends elsewhere: at worst some of 4096, each of which moves the whole by its share.
            println!("{scale}: {a} {b}");
            assert!((a - b).length() < 5e-3 * b.length(), "{scale}: {a} {b}");
            let far = found.pixels.iter().zip(&expected.pixels);
            let far = far.filter(|(a, b)| {
                (**a - **b).length() > 0.05 * b.length().max(0.1 * expected.mean().length())
            });
            let count = far.count();
            assert!(count <= expected.pixels.len() / 50, "{scale}: {count} pixels differ");
        }
        // The same check refuses a scene whose light did not grow with it.
        let mut wrong = corner(lights()[0], 1e3);
        wrong.lights[0].power *= 1e-6;
        let mean = render(&wrong, 1e3, options).1.image.mean();
        assert!((mean - expected.mean()).length() > 5e-3 * expected.mean().length());
    }
}

/// 10⁵ m from the origin coordinates resolve 8 mm; cells have 330 mm.
#[test]
fn far_from_the_origin_the_picture_is_much_the_same() {
    let away = Vec3::new(1e5, -1e5, 1e5);
    let mut far = corner(lights()[0], 1.0);
    far.mesh.positions.iter_mut().for_each(|p| *p += away);
    if let LightKind::Spot { position, .. } = &mut far.lights[0].kind {
        *position += away;
    }
    let mut camera = view(1.0);
    camera.origin += away;
    let here = render(&corner(lights()[0], 1.0), 1.0, options()).1.image.mean();
    for options in all() {
        let stage = Stage::new(&far, camera, SIZE);
        finite(&stage.run(&stage.setup(options, Params::default())));
    }
    let stage = Stage::new(&far, camera, SIZE);
    let there = stage.run(&stage.setup(options(), Params::default())).image.mean();
    println!("{there} {here}");
    assert!((there - here).length() < 0.2 * here.length(), "{there} {here}");
}

#[test]
fn albedos_of_zero_and_one_stay_finite() {
    for albedo in [0.0, 1.0] {
        let mut scene = corner(lights()[1], 1.0);
        scene.materials.iter_mut().for_each(|m| m.base_color = Vec3::splat(albedo));
        for options in all() {
            let (_, o) = render(&scene, 1.0, options);
            finite(&o);
            assert!(albedo > 0.0 || most(&o.image.pixels) == 0.0);
        }
        let (_, o) = render(&scene, 1.0, options());
        assert_eq!(most(&o.image.pixels) > 0.0, albedo > 0.0);
    }
    // A closed white room keeps all light for ever; as many reflections are stored as there may be, and no more.
    let mut furnace = indirect_scene::fixtures::build("sphere_furnace").unwrap();
    furnace.materials.iter_mut().for_each(|m| m.base_color = Vec3::ONE);
    let stage = Stage::new(&furnace, furnace.cameras[0].view(SIZE), SIZE);
    let options = Options { bounces: 64, grid: 8, ..small() };
    let o = stage.run(&stage.setup(options, Params::default()));
    finite(&o);
    assert!(o.stored.len() <= options.most_stored() as usize && o.stored.len() > options.photons as usize);
}

#[test]
fn lights_in_surfaces_and_many_lights_stay_finite() {
    for position in
        [Vec3::ZERO, Vec3::new(0.0, 1e-6, 0.0), Vec3::new(0.4, 0.5, -0.5), Vec3::new(0.0, 1e-3, -1.999)]
    {
        let scene = corner(LightKind::Point { position }, 1.0);
        for options in all() {
            finite(&render(&scene, 1.0, options).1);
        }
    }
    let mut many = corner(lights()[0], 1.0);
    for i in 0..39 {
        let mut one = light(lights()[i % 3]);
        one.power *= 10.0_f32.powi(i as i32 % 7 - 3);
        many.lights.push(one);
    }
    assert_eq!(many.lights.len(), 40);
    for options in all() {
        finite(&render(&many, 1.0, options).1);
    }
    // 40 lights of a fortieth each are one.
    let one = corner(lights()[1], 1.0);
    let mut split = one.clone();
    split.lights[0].power /= 40.0;
    split.lights = vec![split.lights[0].clone(); 40];
    let (a, b) = (render(&split, 1.0, options()).1.image.mean(), render(&one, 1.0, options()).1.image.mean());
    println!("{a} {b}");
    // Two estimates of 4096 photons, a third of which meet anything: 1/√1400 = 3 % each, three deviations of the difference.
    assert!((a - b).length() < 0.12 * b.length(), "{a} {b}");
}

#[test]
fn degenerate_triangles_are_left_out() {
    let mut scene = lamp(1.0);
    let n = scene.mesh.positions.len() as u32;
    // Far away: it must not stretch the grid either.
    scene.mesh.positions.extend([Vec3::splat(50.0); 3]);
    scene.mesh.normals.extend([Vec3::Y; 3]);
    scene.mesh.triangles.push([n, n + 1, n + 2]);
    scene.mesh.materials.push(2);
    let plain = render(&lamp(1.0), 1.0, small()).0.fitted.voxels;
    for options in all() {
        let (setup, o) = render(&scene, 1.0, options);
        finite(&o);
        assert!(options.grid == 1 || setup.fitted.voxels.grid == plain.grid);
    }
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let scene = corner(lights()[0], 1.0);
    let stage = Stage::new(&scene, view(1.0), [1, 1]);
    let refused = |options, params, name: &str| {
        let error: Error = ShGridRaytracer::fit(&stage.accel, options, params).unwrap_err();
        assert!(error.to_string().contains(name), "{error}");
    };
    for (options, name) in [
        (Options { grid: 0, ..small() }, "grid"),
        (Options { grid: 129, ..small() }, "grid"),
        (Options { photons: 0, ..small() }, "photons"),
        (Options { bounces: 0, ..small() }, "bounces"),
        (Options { directions: 5, ..small() }, "directions"),
        (Options { order: 5, ..small() }, "order"),
        (Options { samples: 0, ..small() }, "samples"),
        (Options { gather: Gather::Final, obscurance: Switch::On, ..small() }, "obscurance"),
        (Options { gather: Gather::Final, traverse: Traverse::Voxels, ..small() }, "traverse"),
    ] {
        refused(options, Params::default(), name);
    }
    for (params, name) in [
        (Params { reach: f32::NAN, ..Params::default() }, "reach"),
        (Params { least_area: -1.0, ..Params::default() }, "least"),
        (Params { obscurance_distance: 0.0, ..Params::default() }, "obscurance"),
    ] {
        refused(small(), params, name);
    }
}
