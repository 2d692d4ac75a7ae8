//! Degenerate input: finite, bounded, without seams, and the same at any scale.
#![cfg(feature = "cpu")]
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use common::{
    camera_view, floor_and_wall, lattice, light, lights, one_bounce, push_square, room, scaled, setup, spot,
    two_volumes,
};
use glam::{Mat3, Vec3, Vec4};
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::settings::{BadOption, Settings};
use indirect_core::{Aabb, LightKind, Material, Scene};
use indirect_filter::Reduced;
use radiance_hints::{
    Lattice, Options, Order, Output, Params, RadianceHints, Reconstruction, Sampling, Scale, Surround,
    Transport, Visibility,
    cpu::{self, Fit, Samples},
};

fn options() -> Options {
    Options { resolution: 32, samples: 20, bounce_samples: 8, ..one_bounce() }
}

fn render(scene: &Scene, scale: f32, lattice: &Lattice, options: Options, params: Params) -> Output {
    let accel = Accel::build(scene, BuildPreset::Fast);
    let view = camera_view(scale);
    let camera = cast::gbuffer(&accel, &view, [24, 16]);
    let setup = setup(lattice, options, params);
    let output = cpu::indirect(&cpu::Frame::new(&accel, &view, &camera, &setup)).unwrap();
    assert_eq!(output.image.non_finite(), 0);
    assert!(output.image.pixels.iter().all(|p| p.min_element() >= 0.0));
    assert!(output.bounces.iter().flatten().all(|c| c.is_finite()));
    output
}

/// The author's shader has 0.1 and 0.007 in it; nothing here may depend on the metre.
#[test]
fn the_image_does_not_depend_on_the_scale() {
    for kind in lights() {
        let image = |s: f32| {
            let mut scene = floor_and_wall(scaled(kind, s), s);
            if !matches!(kind, LightKind::Directional { .. }) {
                // The same irradiance at s times the distance.
                scene.lights[0].power *= s * s;
            }
            let options =
                Options { bounces: 3, scale: Scale::Half, visibility: Visibility::RsmDepth, ..options() };
            render(&scene, s, &lattice(&scene, 6), options, Params::default()).image
        };
        let one = image(1.0);
        let mean = one.mean().max_element();
        assert!(mean > 0.0);
        for s in [0.01, 0.3, 10.0, 1000.0] {
            let other = image(s);
            let difference: f32 =
                one.pixels.iter().zip(&other.pixels).map(|(a, b)| (*a - *b).abs().max_element()).sum();
            // Rounding may move a sample to the next texel or a grazing segment to the other side of one.
            assert!(difference / one.pixels.len() as f32 <= 5e-3 * mean, "{kind:?} {s}: {difference}");
        }
    }
}

#[test]
fn degenerate_scenes_and_options_stay_finite() {
    let floor = |kind| floor_and_wall(kind, 1.0);
    let mut scenes = vec![
        floor(LightKind::Point { position: Vec3::ZERO }),
        floor(spot(Vec3::Y, Vec3::NEG_Y, 0.0, 0.0)),
        floor(spot(Vec3::Y, Vec3::NEG_Y, 90.0, 90.0)),
        floor(LightKind::Directional { direction: Vec3::X }),
        floor(LightKind::Point { position: Vec3::splat(1e6) }),
        floor(spot(Vec3::Y * 3.0, Vec3::Y, 10.0, 20.0)),
        room(Vec3::ONE, 0.3),
    ];
    // A floor and nothing else: a box without height.
    let mut plane = Scene { materials: vec![Material::diffuse("white", Vec3::ONE)], ..Scene::default() };
    push_square(&mut plane, Vec3::ZERO, 2.0, Mat3::IDENTITY);
    plane.lights.push(light(lights()[0], Vec3::ONE));
    scenes.push(plane);
    let printed = Params {
        reconstruct: Reconstruction::AsPrinted,
        footprint: 0.0,
        jitter: 1.0,
        range: 0.1,
        disc: 0.2,
        ..Params::default()
    };
    for scene in &scenes {
        for cells in [1, 2, 5] {
            let lattice = lattice(scene, cells);
            for visibility in [Visibility::Off, Visibility::RsmDepth, Visibility::CameraDepth] {
                for sampling in [Sampling::Nearby, Sampling::Importance, Sampling::Disc] {
                    let more = Options { visibility, sampling, bounces: 3, resolution: 9, ..options() };
                    render(scene, 1.0, &lattice, more, Params { disc: 0.2, ..Params::default() });
                    let transport = Transport::SphereAsPrinted;
                    let more = Options { order: Order::Two, scale: Scale::Quarter, transport, ..more };
                    render(scene, 1.0, &lattice, more, printed);
                    let sphere = Options { transport: Transport::Sphere, samples: 1, resolution: 1, ..more };
                    render(scene, 1.0, &lattice, sphere, printed);
                }
            }
        }
    }
}

#[test]
fn without_light_it_is_black() {
    let mut dark = floor_and_wall(lights()[0], 1.0);
    dark.lights.clear();
    let mut black = floor_and_wall(lights()[0], 1.0);
    black.materials[0].base_color = Vec3::ZERO;
    for scene in [dark, black] {
        for sampling in [Sampling::Nearby, Sampling::Importance, Sampling::Disc] {
            let options = Options { bounces: 2, sampling, ..options() };
            let output = render(&scene, 1.0, &lattice(&scene, 4), options, Params::default());
            assert!(output.image.pixels.iter().all(|p| *p == Vec3::ZERO));
        }
    }
}

#[test]
fn results_repeat_bit_for_bit_on_any_number_of_threads() {
    let scene = floor_and_wall(lights()[1], 1.0);
    let options = Options { bounces: 3, visibility: Visibility::RsmDepth, scale: Scale::Half, ..options() };
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&scene, 1.0, &two_volumes(&scene), options, Params::default()))
    };
    let (one, three) = (run(1), run(3));
    assert_eq!(one.image, three.image);
    assert_eq!(one.bounces, three.bounces);
    assert_eq!(one.blocked, three.blocked);
}

/// A uniform field is reproduced anywhere, inside, at borders and outside, and a line across a border has no step.
#[test]
fn volumes_blend_without_a_seam() {
    let scene = floor_and_wall(lights()[0], 1.0);
    let lattice = two_volumes(&scene);
    let uniform: Vec<Vec4> = (0..lattice.hints()).flat_map(|_| [Vec4::X; 3]).collect();
    let bumpy: Vec<Vec4> = (0..lattice.hints()).flat_map(|i| [Vec4::X * (i * 7 % 11) as f32; 3]).collect();
    let at = |hints: &[Vec4], p: Vec3| {
        let field = cpu::Field { lattice: &lattice, order: Order::Two, hints };
        cpu::irradiance(&field, p, Vec3::Y, Reconstruction::NearSurface).x
    };
    let flat = at(&uniform, Vec3::ZERO);
    let (mut last, mut steepest) = (None::<f32>, 0.0_f32);
    let steps = 20_000;
    for i in 0..=steps {
        let t = i as f32 / steps as f32;
        let p = Vec3::new(-3.0, -0.5, -2.5) + Vec3::new(6.0, 5.0, 5.0) * t;
        assert!((at(&uniform, p) / flat - 1.0).abs() < 1e-5, "{p}");
        let now = at(&bumpy, p);
        if let Some(before) = last {
            steepest = steepest.max((now - before).abs());
        }
        last = Some(now);
    }
    // 11 units of the field over a quarter of the finer cell, a hundred steps or more: a seam would be a step of units.
    assert!(steepest < 0.5, "{steepest}");
}

/// Hints behind a surface, dark or bright, do not show on its front.
#[test]
fn hints_behind_the_receiver_do_not_count() {
    let lattice = Lattice::new(&Aabb { min: Vec3::ZERO, max: Vec3::ONE }, [8; 3]).unwrap();
    let value = |i: u32| if lattice.position(i).y < 0.5 { 1e4 } else { 1.0 };
    let hints: Vec<Vec4> = (0..lattice.hints()).flat_map(|i| [Vec4::X * value(i); 3]).collect();
    let field = cpu::Field { lattice: &lattice, order: Order::Two, hints: &hints };
    let e = |y: f32, form| cpu::irradiance(&field, Vec3::new(0.4, y, 0.6), Vec3::Y, form).x;
    let alone = e(0.9, Reconstruction::NearSurface);
    // A wall at 0.5 with hints 1/16 to either side.
    let beside = e(0.5, Reconstruction::NearSurface);
    // They keep a share of 1e-7, for where there are no others: 1e4 times that, and rounding.
    assert!((beside / alone - 1.0).abs() < 2e-3, "{beside} {alone}");
}

/// Two rooms without a door: what arrives behind the wall, as a share of what arrives before it.
#[test]
fn light_does_not_leak_through_a_lit_wall() {
    let mut scene =
        Scene { materials: vec![Material::diffuse("white", Vec3::splat(0.7))], ..Scene::default() };
    let mut quad = |c: [[f32; 3]; 4]| scene.mesh.push_polygon(&c.map(Vec3::from), 0);
    let (w, h, d, t) = (3.0, 2.5, 1.5, 0.02);
    quad([[-w, 0.0, d], [w, 0.0, d], [w, 0.0, -d], [-w, 0.0, -d]]);
    quad([[-w, h, d], [-w, h, -d], [w, h, -d], [w, h, d]]);
    quad([[-w, 0.0, -d], [w, 0.0, -d], [w, h, -d], [-w, h, -d]]);
    quad([[-w, 0.0, d], [-w, h, d], [w, h, d], [w, 0.0, d]]);
    quad([[-w, 0.0, d], [-w, 0.0, -d], [-w, h, -d], [-w, h, d]]);
    quad([[w, 0.0, d], [w, h, d], [w, h, -d], [w, 0.0, -d]]);
    quad([[-t, 0.0, d], [-t, h, d], [-t, h, -d], [-t, 0.0, -d]]);
    quad([[t, 0.0, d], [t, 0.0, -d], [t, h, -d], [t, h, d]]);
    scene.lights.push(light(
        LightKind::Spot {
            position: Vec3::new(-2.6, 1.25, 0.0),
            direction: Vec3::X,
            inner_angle: 0.3,
            outer_angle: 0.75,
        },
        Vec3::splat(20.0),
    ));
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let lattice = Lattice::fit(&scene.bounds().unwrap(), 4096).unwrap();
    let camera = cast::gbuffer(&accel, &camera_view(1.0), [2, 2]);
    let leak = |visibility, reconstruction, jitter, bounces, stopped| {
        let options = Options { resolution: 256, visibility, bounces, ..Options::default() };
        let rsm = rsm::cpu::generate(&accel, 256).unwrap();
        let enclosure = (bounces > 1).then(|| cpu::enclosure(&accel, &scene.bounds().unwrap(), &rsm));
        let draw = setup(&lattice, options, Params::default()).draw();
        let (lists, near) = (cpu::sample(&rsm, &lattice, &draw), cpu::near(&rsm, &lattice, &draw));
        let samples = Samples { draw, lists: &lists, near: &near };
        let seen = (&camera_view(1.0), &camera);
        let blocked = cpu::occlusion(&rsm, seen, &lattice, &samples, visibility, jitter);
        let shape = (jitter, Params::default().footprint);
        let first = cpu::estimate(&lattice, &samples, &blocked, options.order, shape, bounces > 1);
        let directions = cpu::Directions { count: options.bounce_samples, seed: 0, range: 1.0, enclosure };
        let stops = if stopped { cpu::stops(&rsm, &lattice, &directions) } else { Vec::new() };
        let hints = (2..=bounces).fold(first.hints.clone(), |last, number| {
            let last = cpu::Field { lattice: &lattice, order: options.order, hints: &last };
            let transport = Transport::Directions;
            cpu::bounce(&last, &first.hints, &first.surroundings, &stops, &directions, transport, number)
        });
        let field = cpu::Field { lattice: &lattice, order: options.order, hints: &hints };
        // Floor, ceiling, end wall and the wall's own two sides.
        let room = |side: f32| {
            let mut sum = 0.0;
            for i in 0..15 {
                for k in 0..15 {
                    let (u, v) = ((i as f32 + 0.5) / 15.0, (k as f32 + 0.5) / 15.0);
                    let z = 2.0 * d * v - d;
                    let mut add = |p: Vec3, n: Vec3| sum += cpu::irradiance(&field, p, n, reconstruction).x;
                    add(Vec3::new(side * (t + (w - t) * u), 0.0, z), Vec3::Y);
                    add(Vec3::new(side * (t + (w - t) * u), h, z), Vec3::NEG_Y);
                    add(Vec3::new(side * w, h * u, z), Vec3::X * -side);
                    add(Vec3::new(side * t, h * u, z), Vec3::X * side);
                }
            }
            sum
        };
        room(1.0) / room(-1.0)
    };
    let printed = leak(Visibility::Off, Reconstruction::AsPrinted, 1.0, 1, true);
    let off = leak(Visibility::Off, Reconstruction::NearSurface, 0.5, 1, true);
    let ours = leak(Visibility::RsmDepth, Reconstruction::NearSurface, 0.5, 1, true);
    let still = leak(Visibility::RsmDepth, Reconstruction::NearSurface, 0.0, 1, true);
    let later = leak(Visibility::RsmDepth, Reconstruction::NearSurface, 0.0, 3, true);
    let through = leak(Visibility::RsmDepth, Reconstruction::NearSurface, 0.0, 3, false);
    println!("leak of three bounces: {later:.4}, were the way to the border always open {through:.4}");
    // Their directions end where the maps see the wall.
    assert!(later < 0.01 && later < 0.1 * through, "{later} {through}");
    println!(
        "leak: as printed {printed:.4}, without visibility {off:.4}, by the maps' depth {ours:.4}, from the hints' centres {still:.4}"
    );
    // What is left are pixels beside the wall, within a third of a diagonal of a cell of 0.2 m in rooms of 3 m, that read hints
    // of both sides. Jitter adds hints that look from both sides of the wall they are in.
    assert!(
        still < 0.01 && ours < 0.015 && still < ours && ours < 0.3 * off,
        "{printed} {off} {ours} {still}"
    );
}

/// Half resolution on a plane is a linear interpolation; where nothing speaks for a pixel it reads the field itself.
#[test]
fn upsampling_keeps_planes_and_edges() {
    let scene = floor_and_wall(lights()[0], 1.0);
    let lattice = lattice(&scene, 8);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let view = camera_view(1.0);
    let camera = cast::gbuffer(&accel, &view, [96, 64]);
    let full = |scale| {
        let options = Options { resolution: 64, scale, ..options() };
        let setup = setup(&lattice, options, Params::default());
        cpu::indirect(&cpu::Frame::new(&accel, &view, &camera, &setup)).unwrap()
    };
    let truth = full(Scale::Full).irradiance;
    let mean = truth.iter().sum::<Vec3>().x / truth.len() as f32;
    let error = |scale| {
        let found = full(scale);
        assert_eq!(found.low.len(), Reduced::new([96, 64], scale.step()).texels() as usize);
        let error: f32 = truth.iter().zip(&found.irradiance).map(|(a, b)| (*a - *b).abs().x).sum();
        error / truth.len() as f32 / mean
    };
    let (half, quarter) = (error(Scale::Half), error(Scale::Quarter));
    println!("mean error at half resolution {half:.4}, at a quarter {quarter:.4}");
    // A cell is some ten pixels wide; linear interpolation over two of them errs by a hundredth, over four by four times that.
    assert!(half < 0.015 && quarter < 5.0 * half, "{half} {quarter}");
}

#[test]
fn bad_options_name_themselves() {
    let name = |e: Result<(), BadOption>| e.unwrap_err().option;
    let (o, p) = (options(), Params::default());
    assert_eq!(name(Options { resolution: 0, ..o }.validate()), "resolution");
    assert_eq!(name(Options { samples: 1025, ..o }.validate()), "samples");
    assert_eq!(name(Options { bounces: 0, ..o }.validate()), "bounces");
    assert_eq!(name(Options { smoothing: 1.0, ..o }.validate()), "smoothing");
    for disc in [0.0, 1.5, f32::NAN] {
        assert_eq!(name(Params { disc, ..p }.validate()), "disc");
    }
    assert_eq!(name(Params { range: 0.0, ..p }.validate()), "range");
    // Nothing runs with them.
    let scene = floor_and_wall(lights()[0], 1.0);
    let (accel, view) = (Accel::build(&scene, BuildPreset::Fast), camera_view(1.0));
    let camera = cast::gbuffer(&accel, &view, [2, 2]);
    let bad = setup(&lattice(&scene, 2), Options { bounces: 0, ..o }, p);
    assert!(cpu::indirect(&cpu::Frame::new(&accel, &view, &camera, &bad)).is_err());
    assert!(RadianceHints::fit(&accel, o, Params { jitter: 2.0, ..p }).is_err());
    let unit = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
    let lattice = |r: Result<Lattice, BadOption>| name(r.map(|_| ()));
    assert_eq!(lattice(Lattice::new(&unit, [0, 1, 1])), "resolution");
    assert_eq!(lattice(Lattice::new(&unit, [1 << 12, 1 << 12, 2])), "resolution");
    assert_eq!(lattice(Lattice::fit(&unit, 0)), "hints");
    assert_eq!(lattice(Lattice::of([])), "volumes");
    assert_eq!(lattice(Lattice::new(&Aabb { min: Vec3::ONE, max: Vec3::ONE }, [1; 3])), "bounds");
    assert_eq!(lattice(Lattice::new(&Aabb { min: Vec3::NAN, max: Vec3::ONE }, [1; 3])), "bounds");
}

#[test]
fn a_budget_chooses_the_resolution() {
    for (extent, hints) in [
        (Vec3::new(1.0, 1.0, 1.0), 4096),
        (Vec3::new(30.0, 12.0, 18.0), 4096),
        (Vec3::new(1000.0, 1.0, 1000.0), 1000),
        (Vec3::new(5.0, 0.0, 5.0), 512),
        (Vec3::splat(1e-3), 1),
    ] {
        let lattice = Lattice::fit(&Aabb { min: Vec3::ONE, max: Vec3::ONE + extent }, hints).unwrap();
        // A flat box gets a second layer.
        assert!(
            lattice.hints() <= 2 * hints && 3 * lattice.hints() >= hints,
            "{extent}: {}",
            lattice.hints()
        );
        let volume = lattice.volumes()[0];
        // Edges of an axis that is divided; one that is not may be short.
        let edges = (0..3).filter(|a| volume.resolution[*a] > 1).map(|a| volume.cell[a]);
        let (least, most) = edges.fold((f32::MAX, 0.0_f32), |(l, m), e| (l.min(e), m.max(e)));
        assert!(most < 2.1 * least || most == 0.0, "{extent}: {}", volume.cell);
    }
    let cube = Lattice::fit(&Aabb { min: Vec3::ZERO, max: Vec3::ONE }, 4096).unwrap();
    assert_eq!(cube.hints(), 4096);
}

/// What the scene decides is the technique's business: as many hints as asked for, spread over the bounds, and what
/// surrounds them only where a later bounce asks for it; also for a scene without anything.
#[test]
fn a_setup_is_fitted_to_the_scene() {
    let scene = room(Vec3::splat(0.6), 2.0);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let fit = |options| RadianceHints::fit(&accel, options, Params::default()).unwrap();
    let setup = fit(Options { lattice: 5, ..Options::default() });
    assert_eq!(setup.lattice.hints(), 125);
    let around = setup.enclosure.unwrap();
    // Of a closed room the faces are the walls.
    for face in 0..6 {
        assert!((around.albedo[face] - 0.6).abs().max_element() < 1e-5, "{around:?}");
        assert!((around.depth[face] - 1.0).abs() < 1e-3, "{around:?}");
    }
    for options in [
        Options { bounces: 1, ..Options::default() },
        Options { enclosure: Surround::Maps, ..Options::default() },
        Options { transport: Transport::Sphere, ..Options::default() },
    ] {
        assert_eq!(fit(options).enclosure, None);
    }
    let nothing = Scene::default();
    let accel = Accel::build(&nothing, BuildPreset::Fast);
    let setup = RadianceHints::fit(&accel, options(), Params::default()).unwrap();
    let view = camera_view(1.0);
    let camera = cast::gbuffer(&accel, &view, [3, 2]);
    let output = cpu::indirect(&cpu::Frame::new(&accel, &view, &camera, &setup)).unwrap();
    assert_eq!(output.image.mean(), Vec3::ZERO);
}

/// A frame that follows another is blended with it, and the first stands alone.
#[test]
fn smoothing_looks_back_at_the_frame_before() {
    let scene = floor_and_wall(lights()[0], 1.0);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let view = camera_view(1.0);
    let camera = cast::gbuffer(&accel, &view, [24, 16]);
    let mut setup = setup(&lattice(&scene, 5), Options { smoothing: 0.5, ..options() }, Params::default());
    let mut output = Output::default();
    let mut frame = |seed| {
        setup.params.seed = seed;
        indirect_technique::cpu::run::<RadianceHints>(
            &cpu::Frame::new(&accel, &view, &camera, &setup),
            &mut output,
        );
        (output.irradiance.clone(), output.history.as_ref().unwrap().irradiance())
    };
    let (first, smoothed) = frame(1);
    assert_eq!(first, smoothed);
    let (second, smoothed) = frame(2);
    for i in (0..camera.len()).filter(|i| camera.is_surface(*i)) {
        // The camera stands still: a pixel finds itself, up to the rounding of its projection.
        let mean = (first[i] + second[i]) * 0.5;
        let apart = (smoothed[i] - mean).abs().max_element();
        assert!(apart <= 1e-3 * mean.max_element(), "{i}: {} {mean}", smoothed[i]);
    }
    assert_ne!(second, smoothed);
}
