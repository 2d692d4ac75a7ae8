//! Hierarchical warping against its importance: χ² on 20 maps, inverse, density, hard cases; the baselines likewise.

mod common;

use common::{TESTS_IN_THIS_CRATE, chi_square, chi_square_critical, random_points};
use glam::Vec2;
use indirect_sampling::{
    discrete::{AliasTable, RowCdf},
    rng::{pcg_hash, unit_f32},
    warp::{Empty, Pyramid, Sample, Warp, WarpError, level_size, pyramid_len, top_level},
};
use proptest::prelude::*;

const SAMPLES: usize = 1_000_000;

struct Map {
    name: &'static str,
    size: [u32; 2],
    values: Vec<f32>,
}

fn map(name: &'static str, size: [u32; 2], value: impl Fn(u32, u32) -> f32) -> Map {
    let values = (0..size[0] * size[1]).map(|i| value(i % size[0], i / size[0])).collect();
    Map { name, size, values }
}

fn noise(x: u32, y: u32) -> f32 {
    unit_f32(pcg_hash(x + 1000 * y))
}

fn twenty_maps() -> Vec<Map> {
    let hill = |x: u32, y: u32| (-((x as f32 - 20.0).powi(2) + (y as f32 - 41.0).powi(2)) / 50.0).exp();
    vec![
        map("one texel", [1, 1], |_, _| 3.0),
        map("constant", [32, 32], |_, _| 0.7),
        map("constant, not a power of two", [33, 17], |_, _| 0.7),
        map("row", [100, 1], |x, _| x as f32),
        map("column", [1, 77], |_, y| 1.0 + y as f32),
        map("two texels", [2, 1], |x, _| [0.3, 0.9][x as usize]),
        map("noise", [64, 64], noise),
        map("noise, not a power of two", [61, 37], noise),
        map("hill", [64, 64], hill),
        map("hill of high contrast", [63, 65], |x, y| hill(x, y).powi(4)),
        map("one lit texel", [64, 64], |x, y| f32::from((x, y) == (37, 22))),
        map("lit last corner", [33, 33], |x, y| f32::from((x, y) == (32, 32))),
        map("zero quads", [32, 32], |x, y| if (x / 2 + y / 2) % 2 == 0 { 0.0 } else { 1.0 + noise(x, y) }),
        map("zero quadrant", [40, 40], |x, y| if x < 20 && y < 20 { 0.0 } else { noise(x, y) }),
        map("checkerboard", [31, 31], |x, y| ((x + y) % 2) as f32),
        map("NaN texels", [32, 32], |x, y| if (x * 7 + y) % 5 == 0 { f32::NAN } else { noise(x, y) }),
        map("negative and infinite texels", [32, 32], |x, y| match (x + 3 * y) % 7 {
            0 => f32::INFINITY,
            1 => -1.0,
            2 => f32::NEG_INFINITY,
            _ => noise(x, y),
        }),
        map("near f32's limit", [24, 24], |x, y| noise(x, y) * f32::MAX),
        map("subnormal", [24, 24], |x, y| (noise(x, y) * 4096.0).floor() * f32::from_bits(1)),
        map("twelve orders of magnitude", [48, 48], |x, y| 10.0_f32.powf(12.0 * noise(x, y))),
    ]
}

/// Probability of each texel by f64 sums.
fn probabilities(map: &Map) -> Vec<f64> {
    let valid = |w: &f32| if *w > 0.0 && w.is_finite() { f64::from(*w) } else { 0.0 };
    let sum: f64 = map.values.iter().map(valid).sum();
    map.values.iter().map(|w| valid(w) / sum).collect()
}

/// Texel frequencies, and for texels with many samples their quarters, against the map.
fn assert_follows(what: &str, map: &Map, absolute: f64, sample: impl Fn(Vec2) -> Sample) {
    let expected = probabilities(map);
    let mut counts = vec![0_u32; expected.len() * 4];
    for u in random_points(SAMPLES, 2) {
        let Sample { point, texel: [x, y], pdf } = sample(u);
        assert!(x < map.size[0] && y < map.size[1]);
        assert!(
            point.x >= x as f32 && point.x < (x + 1) as f32,
            "{what}, {}: {point} outside of {x}",
            map.name
        );
        assert!(
            point.y >= y as f32 && point.y < (y + 1) as f32,
            "{what}, {}: {point} outside of {y}",
            map.name
        );
        let texel = (y * map.size[0] + x) as usize;
        // A rounded ratio per level, of sums that were rounded once per level; and what the caller adds.
        let error = (f64::from(pdf) - expected[texel]).abs();
        assert!(error < 1e-5 * expected[texel] + absolute, "{what}, {}: pdf {pdf}", map.name);
        let quarter = 2 * usize::from(point.y.fract() >= 0.5) + usize::from(point.x.fract() >= 0.5);
        counts[4 * texel + quarter] += 1;
    }
    let quarters: Vec<f64> = expected.iter().flat_map(|p| [p / 4.0; 4]).collect();
    let (statistic, cells) = chi_square(&counts, &quarters, SAMPLES as f64);
    let critical = chi_square_critical(cells - 1, 0.01 / TESTS_IN_THIS_CRATE);
    assert!(statistic < critical, "{what}, {}: χ² {statistic} ≥ {critical}, {cells} cells", map.name);
}

#[test]
fn twenty_maps_pass_chi_square() {
    let maps = twenty_maps();
    assert_eq!(maps.len(), 20);
    for map in &maps {
        let pyramid = Pyramid::build(map.size, &map.values).unwrap();
        let warp = pyramid.warp(Empty::Error).unwrap();
        assert_follows("warp", map, 0.0, |u| warp.sample(u));
    }
}

#[test]
fn baselines_pass_chi_square() {
    for map in twenty_maps()
        .iter()
        .filter(|m| ["noise, not a power of two", "zero quads", "NaN texels"].contains(&m.name))
    {
        let alias = AliasTable::build(map.size, &map.values).unwrap();
        assert_follows("alias", map, 0.0, |u| alias.sample(u));
        let cdf = RowCdf::build(map.size, &map.values).unwrap();
        // Differences of sums near 1: half an ulp, 2⁻²⁵, for each of two ends on two axes.
        assert_follows("cdf", map, 0.5_f64.powi(23), |u| cdf.sample(u));
    }
}

#[test]
fn zeros_are_an_error_or_uniform() {
    for size in [[1, 1], [5, 3], [32, 32], [33, 1]] {
        for value in [0.0, -1.0, f32::NAN] {
            let map = map("zeros", size, |_, _| value);
            let pyramid = Pyramid::build(size, &map.values).unwrap();
            assert_eq!(pyramid.warp(Empty::Error).err(), Some(WarpError::AllZero));
            assert_eq!(AliasTable::build(size, &map.values).err(), Some(WarpError::AllZero));
            assert_eq!(RowCdf::build(size, &map.values).err(), Some(WarpError::AllZero));
            if value == 0.0 {
                let uniform = Map { values: vec![1.0; map.values.len()], ..map };
                let warp = pyramid.warp(Empty::Uniform).unwrap();
                assert_follows("uniform", &uniform, 0.0, |u| warp.sample(u));
            }
        }
    }
}

#[test]
fn wrong_input_is_refused() {
    assert_eq!(Pyramid::build([0, 4], &[]).err(), Some(WarpError::Size([0, 4])));
    assert_eq!(Pyramid::build([1 << 17, 1], &[]).err(), Some(WarpError::Size([1 << 17, 1])));
    assert_eq!(Pyramid::build([2, 2], &[1.0]).err(), Some(WarpError::Length { expected: 4, found: 1 }));
    assert_eq!(
        Pyramid::from_levels([2, 2], vec![1.0; 4]).err(),
        Some(WarpError::Length { expected: 5, found: 4 })
    );
    assert_eq!(Warp::new([0, 0], |_| 1.0, Empty::Uniform).err(), Some(WarpError::Size([0, 0])));
    assert_eq!(pyramid_len([1 << 16, 1 << 16]), None);
    let all: Vec<String> =
        [WarpError::Size([0, 1]), WarpError::AllZero].iter().map(ToString::to_string).collect();
    assert_eq!(all, ["importance map of 0×1 texels", "importance map without a positive value"]);
}

#[test]
fn any_u_is_taken() {
    let map = map("noise", [7, 5], noise);
    let pyramid = Pyramid::build(map.size, &map.values).unwrap();
    let warp = pyramid.warp(Empty::Error).unwrap();
    for u in [-1.0, -0.0, 1.0, 2.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN] {
        let s = warp.sample(Vec2::splat(u));
        assert!(s.pdf > 0.0 && warp.pdf(s.point) == s.pdf, "{u}: {s:?}");
    }
    for outside in [Vec2::new(-0.1, 1.0), Vec2::new(7.0, 1.0), Vec2::splat(f32::NAN)] {
        assert_eq!((warp.pdf(outside), warp.invert(outside)), (0.0, None));
    }
}

#[test]
fn a_point_stays_inside_its_texel_where_floats_are_coarse() {
    // Near 65 536 floats are 2⁻⁸ apart: the index plus u rounds up to the next index for the last 2⁻⁹ of u.
    let size = [65_536, 1];
    let mut values = vec![0.0; 65_536];
    values[65_535] = 1.0;
    let pyramid = Pyramid::build(size, &values).unwrap();
    let warp = pyramid.warp(Empty::Error).unwrap();
    let s = warp.sample(Vec2::splat(1.0 - f32::EPSILON / 2.0));
    assert_eq!((s.texel, s.point.x), ([65_535, 0], 65_536.0_f32.next_down()));
}

fn importance() -> impl Strategy<Value = ([u32; 2], Vec<f32>)> {
    let value = prop_oneof![3 => 0.0_f32..1.0, 2 => Just(0.0), 1 => 0.0_f32..1e6, 1 => Just(f32::NAN)];
    ((1_u32..40), (1_u32..40))
        .prop_flat_map(move |(w, h)| (Just([w, h]), prop::collection::vec(value.clone(), (w * h) as usize)))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2048, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn levels_are_sums((size, values) in importance()) {
        let pyramid = Pyramid::build(size, &values).unwrap();
        prop_assert_eq!(pyramid.levels().len(), pyramid_len(size).unwrap());
        prop_assert_eq!(level_size(size, top_level(size)), [1, 1]);
        let sum: f64 = values.iter().filter(|v| **v > 0.0).map(|v| f64::from(*v)).sum();
        let top = f64::from(pyramid.levels()[pyramid.levels().len() - 1]);
        // Two roundings per level.
        prop_assert!((top - sum).abs() <= 2.0 * 6.0 * f64::from(f32::EPSILON) * sum);
    }

    /// Per level and axis one product, one difference and one quotient, each rounded to 2⁻²⁴, here and on the way back; an
    /// error made at a level shrinks on the way back to the root. The place within the texel is rounded to the map's
    /// coordinates first: 2⁻¹⁹ at most below 40, and weighs as much as the texel does.
    #[test]
    fn invert_undoes_sample((size, values) in importance(), x in 0.0_f32..1.0, y in 0.0_f32..1.0) {
        let pyramid = Pyramid::build(size, &values).unwrap();
        let u = Vec2::new(x, y);
        let warp = pyramid.warp(Empty::Uniform).unwrap();
        let s = warp.sample(u);
        prop_assert_eq!(s.pdf, warp.pdf(s.point));
        let back = warp.invert(s.point).unwrap();
        let levels = top_level(size) as f32;
        let tolerance = levels * 8.0 * f32::EPSILON + 2.0_f32.powi(-19);
        prop_assert!((back - u).abs().max_element() <= tolerance, "{} → {:?} → {}", u, s, back);
    }

    /// A point drawn within a node lies beneath it, and its density given the node, times the node's share, is its density.
    #[test]
    fn a_node_is_drawn_from((size, values) in importance(), x in 0.0_f32..1.0, y in 0.0_f32..1.0, l: u32, i: u32) {
        let pyramid = Pyramid::build(size, &values).unwrap();
        let warp = pyramid.warp(Empty::Uniform).unwrap();
        let level = l % (top_level(size) + 1);
        let [w, h] = level_size(size, level);
        let (node, u) = ([i % w, i / w % h], Vec2::new(x, y));
        let s = warp.sample_within(level, node, u).unwrap();
        prop_assert_eq!(s.texel.map(|t| t >> level), node);
        prop_assert!(s.pdf > 0.0 && s.pdf <= 1.0);
        // The share of the node: one factor for each level above it, as the density of a point has.
        let within = |t: [u32; 2]| warp.pdf(Vec2::new(t[0] as f32 + 0.5, t[1] as f32 + 0.5));
        let beneath = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
        let share: f64 =
            beneath.filter(|t| t.map(|t| t >> level) == node).map(|t| f64::from(within(t))).sum();
        // A product of quotients, two roundings for each of up to six levels, and the densities of the sum likewise.
        prop_assert!((f64::from(s.pdf) * share - f64::from(within(s.texel))).abs() <= 24.0 * f64::from(f32::EPSILON) * share);
        prop_assert_eq!(warp.sample_within(0, [0, 0], u).map(|s| (s.texel, s.pdf)), Some(([0, 0], 1.0)));
        prop_assert_eq!(warp.sample_within(top_level(size), [0, 0], u), Some(warp.sample(u)));
        prop_assert!(warp.sample_within(level, [w, 0], u).is_none());
        prop_assert!(warp.sample_within(top_level(size) + 1, [0, 0], u).is_none());
    }

    /// ∫pdf = 1: the densities of all texel centres sum up to 1.
    #[test]
    fn density_integrates_to_one((size, values) in importance()) {
        let pyramid = Pyramid::build(size, &values).unwrap();
        let warp = pyramid.warp(Empty::Uniform).unwrap();
        let sum: f64 = (0..size[0] * size[1])
            .map(|i| f64::from(warp.pdf(Vec2::new((i % size[0]) as f32 + 0.5, (i / size[0]) as f32 + 0.5))))
            .sum();
        // A sum and a quotient per level, relative.
        prop_assert!((sum - 1.0).abs() < 3.0 * 6.0 * f64::from(f32::EPSILON));
    }

    /// Levels that do not add up, as filtered mip maps may: densities stay those of what is sampled, and nothing is NaN.
    #[test]
    fn inconsistent_levels_are_survived(
        size in prop::array::uniform2(1_u32..20), seed: u32, x in 0.0_f32..1.0, y in 0.0_f32..1.0
    ) {
        let values = (0..pyramid_len(size).unwrap() as u32).map(|i| match pcg_hash(seed ^ pcg_hash(i)) % 8 {
            0..=2 => 0.0,
            3 => f32::NAN,
            4 => f32::INFINITY,
            h => h as f32,
        });
        let pyramid = Pyramid::from_levels(size, values.collect()).unwrap();
        let warp = pyramid.warp(Empty::Uniform).unwrap();
        let s = warp.sample(Vec2::new(x, y));
        prop_assert!(s.pdf > 0.0 && s.pdf <= 1.0 && s.texel[0] < size[0] && s.texel[1] < size[1]);
        prop_assert_eq!(s.pdf, warp.pdf(s.point));
        let sum: f64 = (0..size[0] * size[1])
            .map(|i| f64::from(warp.pdf(Vec2::new((i % size[0]) as f32 + 0.5, (i / size[0]) as f32 + 0.5))))
            .sum();
        prop_assert!((sum - 1.0).abs() < 3.0 * 5.0 * f64::from(f32::EPSILON));
    }

    /// A batch draws what single calls draw, in its groups and in what is left over.
    #[test]
    fn batches_equal_single_calls((size, values) in importance(), u in prop::collection::vec((-0.1_f32..1.1, -0.1_f32..1.1), 0..70)) {
        let pyramid = Pyramid::build(size, &values).unwrap();
        let warp = pyramid.warp(Empty::Uniform).unwrap();
        let u: Vec<Vec2> = u.into_iter().map(Vec2::from).collect();
        let mut samples = vec![Sample::default(); u.len()];
        prop_assert_eq!(warp.sample_batch(&u, &mut samples), Ok(()));
        for (u, s) in u.iter().zip(&samples) {
            prop_assert_eq!(warp.sample(*u), *s);
        }
        samples.push(Sample::default());
        let wrong = WarpError::Length { expected: u.len(), found: u.len() + 1 };
        prop_assert_eq!(warp.sample_batch(&u, &mut samples), Err(wrong));
    }

    /// Levels of subnormal numbers, whose products round to whole multiples of 2⁻¹⁴⁹: a texel of 0 is never chosen.
    #[test]
    fn subnormal_levels_are_survived(
        size in prop::array::uniform2(1_u32..20), seed: u32, largest in 1_u32..8, u in prop::array::uniform2(0.0_f32..1.0)
    ) {
        let values = (0..pyramid_len(size).unwrap() as u32)
            .map(|i| f32::from_bits((pcg_hash(seed ^ pcg_hash(i)) % (2 * largest)).saturating_sub(largest - 1)));
        let pyramid = Pyramid::from_levels(size, values.collect()).unwrap();
        let warp = pyramid.warp(Empty::Uniform).unwrap();
        for u in [Vec2::from(u), Vec2::new(u[0], 1.0), Vec2::new(1.0, u[1])] {
            let s = warp.sample(u);
            prop_assert!(s.pdf > 0.0 && s.pdf <= 1.0 && s.pdf == warp.pdf(s.point), "{:?}", s);
            // Within the texel, and no NaN.
            prop_assert!(s.point.x.floor() == s.texel[0] as f32 && s.point.y.floor() == s.texel[1] as f32);
        }
    }
}
