//! Voronoi cells, dispersion and degenerate sets against brute force.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use core::f64::consts::{PI, TAU};

use glam::DVec3;
use incremental_vpls::pattern::{Pattern, Shape};
use indirect_sampling::{mapping, rng, sobol};
use proptest::prelude::*;

const SHAPES: [Shape; 2] = [Shape::Disc, Shape::Sphere];

/// Point `i` of an even sequence over the domain.
fn even(shape: Shape, i: u32, seed: u32) -> DVec3 {
    let u = sobol::sample_2d(i, seed);
    match shape {
        Shape::Disc => mapping::disc_concentric(u).as_dvec2().extend(0.0) * (1.0 - 1e-6),
        Shape::Sphere => mapping::sphere_uniform(u).as_dvec3().normalize(),
    }
}

/// `n` independent points: as uneven as chance makes them.
fn random(shape: Shape, n: u32, seed: u32) -> Vec<DVec3> {
    (0..n).map(|i| even(shape, rng::pcg_hash(rng::hash_combine(seed, i)) >> 8, 7)).collect()
}

/// Index of the point nearest to `x`.
fn nearest(points: &[DVec3], x: DVec3) -> usize {
    let distance = |i: &usize| points[*i].distance_squared(x);
    (0..points.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap()
}

/// Samples of the brute force.
const SAMPLES: u32 = 100_000;

/// Whether what the cells hold agrees with counting samples, each of which weighs `density`, where the whole domain
/// holds `whole`.
///
/// A count of `n` even samples has a standard deviation of at most `√(p (1 − p)/n)` of the whole (an even sequence has
/// less; so has a density of mean 1 and mean square up to 4/3, to a factor of 1.2): 5 of them for each cell.
fn agrees(shape: Shape, points: &[DVec3], held: &[f64], whole: f64, density: impl Fn(DVec3) -> f64) -> bool {
    let mut counted = vec![0.0; points.len()];
    for i in 0..SAMPLES {
        let x = even(shape, i, 1234);
        counted[nearest(points, x)] += density(x) / f64::from(SAMPLES);
    }
    counted.iter().zip(held).all(|(&p, &h)| {
        let deviation = 1.2 * (p.max(1e-5) * (1.0 - p.min(1.0)) / f64::from(SAMPLES)).sqrt();
        (p - h / whole).abs() <= 5.0 * deviation + 1e-9
    })
}

#[test]
fn cells_are_what_is_nearest() {
    for shape in SHAPES {
        for (n, seed) in [(1, 0), (2, 1), (3, 2), (4, 3), (5, 4), (12, 5), (40, 6), (120, 7)] {
            let points = random(shape, n, seed);
            let areas = Pattern::new(shape, &points).areas();
            assert!(agrees(shape, &points, &areas, shape.area(), |_| 1.0), "{shape:?} {n}");
            let sum: f64 = areas.iter().sum();
            assert!((sum / shape.area() - 1.0).abs() < 1e-12, "{shape:?} {n}: {sum}");
            // Planted faults that the count must refuse: no cells at all, cells of other points, one cell's border
            // moved.
            if n >= 12 {
                let even = vec![shape.area() / f64::from(n); n as usize];
                assert!(!agrees(shape, &points, &even, shape.area(), |_| 1.0));
                let mut turned = areas.clone();
                turned.rotate_left(1);
                assert!(!agrees(shape, &points, &turned, shape.area(), |_| 1.0));
                let moved: Vec<_> = points.iter().map(|p| *p * DVec3::new(0.8, 1.0, 1.0)).collect();
                let moved = Pattern::new(shape, &moved).areas();
                assert!(!agrees(shape, &points, &moved, shape.area(), |_| 1.0));
            }
        }
    }
}

#[test]
fn cells_hold_measures_of_the_radius() {
    // Within the squared radius s there is s²: the density is 2 s, its mean over the disc 1, its mean square 4/3.
    let points = random(Shape::Disc, 60, 3);
    let cells = Pattern::new(Shape::Disc, &points).cells(|s| [s, 1.0]);
    let [curved, flat] = [0, 1].map(|k| cells.iter().map(|c| c[k]).collect::<Vec<_>>());
    for (held, power) in [(&curved, 1.0), (&flat, 0.0)] {
        assert!((held.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let density = |x: DVec3| (1.0 + power) * x.length_squared().powf(power);
        assert!(agrees(Shape::Disc, &points, held, 1.0, density));
        // The other density is refused.
        assert!(!agrees(Shape::Disc, &points, held, 1.0, |x| (2.0 - power)
            * x.length_squared().powf(1.0 - power)));
    }
}

#[test]
fn regular_sets_have_the_areas_of_symmetry() {
    let regular = |n: u32, r: f64, z: f64| {
        (0..n).map(move |i| {
            let (y, x) = (f64::from(i) / f64::from(n) * TAU).sin_cos();
            DVec3::new(r * x, r * y, z)
        })
    };
    for n in [2, 3, 4, 6, 7, 64, 1000] {
        // On a circle around the centre of the disc; on the equator and on a small circle of the sphere, where all
        // cells are lunes between the poles; on either pole besides.
        let sets = [
            (Shape::Disc, regular(n, 0.7, 0.0).collect::<Vec<_>>()),
            (Shape::Disc, regular(n, 1.0 - 1e-9, 0.0).collect()),
            (Shape::Sphere, regular(n, 1.0, 0.0).collect()),
            (Shape::Sphere, regular(n, 0.6, 0.8).collect()),
        ];
        for (shape, points) in sets {
            for area in Pattern::new(shape, &points).areas() {
                // Coordinates rounded to 1e-12 at a spacing of 4e-3 and more turn a border by 2e-10, which moves its
                // far end by 5e-8 of a cell's width.
                assert!((area * f64::from(n) / shape.area() - 1.0).abs() < 1e-7, "{shape:?} {n}: {area}");
            }
        }
    }
    let octahedron = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z];
    let cube: Vec<_> =
        (0..8).map(|i| DVec3::from([1, 2, 4].map(|b| if i & b == 0 { 1.0 } else { -1.0 }))).collect();
    for points in [&octahedron[..], &cube] {
        for area in Pattern::new(Shape::Sphere, points).areas() {
            assert!((area * points.len() as f64 / (4.0 * PI) - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
fn a_new_point_goes_into_the_largest_empty_circle() {
    for shape in SHAPES {
        for (n, seed) in [(8, 1), (20, 2), (90, 3)] {
            let points = random(shape, n, seed);
            let empty = |points: &[DVec3], x: DVec3| {
                let rim = if shape == Shape::Disc { 2.0 * (1.0 - x.length()) } else { f64::INFINITY };
                points[nearest(points, x)].distance(x).min(rim)
            };
            let mut pattern = Pattern::new(shape, &points);
            let dispersion = pattern.dispersion();
            let sampled = (0..20_000).map(|i| empty(&points, even(shape, i, 5))).fold(0.0, f64::max);
            // The best of 20 000 samples lies within their own spacing of the best: √(4π/20 000) = 0.025.
            let agrees = |radius: f64| sampled <= radius + 1e-11 && sampled > radius - 0.05;
            assert!(agrees(dispersion), "{shape:?} {n}: {sampled} {dispersion}");
            // Planted: a tenth too small, or twice as large.
            assert!(!agrees(0.9 * dispersion) && !agrees(2.0 * dispersion));
            let mut all = points.clone();
            let mut last = f64::INFINITY;
            for p in pattern.insert_sparsest(50, 0) {
                let radius = empty(&all, p);
                // Each is the largest: the next is not larger.
                assert!(radius <= last + 1e-11, "{radius} {last}");
                last = radius;
                all.push(p);
            }
            assert_eq!(all.len(), n as usize + 50);
            assert!(pattern.dispersion() <= last + 1e-11);
        }
    }
}

/// Fewest and most area of a cell, as shares of the mean.
fn spread(pattern: &Pattern) -> (f64, f64) {
    let areas = pattern.areas();
    let mean = pattern.shape().area() / pattern.len() as f64;
    let live = (0..areas.len()).filter(|&i| pattern.point(i).is_some()).map(|i| areas[i] / mean);
    live.fold((f64::INFINITY, 0.0), |(lo, hi), a| (lo.min(a), hi.max(a)))
}

/// Standard deviation of the cells' areas, as a share of their mean.
fn variation(pattern: &Pattern) -> f64 {
    let mean = pattern.shape().area() / pattern.len() as f64;
    let squares: f64 = pattern.areas().iter().map(|a| (a / mean - 1.0).powi(2)).sum();
    (squares / pattern.len() as f64).sqrt()
}

#[test]
fn greedy_patterns_are_even_and_random_ones_are_not() {
    for shape in SHAPES {
        for n in [64, 256, 1024] {
            let mut pattern = Pattern::new(shape, &[]);
            assert_eq!(pattern.insert_sparsest(n, 1).len(), n);
            // Each point was put at least as far from the others as the last: areas differ by a factor of 16 at most.
            // The cells of independent points vary by 0.53 of their mean (Voronoi cells of a Poisson process).
            let (lo, hi) = spread(&pattern);
            let random = Pattern::new(shape, &random(shape, n as u32, 5));
            let (even, chance) = (variation(&pattern), variation(&random));
            assert!(
                hi < 16.0 * lo && even < 0.35 && chance > 0.4,
                "{shape:?} {n}: {lo} {hi} {even} {chance}"
            );
        }
    }
}

#[test]
fn the_densest_go_first() {
    for shape in SHAPES {
        let mut points = vec![];
        for i in 0..40 {
            points.push(even(shape, i, 3) * 0.9);
        }
        // A pair much closer than all others, and a third near to one of them: that one goes.
        let close =
            if shape == Shape::Disc { DVec3::new(1e-4, 0.0, 0.0) } else { DVec3::new(0.0, 1e-4, 0.0) };
        points.push(points[17] + close);
        points.push(points[17] - 4.0 * close);
        let mut pattern = Pattern::new(shape, &points);
        assert_eq!(pattern.remove_densest(2).first(), Some(&17), "{shape:?}");
        let before = spread(&Pattern::new(shape, &random(shape, 400, 9))).0;
        let mut pattern = Pattern::new(shape, &random(shape, 400, 9));
        assert_eq!(pattern.remove_densest(200).len(), 200);
        assert_eq!(pattern.len(), 200);
        let after = spread(&pattern).0;
        assert!(after > 2.0 * before, "{before} {after}");
        // Numbers survive: each cell is still that of its point.
        let left: Vec<DVec3> = (0..pattern.numbers()).filter_map(|i| pattern.point(i)).collect();
        let areas: Vec<f64> = (0..pattern.numbers())
            .filter(|&i| pattern.point(i).is_some())
            .map(|i| pattern.areas()[i])
            .collect();
        assert!(agrees(shape, &left, &areas, shape.area(), |_| 1.0));
        assert_eq!(pattern.remove_densest(1000).len(), 200);
        assert!(pattern.is_empty() && pattern.remove_densest(1).is_empty());
        assert_eq!(pattern.insert_sparsest(3, 0).len(), 3);
    }
}

/// A set without general position: on a lattice, a line, a circle, around one point, at one point, or with what is no
/// point.
fn degenerate(shape: Shape, kind: u32, n: u32, seed: u32) -> Vec<DVec3> {
    let unit = |i: u32, k: u32| f64::from(rng::unit_f32(rng::pcg_hash(rng::hash_combine(seed, 4 * i + k))));
    let vector = |i: u32| DVec3::new(unit(i, 0) - 0.5, unit(i, 1) - 0.5, unit(i, 2) - 0.5);
    (0..n)
        .map(|i| {
            let v = vector(i);
            let circle = |turn: f64| {
                let (y, x) = (turn * TAU).sin_cos();
                DVec3::new(x, y, 0.0)
            };
            let p = match kind % 8 {
                0 => (v * 6.0).round() / 6.0,
                1 => vector(1000) + vector(1001) * (unit(i, 3) - 0.5),
                2 => vector(1000) + vector(1001) * (unit(i, 3) * 4.0).round() / 16.0,
                3 => circle(unit(i, 3)) * 0.5 + DVec3::Z * f64::from(seed % 2) * 0.3,
                4 => vector(1000) + v * 10.0_f64.powi(-(seed as i32 % 18).abs()),
                5 => [vector(1000), vector(1001), -vector(1000)][i as usize % 3],
                6 if i % 3 == 0 => return DVec3::new(f64::NAN, 0.0, f64::INFINITY),
                6 => v * 4.0,
                // On the rim, and a hair to either side.
                _ => circle(f64::from(i) / f64::from(n)) * (1.0 + (unit(i, 3) - 0.5) * 1e-15),
            };
            if shape == Shape::Disc { p.with_z(0.0) } else { p }
        })
        .collect()
}

/// Everything that a frame does, on one set.
fn check_degenerate(shape: Shape, kind: u32, n: u32, seed: u32) -> Result<(), TestCaseError> {
    let points = degenerate(shape, kind, n, seed);
    let mut pattern = Pattern::new(shape, &points);
    let sums = |p: &Pattern| {
        let areas = p.areas();
        let sum: f64 = areas.iter().sum();
        let whole = if p.is_empty() { 0.0 } else { shape.area() };
        areas.iter().all(|a| a.is_finite() && *a >= 0.0) && (sum - whole).abs() < 1e-5 * shape.area()
    };
    prop_assert!(sums(&pattern), "{:?} {:?}", points, pattern.areas());
    let accepted = points.iter().filter(|&&p| shape.accept(p).is_some()).count();
    prop_assert!(pattern.len() <= accepted && (accepted == 0 || !pattern.is_empty()));
    let half = pattern.len() / 2;
    prop_assert_eq!(pattern.remove_densest(half).len(), half);
    prop_assert!(sums(&pattern));
    let left = pattern.len();
    let added = pattern.insert_sparsest(12, seed);
    prop_assert_eq!(added.len(), 12);
    prop_assert_eq!(pattern.len(), left + 12);
    prop_assert!(sums(&pattern));
    // Removal looks at 3 n edges for each point that goes; insertion at 2 n candidates, and those that each new one
    // brings, three for each of its edges; edges are 3 n.
    let n = u64::from(n) + 12;
    prop_assert!(pattern.steps() <= 3 * n * n + 5 * n + 12 * (64 + 10 * 3 * n), "{}", pattern.steps());
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn degenerate_sets_have_cells(sphere: bool, kind in 0_u32..8, n in 0_u32..40, seed: u32) {
        check_degenerate(SHAPES[usize::from(sphere)], kind, n, seed)?;
    }
}

/// `cargo test --release -p incremental-vpls -- --ignored`
#[test]
#[ignore = "ten seconds"]
fn a_hundred_thousand_degenerate_sets() {
    for i in 0..100_000 {
        let (n, seed) = (rng::pcg_hash(i) % 48, rng::pcg_hash(i ^ 0x5bd1_e995));
        let result = check_degenerate(SHAPES[(i % 2) as usize], i / 2, n, seed);
        assert!(result.is_ok(), "{i}: {result:?}");
    }
}
