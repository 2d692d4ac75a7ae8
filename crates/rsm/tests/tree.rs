//! Cuts through a tree over a list of lights against the flat gather of the list.
#![cfg(feature = "cpu")]
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

#[path = "common/bounces.rs"]
mod bounces;

use bounces::rel_rmse;
use glam::{DVec3, Vec3};
use indirect_accel::{Accel, BuildPreset};
use indirect_sampling::rng::{pcg_hash, unit_f32};
use proptest::prelude::*;
use rsm::cpu::{self, ALWAYS, LightTree, Receivers, Tile};
use rsm::{Bound, Branch, Form, TILE, TreeLayout, Vpl};

/// Three bounces in the Cornell box, and receivers there.
fn cornell(counts: &[u32], side: u32) -> (Vec<Vec<Vpl>>, Vec<Vec3>, Vec<Vec3>) {
    let scene = indirect_scene::fixtures::build("cornell_spot").unwrap();
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let maps = cpu::generate(&accel, 128).unwrap();
    let (positions, normals) = bounces::receivers(&accel, &scene.cameras[0].view([side; 2]), [side; 2]);
    (counts.iter().map(|count| bounces::vpls(&accel, &maps, *count)).collect(), positions, normals)
}

fn flat(vpls: &[Vpl], positions: &[Vec3], normals: &[Vec3], form: Form) -> Vec<Vec3> {
    let receivers: Receivers = positions.iter().copied().zip(normals.iter().copied()).collect();
    cpu::gather(vpls, &receivers, form)
}

/// A tree whose threshold is the share `tau` of the reference irradiance.
fn tree(vpls: &[Vpl], positions: &[Vec3], normals: &[Vec3], bound: Bound, tau: f32) -> LightTree {
    let mut tree = LightTree::new(vpls, 0);
    let threshold = tau * tree.reference_irradiance(positions, normals);
    tree.solve_reach(bound, threshold);
    tree
}

fn random(seed: u32) -> impl FnMut() -> f32 {
    let mut state = seed;
    move || {
        state = pcg_hash(state);
        unit_f32(state)
    }
}

/// Lights anywhere above the plane y = 0, facing anywhere, some without flux.
fn noise(count: u32, seed: u32) -> Vec<Vpl> {
    let mut next = random(seed);
    (0..count)
        .map(|_| {
            let p = Vec3::new(next(), 0.2 + next(), next());
            let n = Vec3::new(next() - 0.5, next() - 0.7, next() - 0.5);
            let lit = if next() < 0.2 { 0.0 } else { 1.0 };
            let flux = Vec3::new(next(), next(), next()) * lit;
            Vpl::new(p, indirect_core::math::normalize_or(n, Vec3::NEG_Y), flux, 1e-3 * next())
        })
        .collect()
}

#[test]
fn threshold_zero_is_the_flat_gather() {
    let (lists, positions, normals) = cornell(&[1000, 5000], 40);
    for vpls in lists.iter().chain([&noise(777, 1)]) {
        for form in [Form::Disc, Form::Point] {
            for &bound in Bound::ALL {
                let tree = tree(vpls, &positions, &normals, bound, 0.0);
                let (found, cuts) = cpu::traverse(&tree.branches, &positions, &normals, form);
                let lit = vpls.iter().filter(|v| v.flux.element_sum() > 0.0).count();
                assert!(cuts.iter().all(|cut| *cut as usize == lit));
                // The same terms in another order: a random walk of up to √5000 roundings of 2⁻²⁴, 4·10⁻⁶.
                let error = rel_rmse(&found, &flat(vpls, &positions, &normals, form));
                assert!(error < 1e-5, "{form:?} {error}");
            }
        }
    }
}

#[test]
fn the_error_falls_with_the_threshold_and_the_cut_grows_less_than_the_list() {
    let (lists, positions, normals) = cornell(&[1 << 10, 1 << 14], 40);
    let mut at_default = Vec::new();
    for vpls in &lists {
        let truth = flat(vpls, &positions, &normals, Form::Disc);
        for &bound in Bound::ALL {
            let run = |tau: f32| {
                let tree = tree(vpls, &positions, &normals, bound, tau);
                let (found, cuts) = cpu::traverse(&tree.branches, &positions, &normals, Form::Disc);
                let cut = cuts.iter().map(|c| f64::from(*c)).sum::<f64>() / cuts.len() as f64;
                (rel_rmse(&found, &truth), cut)
            };
            let runs = [10.0, 1.0, 0.1, 0.01, 1e-3, 1e-4, 0.0].map(run);
            println!("{bound:?}: {runs:?}");
            for pair in runs.windows(2) {
                assert!(pair[1].0 < pair[0].0 && pair[1].1 > pair[0].1, "{runs:?}");
            }
            assert!(runs[0].0 > 0.05 && runs[6].0 < 1e-5, "{runs:?}");
            if bound == Bound::Error {
                at_default.push(run(0.003));
            }
        }
    }
    println!("at 0.003: {at_default:?}");
    // Sixteen times the lights, where lights alike are ever nearer to each other.
    assert!(at_default[1].1 < 4.0 * at_default[0].1, "{at_default:?}");
    assert!(at_default.iter().all(|run| run.0 < 0.04), "{at_default:?}");
}

/// Whether each level has the flux and the area of the list.
fn sums_hold(tree: &LightTree, vpls: &[Vpl]) -> bool {
    let sum = |flux: &mut dyn Iterator<Item = Vec3>| flux.map(|f| f.as_dvec3()).sum::<DVec3>();
    let all = sum(&mut vpls.iter().map(|v| v.flux));
    let area: f64 = vpls.iter().filter(|v| v.flux.element_sum() > 0.0).map(|v| f64::from(v.area)).sum();
    (0..tree.layout.levels()).all(|level| {
        let level = tree.level(level);
        let found = sum(&mut level.iter().map(|b| b.flux));
        let found_area: f64 = level.iter().map(|b| f64::from(b.area)).sum();
        // One rounding of 2⁻²⁴ for each of up to 13 levels.
        (found - all).abs().max_element() <= 1e-6 * all.max_element()
            && (found_area - area).abs() <= 1e-6 * area
    })
}

#[test]
fn sums_hold_on_every_level_and_a_mean_in_place_of_a_sum_is_refused() {
    let (lists, positions, normals) = cornell(&[5000], 40);
    let vpls = &lists[0];
    let right = tree(vpls, &positions, &normals, Bound::Error, 0.003);
    assert!(sums_hold(&right, vpls));
    let truth = flat(vpls, &positions, &normals, Form::Disc);
    let error = |tree: &LightTree| {
        rel_rmse(&cpu::traverse(&tree.branches, &positions, &normals, Form::Disc).0, &truth)
    };
    // The fault: every branch above the lights has the mean of its children's flux.
    let mut wrong = right.clone();
    for level in 1..wrong.layout.levels() {
        let share = 0.5_f32.powi(level as i32);
        let first = wrong.layout.offset(level) as usize;
        for branch in &mut wrong.branches[first..][..right.level(level).len()] {
            branch.flux *= share;
        }
    }
    assert!(!sums_hold(&wrong, vpls));
    let errors = [error(&right), error(&wrong)];
    println!("right and wrong: {errors:?}");
    assert!(errors[0] < 0.03 && errors[1] > 0.15, "{errors:?}");
}

#[test]
fn every_light_lies_within_the_bounds_of_the_branches_above() {
    let vpls = noise(1000, 5);
    let tree = LightTree::new(&vpls, 0);
    let leaves = tree.level(0);
    for level in 1..tree.layout.levels() {
        for (i, branch) in tree.level(level).iter().enumerate() {
            for leaf in leaves.iter().skip(i << level).take(1 << level).filter(|l| l.weight() > 0.0) {
                let distance = (leaf.position - branch.position).length() + leaf.radius;
                assert!(distance <= branch.radius * (1.0 + 1e-5), "{level} {i}");
                assert!(1.0 - leaf.normal.dot(branch.normal) <= branch.versine + 1e-5, "{level} {i}");
            }
            assert!(branch.weight() == 0.0 || branch.normal.is_normalized());
        }
    }
}

#[test]
fn neither_scale_nor_power_changes_what_is_seen() {
    let (lists, positions, normals) = cornell(&[4000], 40);
    let at = |scale: f32, power: f32| {
        let vpls: Vec<Vpl> = lists[0]
            .iter()
            .map(|v| Vpl::new(v.position * scale, v.normal, v.flux * power, v.area * scale * scale))
            .collect();
        let positions: Vec<Vec3> = positions.iter().map(|p| *p * scale).collect();
        let tree = tree(&vpls, &positions, &normals, Bound::Error, 0.003);
        let (found, cuts) = cpu::traverse(&tree.branches, &positions, &normals, Form::Disc);
        let found: Vec<Vec3> = found.iter().map(|e| *e * (scale * scale / power)).collect();
        (found, cuts.iter().sum::<u32>())
    };
    let (expected, cut) = at(1.0, 1.0);
    for (scale, power) in [(1e-3, 1.0), (1e3, 1.0), (1.0, 1e5), (1.0, 1e-6), (1e-3, 1e3)] {
        let (found, other) = at(scale, power);
        let error = rel_rmse(&found, &expected);
        println!("scale {scale}, power {power}: {error:.1e}, {cut} {other}");
        // A few lights beside a border of cells change places; by powers of two none would.
        assert!(error < 5e-3 && other.abs_diff(cut) < cut / 50, "{scale} {power} {error}");
    }
}

#[test]
fn lists_of_any_length_and_lights_at_one_place_are_summed() {
    let (positions, normals) = bounces::plane(6, 1.0);
    let mut lists: Vec<Vec<Vpl>> = [0, 1, 2, 3, 5, 17, 100, 1025].map(|n| noise(n, n + 9)).into();
    let one = Vpl::new(Vec3::ONE, Vec3::NEG_Y, Vec3::ONE, 0.0);
    lists.push(vec![one; 33]);
    lists.push(vec![one, Vpl { normal: Vec3::Y, ..one }]);
    lists.push(vec![Vpl::default(); 9]);
    for vpls in &lists {
        for tau in [0.0, 0.01, 1e6] {
            let tree = tree(vpls, &positions, &normals, Bound::Error, tau);
            assert_eq!(tree.branches.len(), tree.layout.len() as usize);
            let (found, _) = cpu::traverse(&tree.branches, &positions, &normals, Form::Disc);
            assert!(found.iter().all(|e| e.is_finite()));
            if tau == 0.0 {
                let expected = flat(vpls, &positions, &normals, Form::Disc);
                for (e, x) in found.iter().zip(&expected) {
                    assert!(
                        (*e - *x).abs().max_element() <= 1e-5 * x.max_element(),
                        "{} {e} {x}",
                        vpls.len()
                    );
                }
            }
        }
    }
    let none = LightTree::new(&[], 0);
    assert!(none.layout.is_empty() && none.reference_irradiance(&positions, &normals) == 0.0);
    assert_eq!(LightTree::new(&noise(9, 1), 0).reference_irradiance(&[], &[]), 0.0);
}

#[test]
fn lights_without_flux_cost_nothing() {
    let (lists, positions, normals) = cornell(&[600], 30);
    let lit = tree(&lists[0], &positions, &normals, Bound::Error, 0.003);
    let mut sparse = lists[0].clone();
    let mut next = random(3);
    (0..8000).for_each(|_| {
        let bad = [0.0, f32::NAN, f32::INFINITY][(3.0 * next()) as usize];
        sparse.insert(
            (next() * sparse.len() as f32) as usize,
            Vpl { flux: Vec3::splat(bad), ..Vpl::default() },
        );
    });
    let sparse = tree(&sparse, &positions, &normals, Bound::Error, 0.003);
    let run = |t: &LightTree| cpu::traverse(&t.branches, &positions, &normals, Form::Disc);
    let ((a, cuts), (b, sparse_cuts)) = (run(&lit), run(&sparse));
    assert_eq!(cuts, sparse_cuts);
    assert!(rel_rmse(&b, &a) < 1e-6);
}

#[test]
fn trees_are_the_same_on_any_number_of_threads() {
    let vpls = noise(20_000, 8);
    let (positions, normals) = bounces::plane(32, 1.0);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let tree = tree(&vpls, &positions, &normals, Bound::Error, 0.01);
            let found = cpu::traverse(&tree.branches, &positions, &normals, Form::Disc);
            (tree, found)
        })
    };
    let one = on(1);
    assert!([2, 3, 5].into_iter().all(|threads| on(threads) == one));
}

/// Shares of seeds for which each of the lights represents the root, and whether they are those of the flux: within
/// 5σ of a binomial draw, a chance of 10⁻⁶ each for a draw that is right.
fn drawn_by_flux(vpls: &[Vpl], representative: impl Fn(u32) -> u32) -> bool {
    const SEEDS: u32 = 4000;
    let mut hits = vec![0.0; vpls.len()];
    (0..SEEDS).for_each(|seed| hits[representative(seed) as usize] += 1.0);
    let total: f64 = vpls.iter().map(|v| f64::from(v.flux.element_sum())).sum();
    hits.iter().zip(vpls).all(|(hits, vpl)| {
        let p = f64::from(vpl.flux.element_sum()) / total;
        let n = f64::from(SEEDS);
        (hits - n * p).abs() <= 5.0 * (n * p * (1.0 - p)).sqrt()
    })
}

#[test]
fn representatives_are_drawn_in_proportion_to_flux() {
    let vpls = noise(37, 4);
    assert!(drawn_by_flux(&vpls, |seed| LightTree::new(&vpls, seed).branches[0].representative));
    // The fault: any of the lights that have flux, however bright.
    let lit: Vec<u32> = (0..37).filter(|i| vpls[*i as usize].flux.element_sum() > 0.0).collect();
    let even = |seed: u32| lit[(unit_f32(pcg_hash(seed)) * lit.len() as f32) as usize];
    assert!(!drawn_by_flux(&vpls, even));
}

#[test]
fn visibility_is_right_in_the_mean_over_seeds() {
    // A root of lights side by side, of which those on the left are hidden from the only receiver.
    let mut next = random(11);
    let vpls: Vec<Vpl> = (0..64)
        .map(|_| {
            let flux = Vec3::splat(next());
            Vpl::new(Vec3::new(0.01 * (next() - 0.5), 1.0, 0.01 * next()), Vec3::NEG_Y, flux, 0.0)
        })
        .collect();
    let seen = |i: u32| vpls[i as usize].position.x > 0.0;
    let (p, n) = ([Vec3::ZERO], [Vec3::Y]);
    let total = |visible: &dyn Fn(u32) -> bool| -> f64 {
        (0..64).filter(|i| visible(*i)).map(|i| f64::from(vpls[i as usize].flux.x)).sum()
    };
    let share = total(&seen) / total(&|_| true);
    const SEEDS: u32 = 2000;
    let mean = |planted: Option<u32>| {
        let of = |seed| {
            let mut tree = LightTree::new(&vpls, seed);
            tree.solve_reach(Bound::Error, 1e6);
            let visible = |i, receiver| receiver == 0 && seen(planted.unwrap_or(i));
            let (e, cuts) = cpu::traverse_visible(&tree.branches, &p, &n, Form::Disc, visible);
            assert_eq!(cuts, [1]);
            f64::from(e[0].x) / f64::from(cpu::traverse(&tree.branches, &p, &n, Form::Disc).0[0].x)
        };
        (0..SEEDS).map(of).sum::<f64>() / f64::from(SEEDS)
    };
    let sigma = (share * (1.0 - share) / f64::from(SEEDS)).sqrt();
    println!("{share} {} ± {sigma}", mean(None));
    assert!((mean(None) - share).abs() < 5.0 * sigma);
    // The fault: the same light for all seeds.
    assert!((mean(Some(0)) - share).abs() > 5.0 * sigma);
}

#[test]
fn nothing_in_the_way_changes_nothing_and_only_light_that_arrives_is_asked_for() {
    let (lists, positions, normals) = cornell(&[2000], 40);
    let tree = tree(&lists[0], &positions, &normals, Bound::Error, 0.01);
    let (expected, cuts) = cpu::traverse(&tree.branches, &positions, &normals, Form::Disc);
    let visible = |light: u32, receiver: usize| {
        assert!((light as usize) < lists[0].len() && receiver < positions.len());
        true
    };
    let found = cpu::traverse_visible(&tree.branches, &positions, &normals, Form::Disc, visible);
    assert_eq!(found, (expected, cuts));
    let asked = std::sync::atomic::AtomicUsize::new(0);
    let (dark, _) = cpu::traverse_visible(&tree.branches, &positions, &normals, Form::Disc, |_, _| {
        asked.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        false
    });
    assert!(dark.iter().all(|e| *e == Vec3::ZERO));
    // No light of the wall that a receiver lies on arrives there.
    let pairs = TILE * found.1.iter().sum::<u32>() as usize;
    println!("{} of {pairs} asked for", asked.load(std::sync::atomic::Ordering::Relaxed));
    assert!(asked.into_inner() < pairs * 9 / 10);
}

#[test]
fn a_cut_names_each_light_with_its_representative() {
    let vpls = noise(300, 2);
    let (positions, normals) = bounces::plane(8, 1.0);
    let tree = tree(&vpls, &positions, &normals, Bound::Error, 0.03);
    let tile = Tile::new(&positions[..TILE]);
    let (mut lights, mut branches) = (Vec::new(), Vec::<Branch>::new());
    cpu::cut(&tree.branches, &tile, &mut lights);
    cpu::visit_cut(&tree.branches, &tile, |branch| branches.push(*branch));
    assert!(branches.iter().map(Branch::vpl).eq(lights));
    assert!(branches.iter().all(|b| vpls[b.representative as usize].flux.element_sum() > 0.0));
    let total: f32 = branches.iter().map(Branch::weight).sum();
    let list: f32 = vpls.iter().map(|v| v.flux.element_sum()).sum();
    assert!((total / list - 1.0).abs() < 1e-5);
}

fn any_vpl() -> impl Strategy<Value = Vpl> {
    let number = prop_oneof![
        8 => -2.0_f32..2.0,
        1 => Just(0.0_f32),
        1 => prop::num::f32::ANY,
    ];
    let vector = prop::array::uniform3(number.clone()).prop_map(Vec3::from_array);
    (vector.clone(), vector.clone(), vector, number)
        .prop_map(|(p, n, flux, area)| Vpl::new(p, n, flux.abs(), area))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn nothing_panics_and_nothing_sane_becomes_nan(
        vpls in prop::collection::vec(any_vpl(), 0..70),
        tau in prop_oneof![Just(0.0_f32), 1e-6_f32..1e3],
    ) {
        let (positions, normals) = bounces::plane(5, 1.0);
        // Squares of what is larger are not finite; unit normals are what the tree is promised.
        let sane = |v: &Vpl| {
            let largest = v.position.abs().max_element().max(v.flux.max_element()).max(v.area.abs());
            largest < 1e9 && v.normal.is_finite()
        };
        let unit = |v: &Vpl| Vpl { normal: indirect_core::math::normalize_or(v.normal, Vec3::Y), area: v.area.abs(), ..*v };
        let all_sane = vpls.iter().all(sane);
        let vpls: Vec<Vpl> = vpls.iter().map(|v| if sane(v) { unit(v) } else { *v }).collect();
        let tree = tree(&vpls, &positions, &normals, Bound::Error, tau);
        let mut order = tree.order.clone();
        order.sort_unstable();
        prop_assert!(order.into_iter().eq(0..vpls.len() as u32));
        prop_assert_eq!(&tree.layout, &TreeLayout::new(vpls.len() as u32));
        let (found, _) = cpu::traverse(&tree.branches, &positions, &normals, Form::Disc);
        if all_sane {
            prop_assert!(found.iter().all(|e| e.is_finite()));
            prop_assert!(tree.branches.iter().all(|b| b.reach >= 0.0 && b.reach <= ALWAYS));
        }
    }
}
