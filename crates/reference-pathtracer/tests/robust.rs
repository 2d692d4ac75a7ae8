//! Hard cases stay finite and right; results repeat, merge and survive storage.

mod common;

use std::sync::atomic::{AtomicU32, Ordering};

use common::*;
use glam::Vec3;
use indirect_accel::{Accel, BuildPreset};
use indirect_core::{LightKind, Mesh, Scene};
use reference_pathtracer::{
    Bounces, Components, Error, Estimate, PixelFilter, Samples, Settings, VirtualLights, render,
    render_cached, render_with,
};

#[test]
fn same_bits_on_any_number_of_threads() {
    for virtual_lights in [VirtualLights::Off, VirtualLights::On, VirtualLights::Auto] {
        let scene = room(true);
        let accel = Accel::build(&scene, BuildPreset::Balanced);
        // Batches of 40 × 30 × 128 samples are large enough for a trial.
        let s = Settings { virtual_lights, ..samples(128, 4) };
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| render(&accel, &room_view(), [40, 30], &s).unwrap())
        };
        let one = on(1);
        assert_eq!(one, on(2));
        assert_eq!(one, on(3));
        assert_eq!(one.to_bytes(), on(2).to_bytes());
        let other = render(&accel, &room_view(), [40, 30], &Settings { seed: 1, ..s }).unwrap();
        assert_ne!(one.indirect, other.indirect);
    }
}

#[test]
fn parts_merge_to_the_whole() {
    let scene = room(true);
    let accel = Accel::build(&scene, BuildPreset::Balanced);
    let s = Settings { virtual_lights: VirtualLights::On, ..samples(4, 10) };
    let of = |samples| render(&accel, &room_view(), [20, 20], &Settings { samples, ..s }).unwrap();
    let whole = of(s.samples);
    let parts: Vec<_> = (0..3).map(|i| of(s.samples.part(i, 3))).collect();
    assert_eq!(parts.iter().map(|p| p.spp).sum::<u64>(), whole.spp);
    // Any order; the gap between the first and the last is bridged at the end.
    let merged = parts[2].merge(&parts[0]).unwrap().merge(&parts[1]).unwrap();
    assert_eq!(merged.samples(), [s.samples]);
    assert_eq!(parts[2].merge(&parts[0]).unwrap().samples().len(), 2);
    // The same sums in another order: images agree to one rounding to f32.
    for (a, b) in [(&merged.indirect, &whole.indirect), (&merged.direct_variance, &whole.direct_variance)] {
        for (a, b) in a.pixels.iter().zip(&b.pixels) {
            assert!((*a - *b).abs().max_element() <= 2e-7 * a.max_element() + 1e-12, "{a} {b}");
        }
    }
    assert!((merged.mean()[1].value / whole.mean()[1].value - 1.0).abs() < 1e-12);
    let message = |r: Result<Estimate, Error>| r.unwrap_err().to_string();
    assert!(message(merged.merge(&parts[1])).contains("overlap"));
    let seeded = render(&accel, &room_view(), [20, 20], &Settings { seed: 5, ..s }).unwrap();
    assert!(message(whole.merge(&seeded)).contains("differ"));
    let batch = of(Samples { batch: 2, first: 100, batches: 1 });
    assert!(whole.merge(&batch).is_err());
    // Shares cover the whole exactly once, even when there are more machines than batches.
    for machines in [1, 3, 10, 17] {
        let shares: Vec<_> = (0..machines).map(|i| s.samples.part(i, machines)).collect();
        let mut next = 0;
        for share in shares.iter().filter(|p| p.batches > 0) {
            assert_eq!(share.first, next);
            next += share.batches;
        }
        assert_eq!(next, 10);
    }
}

/// The trial must not see the range: parts of one batch and of many, and the whole, follow the same plan.
#[test]
fn parts_merge_to_the_whole_where_a_trial_chooses() {
    let scene = room(true);
    let accel = Accel::build(&scene, BuildPreset::Balanced);
    let of = |virtual_lights, samples| {
        render(&accel, &room_view(), [40, 30], &Settings { virtual_lights, samples, ..Settings::default() })
            .unwrap()
    };
    let all = Samples { batch: 128, first: 0, batches: 6 };
    let whole = of(VirtualLights::Auto, all);
    // Else this tests nothing.
    assert_ne!(whole.indirect, of(VirtualLights::Off, all).indirect, "the trial must choose virtual lights");
    let part = |first, batches| of(VirtualLights::Auto, Samples { first, batches, ..all });
    let merged = part(0, 1).merge(&part(1, 4)).unwrap().merge(&part(5, 1)).unwrap();
    // The same sums in another order: images agree to one rounding to f32.
    for (a, b) in merged.indirect.pixels.iter().zip(&whole.indirect.pixels) {
        assert!((*a - *b).abs().max_element() <= 2e-7 * a.max_element() + 1e-12, "{a} {b}");
    }
    // A noise target is no part of the plan either.
    let target = Settings { samples: all, noise_target: Some(1e-9), ..Settings::default() };
    assert_eq!(render(&accel, &room_view(), [40, 30], &target).unwrap().indirect, whole.indirect);
}

/// One trial pixel per row, and nothing to see in the first column: even steps would look at that alone.
#[test]
fn a_trial_looks_at_the_whole_image() {
    let scene = room(true);
    let of = |virtual_lights| {
        let s = Settings { virtual_lights, components: Components::Indirect, ..samples(8, 1) };
        run(&scene, &room_view(), [256, 128], &s)
    };
    let auto = of(VirtualLights::Auto);
    assert!(auto.surface.iter().step_by(256).all(|seen| !seen));
    assert_ne!(auto.indirect, of(VirtualLights::Off).indirect);
}

#[test]
fn bytes_and_files_restore_every_bit() {
    let scene = room(false);
    let accel = Accel::build(&scene, BuildPreset::Balanced);
    let e = render(&accel, &room_view(), [9, 7], &samples(2, 3)).unwrap();
    let bytes = e.to_bytes();
    assert_eq!(Estimate::from_bytes(&bytes).unwrap(), e);
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.ref");
    e.save(&path).unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), bytes);
    assert_eq!(Estimate::load(&path).unwrap(), e);
    // Every cut and a flip of any byte is noticed.
    for n in 0..bytes.len() {
        assert!(Estimate::from_bytes(&bytes[..n]).is_err(), "cut at {n}");
        let mut flipped = bytes.clone();
        flipped[n] ^= 1 << (n % 8);
        assert!(Estimate::from_bytes(&flipped).is_err(), "flip at {n}");
    }
    assert!(matches!(Estimate::load(directory.path()), Err(Error::Io { .. })));
    assert!(matches!(e.save(&directory.path().join("no/such/folder.ref")), Err(Error::Io { .. })));
}

#[test]
fn cache_is_found_repaired_and_told_apart() {
    let directory = tempfile::tempdir().unwrap();
    let folder = directory.path().join("deep/cache");
    let scene = room(true);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let calls = AtomicU32::new(0);
    let get = |accel: &Accel<'_>, s: &Settings| {
        calls.store(0, Ordering::Relaxed);
        let e = render_cached(&folder, accel, &room_view(), [64, 9], s, &|_| {
            calls.fetch_add(1, Ordering::Relaxed);
        });
        // A hit reports its end alone.
        (e.unwrap(), calls.load(Ordering::Relaxed) > 1)
    };
    let s = samples(2, 2);
    let (first, made) = get(&accel, &s);
    assert!(made);
    let (second, made) = get(&accel, &s);
    assert!(!made && first == second);
    // Anything that changes the result changes the name.
    for other in [
        Settings { seed: 1, ..s },
        Settings { bounces: Bounces::Count(2), ..s },
        Settings { unoccluded: true, ..s },
        Settings { components: Components::Direct, ..s },
        Settings { pixel_filter: PixelFilter::Box, ..s },
        Settings { virtual_lights: VirtualLights::On, ..s },
        Settings { noise_target: Some(1e-9), ..s },
        samples(2, 3),
        samples(4, 2),
    ] {
        assert!(get(&accel, &other).1, "{other:?}");
    }
    let mut moved = scene.clone();
    moved.mesh.positions[3].x += 1e-3;
    assert!(get(&Accel::build(&moved, BuildPreset::Fast), &s).1);
    let mut painted = scene.clone();
    painted.materials[1].base_color.z = 0.5;
    assert!(get(&Accel::build(&painted, BuildPreset::Fast), &s).1);
    // Damaged files are made anew.
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        let mut bytes = std::fs::read(&path).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        std::fs::write(&path, bytes).unwrap();
    }
    let (repaired, made) = get(&accel, &s);
    assert!(made && repaired == first);
    assert!(!get(&accel, &s).1);
    // A folder that cannot be.
    let file = directory.path().join("file");
    std::fs::write(&file, b"x").unwrap();
    assert!(matches!(render_cached(&file, &accel, &room_view(), [2, 2], &s, &|_| ()), Err(Error::Io { .. })));
}

#[test]
fn stops_at_a_noise_target() {
    let scene = room(true);
    let accel = Accel::build(&scene, BuildPreset::Balanced);
    let s = Settings { noise_target: Some(0.05), ..samples(16, 1000) };
    let last = std::sync::Mutex::new(0.0);
    let e = render_with(&accel, &room_view(), [24, 24], &s, &|done| {
        let mut last = last.lock().unwrap();
        assert!((0.0..=1.0).contains(&done));
        *last = f64::max(*last, done);
    })
    .unwrap();
    assert_eq!(*last.lock().unwrap(), 1.0);
    assert!(
        e.noise().iter().all(|n| *n <= 0.05) && e.spp < 16_000 && e.spp >= 64,
        "{} {:?}",
        e.spp,
        e.noise()
    );
    // Not a batch sooner than the looks allow, and deterministic.
    assert_eq!(render(&accel, &room_view(), [24, 24], &s).unwrap(), e);
    let tight = Settings { noise_target: Some(1e-6), ..samples(1, 6) };
    assert_eq!(render(&accel, &room_view(), [24, 24], &tight).unwrap().spp, 6);
}

#[test]
fn bad_settings_are_refused() {
    let scene = floor(1.0, 0.5);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let with = |size, s: Settings| render(&accel, &room_view(), size, &s);
    for size in [[0, 4], [4, 0], [u32::MAX, u32::MAX]] {
        assert!(matches!(with(size, samples(1, 1)), Err(Error::Size { .. })));
    }
    for s in [
        samples(0, 1),
        samples(1, 0),
        samples(1 << 20, 1 << 20),
        Settings { samples: Samples { batch: 1, first: u32::MAX, batches: 2 }, ..Settings::default() },
        Settings { noise_target: Some(0.0), ..samples(1, 1) },
        Settings { noise_target: Some(f64::NAN), ..samples(1, 1) },
        Settings { roulette: false, ..samples(1, 1) },
        Settings { samples: Samples::count(8).part(9, 9), ..Settings::default() },
    ] {
        assert!(matches!(with([2, 2], s), Err(Error::Settings { .. })), "{s:?}");
    }
    for spp in [0, 1, 7, 8, 9, 100, 4096, u32::MAX] {
        let s = Samples::count(spp);
        assert!(s.spp() >= u64::from(spp) && s.spp() <= u64::from(spp) * 9 / 8 + 1, "{spp} {s:?}");
    }
}

fn assert_sane(what: &str, e: &Estimate) {
    assert_eq!(
        e.direct.non_finite()
            + e.indirect.non_finite()
            + e.direct_variance.non_finite()
            + e.indirect_variance.non_finite(),
        0,
        "{what}"
    );
    for image in [&e.direct, &e.indirect, &e.direct_variance, &e.indirect_variance] {
        assert!(image.pixels.iter().all(|p| p.min_element() >= 0.0), "{what}");
    }
}

#[test]
fn hard_scenes_stay_finite() {
    let on_the_floor = LightKind::Point { position: Vec3::ZERO };
    let in_the_box = LightKind::Point { position: Vec3::new(0.35, -0.7, 0.35) };
    let down = LightKind::Directional { direction: Vec3::NEG_Y };
    let grazing = LightKind::Directional { direction: Vec3::new(-1.0, -1e-7, 0.0).normalize() };
    let lit = |mut scene: Scene, kinds: &[LightKind]| {
        scene.lights.extend(kinds.iter().map(|k| light(*k, 1.0)));
        scene
    };
    let with_albedo = |albedo: f32| {
        let mut scene = room(true);
        for m in &mut scene.materials {
            m.base_color = Vec3::splat(albedo);
        }
        scene
    };
    let mut degenerate = room(true);
    let n = degenerate.mesh.positions.len() as u32;
    degenerate.mesh.triangles.extend([[0, 0, 0], [0, 1, 1], [n - 1, n - 1, n - 2]]);
    degenerate.mesh.materials.extend([3, 3, 3]);
    let mut doubled = room(true);
    doubled.mesh.triangles.extend_from_within(..);
    doubled.mesh.materials.extend_from_within(..);
    let scenes = [
        ("nothing", Scene::default()),
        ("no triangles", lit(Scene::default(), &[on_the_floor, down])),
        ("no light", floor(1.0, 0.5)),
        (
            "light in a surface",
            lit(room(true), &[on_the_floor, in_the_box, LightKind::Point { position: Vec3::Y }]),
        ),
        ("flat scene, grazing light", lit(floor(1.0, 1.0), &[grazing, on_the_floor])),
        ("albedo 0", with_albedo(0.0)),
        ("albedo 1", lit(with_albedo(1.0), &[on_the_floor])),
        ("degenerate triangles", degenerate),
        ("every triangle twice", doubled),
        ("one emitting plane", {
            let mut s = floor(1.0, 0.5);
            s.materials = vec![emitter(0.5, 1.0)];
            s
        }),
        ("no positions used", Scene { mesh: Mesh::default(), ..room(false) }),
    ];
    for (name, scene) in &scenes {
        for virtual_lights in [VirtualLights::Off, VirtualLights::On] {
            for unoccluded in [false, true] {
                for pixel_filter in [PixelFilter::Center, PixelFilter::Box] {
                    let s = Settings {
                        virtual_lights,
                        unoccluded,
                        pixel_filter,
                        bounces: Bounces::Count(8),
                        ..samples(4, 2)
                    };
                    assert_sane(name, &run(scene, &room_view(), [12, 12], &s));
                }
            }
        }
    }
    // Black walls send nothing on; a scene without light is black.
    assert_eq!(run(&scenes[5].1, &room_view(), [8, 8], &samples(4, 2)).mean()[1].value, 0.0);
    assert_eq!(run(&scenes[2].1, &room_view(), [8, 8], &samples(4, 2)).mean()[0].value, 0.0);
}

/// Lengths scaled by s and intensities by s² give the same picture, from a millimetre scene to a 100 km one, and so does a
/// shift of the origin by the scene's size.
#[test]
fn scale_does_not_matter() {
    let reference = run(&room(false), &room_view(), [16, 16], &samples(32, 16)).mean();
    for scale in [1e-3_f32, 1e5] {
        let (mut scene, mut view) = (room(false), room_view());
        for p in &mut scene.mesh.positions {
            *p *= scale;
        }
        for l in &mut scene.lights {
            l.power *= scale * scale;
            if let LightKind::Spot { position, .. } = &mut l.kind {
                *position *= scale;
            }
        }
        view.origin *= scale;
        view.near *= scale;
        let scaled = run(&scene, &view, [16, 16], &samples(32, 16)).mean();
        // The same random numbers; only rounding differs, which may turn single rays.
        for k in 0..2 {
            assert!(
                (scaled[k].value / reference[k].value - 1.0).abs() < 0.01,
                "{scale} {scaled:?} {reference:?}"
            );
        }
    }
}

/// A light that sits exactly in a closed ceiling lights the room below and not the room above.
#[test]
fn a_light_in_the_ceiling_lights_one_side() {
    let mut scene = floor(1.0, 0.5);
    scene.mesh.push_polygon(&rectangle(Vec3::Y, Vec3::X, Vec3::Z), 0);
    scene.lights.push(light(LightKind::Point { position: Vec3::Y }, 4.0));
    let view = onto(Vec3::ZERO, Vec3::NEG_Y, Vec3::NEG_Z, 0.01, 0.1);
    let e = run(&scene, &view, [1, 1], &samples(1, 1));
    let expected = 0.5 / core::f32::consts::PI * 4.0;
    assert!((e.direct.pixels[0].x / expected - 1.0).abs() < 1e-3, "{}", e.direct.pixels[0]);
}
