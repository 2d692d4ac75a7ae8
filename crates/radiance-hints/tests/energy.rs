//! The passes against closed forms, brute force and energy balances.
#![cfg(feature = "cpu")]
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use core::f32::consts::PI;

use common::{camera_view, floor_and_wall, lattice, light, lights, one_bounce, room, setup, spot};
use glam::{DVec3, Vec3, Vec4};
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::{Aabb, math::luminance};
use indirect_filter::Reduced;
use indirect_scene::fixtures::SphereFurnace;
use radiance_hints::{
    Draw, Enclosure, Lattice, Near, Options, Order, Params, Reconstruction, Sample, Sampling, Surroundings,
    Transport,
    cpu::{self, Samples},
};

/// `√4π`: what a coefficient `L_00` is multiplied by for the integral over all directions.
const ROOT: f32 = 3.544_907_7;

fn one_hint() -> Lattice {
    Lattice::new(&Aabb { min: Vec3::splat(-0.5), max: Vec3::splat(0.5) }, [1; 3]).unwrap()
}

/// What one hint at the origin sees of one patch.
fn see(patch: Sample, footprint: f32) -> Vec<Vec4> {
    let draw = Draw { sampling: Sampling::Nearby, disc: 1.0, samples: 1, seed: 0 };
    let samples = Samples { draw, lists: &vec![patch; 64], near: &Near::default() };
    cpu::estimate(&one_hint(), &samples, &[], Order::Three, (0.0, footprint), false).hints
}

/// Eq. 2–4 with unit vectors: `Φ cosθ/(πd²)`; the printed unnormalised product would grow with the distance.
#[test]
fn one_patch_matches_the_closed_form() {
    for d in [0.1_f32, 1.0, 30.0] {
        for tilt in [0.0_f32, 0.7, 1.4] {
            let normal = Vec3::new(tilt.sin(), -tilt.cos(), 0.0);
            let flux = Vec3::new(2.0, 1.0, 0.25);
            let patch = Sample { position: Vec3::Y * d, normal, flux, area: 1e-6, ..Sample::default() };
            let hints = see(patch, 0.0);
            let exact = flux * tilt.cos() / (PI * d * d);
            let found = Vec3::new(hints[0].x, hints[1].x, hints[2].x) * ROOT;
            // A dozen f32 operations, 2⁻²⁴ each, and the cosine's own conditioning at 1.4 rad.
            assert!((found - exact).abs().max_element() < 1e-5 * exact.x, "{d} {tilt}: {found} {exact}");
            // Towards the patch, Σ A_l (2l+1)/4π = 1/4 + 1/2 + 5/16: what l ≤ 2 makes of a point, 1.0625.
            let field = cpu::Field { lattice: &one_hint(), order: Order::Three, hints: &hints };
            let e = cpu::irradiance(&field, Vec3::ZERO, Vec3::Y, Reconstruction::AsPrinted);
            assert!((e - 1.0625 * exact).abs().max_element() < 1e-5 * exact.x, "{e} {exact}");
        }
    }
}

/// A disc of radius `R` on the axis, of radiance `B/π`: `∫L = 2B(1 − cosα)`, and its first band points at it with
/// `∫L cos = B sin²α`.
#[test]
fn a_near_patch_is_a_disc() {
    let (radius, radiosity) = (0.3_f32, 2.0_f32);
    let area = PI * radius * radius;
    for d in [0.01_f32, 0.1, 0.3, 1.0, 10.0] {
        let flux = Vec3::splat(radiosity * area);
        let patch = Sample { position: Vec3::Y * d, normal: Vec3::NEG_Y, flux, area, ..Sample::default() };
        let hints = see(patch, 1.0);
        let cos = d / (d * d + radius * radius).sqrt();
        let exact = 2.0 * radiosity * (radius * radius / (d * d + radius * radius)) / (1.0 + cos);
        assert!((hints[0].x * ROOT / exact - 1.0).abs() < 1e-5, "{d}");
        // L_1,−1 = ∫ L Y, Y = √(3/4π) y.
        let first = hints[0].y / (3.0 / (4.0 * PI)).sqrt();
        let exact = radiosity * (1.0 - cos * cos);
        assert!((first / exact - 1.0).abs() < 1e-4, "{d}: {first} {exact}");
    }
}

/// Mean and standard error over seeds of the light that arrives at a hint, against the sum over the texels that the samples
/// stand for.
fn check_mean(sampling: Sampling, hint: u32) {
    let mut scene = floor_and_wall(spot(Vec3::new(0.2, 3.0, 0.3), Vec3::NEG_Y, 20.0, 35.0), 1.0);
    scene
        .lights
        .push(light(spot(Vec3::new(-1.0, 2.0, 1.0), Vec3::new(0.3, -1.0, -0.8), 10.0, 30.0), Vec3::X));
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let disc = 0.3;
    let rsm = rsm::cpu::generate(&accel, 64).unwrap();
    let lattice = Lattice::new(&scene.bounds().unwrap(), [3; 3]).unwrap();
    let p = lattice.position(hint);
    let mut exact = DVec3::ZERO;
    for map in &rsm.maps {
        for (i, t) in map.texels.iter().enumerate() {
            if sampling == Sampling::Disc {
                let (centre, _) = map.view.project(p, [1, 1]).unwrap();
                let at = glam::Vec2::new((i % 64) as f32 + 0.5, (i / 64) as f32 + 0.5) / 64.0;
                if (at - centre).length() > (disc / PI).sqrt() {
                    continue;
                }
            }
            let v = (map.surface.position[i] - p).as_dvec3();
            let cosine = -map.surface.normal[i].as_dvec3().dot(v.normalize());
            exact += t.reflected.as_dvec3() * cosine.max(0.0) / v.length_squared() / core::f64::consts::PI;
        }
    }
    let seeds = 400;
    let found: Vec<DVec3> = (0..seeds)
        .map(|seed| {
            let draw = Draw { sampling, disc, samples: 24, seed };
            let samples = cpu::sample(&rsm, &lattice, &draw);
            let near = cpu::near(&rsm, &lattice, &draw);
            let closely = near.windows.get(hint as usize).is_some_and(|w| w.first != w.end);
            assert_eq!(closely, sampling == Sampling::Nearby, "hint {hint} has a window");
            let samples = Samples { draw, lists: &samples, near: &near };
            let hints = cpu::estimate(&lattice, &samples, &[], Order::Three, (0.0, 0.0), false).hints;
            let at = hint as usize * 7;
            Vec3::new(hints[at].x, hints[at + 1].x, hints[at + 2].x).as_dvec3() * f64::from(ROOT)
        })
        .collect();
    let n = f64::from(seeds);
    let mean = found.iter().sum::<DVec3>() / n;
    let variance = found.iter().map(|x| (*x - mean) * (*x - mean)).sum::<DVec3>() / (n - 1.0);
    let error = DVec3::new(variance.x.sqrt(), variance.y.sqrt(), variance.z.sqrt()) / n.sqrt();
    println!("{sampling:?}: {mean} ± {error}, exact {exact}");
    // Three standard errors; 1e-3 where a disc's rim cuts texels that the sum takes whole: its radius is some 30 texels.
    let slack = if sampling == Sampling::Disc { 3e-3 } else { 1e-5 };
    for c in 0..3 {
        assert!((mean[c] - exact[c]).abs() < 3.0 * error[c] + slack * exact[c], "{mean} {exact} {error}");
    }
}

#[test]
fn importance_samples_stand_for_every_texel() {
    // In the middle, away from every surface, and half a cell above the floor.
    check_mean(Sampling::Importance, 13);
    check_mean(Sampling::Importance, 10);
}

#[test]
fn windows_and_lists_together_stand_for_every_texel() {
    check_mean(Sampling::Nearby, 10);
}

/// Eq. 4's `M/N_s` would be too bright by `1/c`.
#[test]
fn disc_samples_stand_for_the_texels_of_the_disc() {
    check_mean(Sampling::Disc, 13);
}

#[test]
fn lists_carry_the_flux_of_the_maps_shared_by_power() {
    let mut scene = floor_and_wall(lights()[1], 1.0);
    scene.lights.push(light(lights()[0], Vec3::splat(0.4)));
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let rsm = rsm::cpu::generate(&accel, 32).unwrap();
    let draw = Draw { sampling: Sampling::Nearby, disc: 1.0, samples: 64, seed: 3 };
    let samples = cpu::sample(&rsm, &lattice(&scene, 4), &draw);
    let total = luminance(rsm.reflected().as_vec3());
    for list in samples.chunks(64) {
        // Every sample carries the same luminance, so each list carries all of it.
        let sum: f32 = list.iter().map(|s| luminance(s.flux)).sum();
        assert!((sum / total - 1.0).abs() < 1e-3, "{sum} {total}");
        assert!(list.iter().all(|s| s.flux.max_element() > 0.0), "a sample was spent on an unlit texel");
        for (i, map) in rsm.maps.iter().enumerate() {
            let share = luminance(map.reflected().as_vec3()) / total * 64.0;
            let count = list.iter().filter(|s| s.map == i as u32).count() as f32;
            // 64 points of a (0, m, 2)-net: an interval holds its share to within one at either end.
            assert!((count - share).abs() <= 2.0, "map {i}: {count} of {share}");
        }
    }
}

/// A finer box within a room changes where light is read, not how much there is: its border is no wall, and its hints take
/// later bounces from the room's border as those around it do.
#[test]
fn a_box_within_a_room_is_no_room() {
    let scene = room(Vec3::splat(0.5), 1.0);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let bounds = scene.bounds().unwrap();
    let inner = Aabb { min: Vec3::splat(-0.5), max: Vec3::splat(0.5) };
    let options = Options { resolution: 64, samples: 400, bounces: 3, bounce_samples: 256, ..one_bounce() };
    let middle = |lattice: &Lattice| {
        let (view, setup) = (camera_view(1.0), setup(lattice, options, Params::default()));
        let camera = cast::gbuffer(&accel, &view, [1, 1]);
        let found = cpu::indirect(&cpu::Frame::new(&accel, &view, &camera, &setup)).unwrap();
        // Later bounces alone, so that the first one's noise is not in it.
        let of = |bounce: usize| {
            let field = cpu::Field { lattice, order: options.order, hints: &found.bounces[bounce] };
            let at = |p: Vec3| cpu::irradiance(&field, p, Vec3::Y, Reconstruction::AsPrinted).x;
            (at(Vec3::new(0.1, 0.0, 0.0)) + at(Vec3::new(-0.1, 0.05, 0.1))) * 0.5
        };
        of(2) - of(0)
    };
    let one = middle(&Lattice::new(&bounds, [8; 3]).unwrap());
    let nested = middle(&Lattice::of([(inner, [6; 3]), (bounds, [8; 3])]).unwrap());
    println!("later bounces in the middle: {one}, with a finer box around it {nested}");
    // The same 256 directions from places half a cell apart; were the box a room, light would come from half as far.
    assert!(one > 0.0 && (nested / one - 1.0).abs() < 0.01, "{nested} {one}");
    let rooms = |boxes: [Aabb; 2]| -> Vec<u32> {
        let lattice = Lattice::of(boxes.map(|b| (b, [2; 3]))).unwrap();
        lattice.volumes().iter().map(|v| v.room).collect()
    };
    let beside = Aabb { min: Vec3::new(0.9, -1.0, -1.0), max: Vec3::new(3.0, 1.0, 1.0) };
    assert_eq!((rooms([inner, bounds]), rooms([beside, bounds])), (vec![1, 1], vec![0, 1]));
}

/// A uniform field in a closed room of albedo 0.5.
fn uniform(transport: Transport, enclosed: bool, bounces: u32) -> Vec<f32> {
    const ALBEDO: f32 = 0.5;
    let lattice = Lattice::new(&Aabb { min: Vec3::ZERO, max: Vec3::new(3.0, 2.0, 4.0) }, [4, 3, 5]).unwrap();
    let enclosure =
        enclosed.then_some(Enclosure { albedo: [Vec3::splat(ALBEDO); 6], ..Enclosure::default() });
    // A third of the diagonal: most places of a sphere lie inside of the box.
    let range = if transport == Transport::Directions { 1.0 } else { 0.33 };
    let directions = cpu::Directions { count: 256, seed: 0, range, enclosure };
    let mut uniform = [Vec3::ZERO; 9];
    uniform[0] = Vec3::splat(ROOT);
    let first: Vec<Vec4> = (0..lattice.hints()).flat_map(|_| cpu::pack(&uniform)).collect();
    let around = Surroundings { albedo: [ALBEDO; 3], r_min: 0.5, r_max: 3.0 };
    let surroundings = vec![around; lattice.hints() as usize];
    let mut totals = vec![1.0];
    let mut last = first.clone();
    for number in 2..=bounces {
        let field = cpu::Field { lattice: &lattice, order: Order::Three, hints: &last };
        last = cpu::bounce(&field, &first, &surroundings, &[], &directions, transport, number);
        let mean = last.iter().step_by(7).map(|v| v.x).sum::<f32>() / lattice.hints() as f32 / ROOT;
        totals.push(mean);
    }
    totals
}

/// Eq. 8 to 10 as meant: `1, 1 + ρ, 1 + ρ + ρ², …`.
#[test]
fn bounces_of_a_uniform_room_add_up() {
    for enclosed in [false, true] {
        let totals = uniform(Transport::Directions, enclosed, 6);
        println!("directions: {totals:?}");
        for (k, total) in totals.iter().enumerate() {
            let exact = 2.0 - 0.5_f32.powi(k as i32);
            // 256 directions leave a first band of about 1/256 of the field, which the next bounce reads.
            assert!((total / exact - 1.0).abs() < 5e-3, "{k}: {total} {exact}");
        }
        for w in totals.windows(3) {
            assert!(w[2] - w[1] < w[1] - w[0], "energy must fall from bounce to bounce: {totals:?}");
        }
    }
}

/// The paper's places with the weighted mean that eq. 8 and 9 mean: one bounce returns `ρ` of a uniform field. Near a wall
/// all of it comes from one side, which the next bounce takes for more light than there is: why directions are the default.
#[test]
fn a_sphere_of_places_returns_the_albedo_once() {
    let totals = uniform(Transport::Sphere, false, 3);
    println!("sphere: {totals:?}, exact [1, 1.5, 1.75]");
    // One mean of equal numbers: rounding.
    assert!((totals[1] - 1.5).abs() < 1e-4, "{totals:?}");
    assert!(totals[2] > 1.76, "{totals:?}");
}

/// Eq. 8 to 10 as printed: `c_j` sums to 1 and is divided by the sum of the visibilities again, so that a bounce loses all but
/// about one in `N_b`; white surfaces and the running total do not make up for it.
#[test]
fn the_printed_bounce_divides_twice() {
    let totals = uniform(Transport::SphereAsPrinted, false, 3);
    println!("as printed: {totals:?}, exact [1, 1.5, 1.75]");
    let gain = totals[1] - 1.0;
    // 1/256 where all places are inside of the box; a hint in a corner has an eighth of them or a few more.
    assert!(gain > 1.0 / 256.0 && gain < 0.05, "{gain}");
}

/// A closed sphere with a light at its centre: the k-th bounce casts `I/R²·ρᵏ` on every point of the wall.
#[test]
fn bounces_of_a_sphere_add_up() {
    let furnace = SphereFurnace { subdivisions: 3, ..SphereFurnace::default() };
    let scene = furnace.build();
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let bounds = scene.bounds().unwrap();
    let lattice = Lattice::new(&bounds, [12; 3]).unwrap();
    let camera = cast::gbuffer(&accel, &scene.cameras[0].view([32, 32]), [32, 32]);
    // More samples than the default: what is measured is the method, not their luck.
    let draw = Draw { sampling: Sampling::Nearby, disc: 1.0, samples: 200, seed: 0 };
    let rsm = rsm::cpu::generate(&accel, 128).unwrap();
    for enclosure in [Some(cpu::enclosure(&accel, &bounds, &rsm)), None] {
        println!("{enclosure:?}");
        let (lists, near) = (cpu::sample(&rsm, &lattice, &draw), cpu::near(&rsm, &lattice, &draw));
        let samples = Samples { draw, lists: &lists, near: &near };
        let shape = (0.0, Params::default().footprint);
        let estimate = cpu::estimate(&lattice, &samples, &[], Order::Three, shape, true);
        let directions = cpu::Directions { count: 64, seed: 0, range: 1.0, enclosure };
        let mut last = estimate.hints.clone();
        let mut exact = 0.0;
        for number in 1..=4 {
            exact += 0.628 * 0.5_f32.powi(number as i32);
            if number > 1 {
                let (first, around) = (&estimate.hints, &estimate.surroundings);
                let field = cpu::Field { lattice: &lattice, order: Order::Three, hints: &last };
                last = cpu::bounce(&field, first, around, &[], &directions, Transport::Directions, number);
            }
            let field = cpu::Field { lattice: &lattice, order: Order::Three, hints: &last };
            let e =
                cpu::reconstruct(&field, &camera, &Reduced::new(camera.size, 1), Reconstruction::NearSurface);
            let mean = e.iter().sum::<Vec3>().x / e.len() as f32;
            println!("{number} bounces: {mean} exact {exact}, off by {:+.3}", mean / exact - 1.0);
            // The first bounce is the method's own: a curved wall within one cell's reads, 3 % too bright as measured, and not
            // more with fewer samples. Later ones come from the border of a box, whose corners, 1.73 R away, see a smaller
            // sphere than its wall does: in them the box, not the field, is what is measured. Knowing the mean way to the
            // wall helps; the mean over a face still reaches out of the sphere in the corners.
            let tolerance = if number == 1 {
                0.04
            } else if enclosure.is_some() {
                0.15
            } else {
                0.25
            };
            assert!((mean / exact - 1.0).abs() < tolerance, "{number}: {mean} {exact}");
        }
    }
}

#[test]
fn albedo_follows_from_the_fluxes() {
    let scene = floor_and_wall(lights()[0], 1.0);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let view = camera_view(1.0);
    let camera = cast::gbuffer(&accel, &view, [8, 8]);
    let found = |bounces| {
        let options = Options { resolution: 32, bounces, ..one_bounce() };
        let setup = setup(&lattice(&scene, 4), options, Params::default());
        cpu::indirect(&cpu::Frame::new(&accel, &view, &camera, &setup)).unwrap().surroundings
    };
    for s in &found(2) {
        // All surfaces have the same.
        assert!((Vec3::from(s.albedo) - Vec3::new(0.8, 0.5, 0.2)).abs().max_element() < 1e-5, "{s:?}");
        assert!(s.r_min > 0.0 && s.r_max > s.r_min);
    }
    assert!(found(1).is_empty());
}

/// Eq. 11 where both distances are the same: a hint that saw one sample, or none.
#[test]
fn visibility_between_hints_has_no_zero_over_zero() {
    assert_eq!(cpu::visibility(1.0, 2.0, 4.0), 1.0);
    assert_eq!(cpu::visibility(3.0, 2.0, 4.0), 0.5);
    assert_eq!(cpu::visibility(5.0, 2.0, 4.0), 0.0);
    assert_eq!(cpu::visibility(1.0, 2.0, 2.0), 1.0);
    assert_eq!(cpu::visibility(3.0, 2.0, 2.0), 0.0);
    assert_eq!(cpu::visibility(0.0, 0.0, 0.0), 1.0);
}
