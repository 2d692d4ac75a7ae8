//! Every mapping: samples against density (χ²), density against 1 (quadrature), inverse against sample.

mod common;

use core::f64::consts::{PI, TAU};

use common::{TESTS_IN_THIS_CRATE, chi_square_critical, random_points};
use glam::{Vec2, Vec3};
use indirect_sampling::{mapping::*, spherical_triangle::SphericalTriangle};
use proptest::prelude::*;

const SAMPLES: usize = 1_000_000;

/// χ² of a million samples over cells with the given probabilities; cells short of 5 expected samples are pooled.
fn assert_chi_square(name: &str, cell_of: impl Fn(Vec2) -> usize, probabilities: &[f64]) {
    let mut counts = vec![0_u32; probabilities.len()];
    for u in random_points(SAMPLES, 1) {
        counts[cell_of(u)] += 1;
    }
    let (statistic, cells) = common::chi_square(&counts, probabilities, SAMPLES as f64);
    let critical = chi_square_critical(cells - 1, 0.01 / TESTS_IN_THIS_CRATE);
    assert!(statistic < critical, "{name}: χ² {statistic} ≥ {critical}, {cells} cells");
}

const ROWS: usize = 40;
const COLUMNS: usize = 64;

/// Cell of a direction: equal steps of cosine between `z_min` and 1, and of azimuth.
fn direction_cell(d: Vec3, z_min: f32) -> usize {
    assert!((d.length() - 1.0).abs() < 1e-6, "{d} has length {}", d.length());
    let row = ((d.z - z_min) / (1.0 - z_min) * ROWS as f32) as usize;
    let column = (f64::from(d.y.atan2(d.x)) / TAU + 1.0).fract() * COLUMNS as f64;
    row.min(ROWS - 1) * COLUMNS + (column as usize).min(COLUMNS - 1)
}

/// Probabilities of these cells for a density that depends on the cosine alone: Simpson's rule with 64 intervals per cell.
fn direction_probabilities(z_min: f64, pdf: impl Fn(Vec3) -> f32) -> Vec<f64> {
    let at = |z: f64| {
        // The horizon itself may belong to either side.
        let z = z.clamp(-1.0, 1.0) + if z == 0.0 { 1e-12 } else { 0.0 };
        f64::from(pdf(Vec3::new((1.0 - z * z).sqrt() as f32, 0.0, z as f32)))
    };
    let mut probabilities = vec![];
    for row in 0..ROWS {
        let edge = |i: f64| z_min + (1.0 - z_min) * (row as f64 + i / 64.0) / ROWS as f64;
        let simpson: f64 = (0..32)
            .map(|i| 2.0 * f64::from(i))
            .map(|i| at(edge(i)) + 4.0 * at(edge(i + 1.0)) + at(edge(i + 2.0)))
            .sum();
        let ring = simpson * (edge(1.0) - edge(0.0)) / 3.0 * TAU;
        probabilities.extend([ring / COLUMNS as f64; COLUMNS]);
    }
    probabilities
}

/// χ² and ∫pdf = 1 of a density on the sphere above `z_min`.
fn assert_directions(name: &str, z_min: f32, sample: impl Fn(Vec2) -> Vec3, pdf: impl Fn(Vec3) -> f32) {
    let probabilities = direction_probabilities(f64::from(z_min), pdf);
    // The integrands are polynomials in z, or cⁿ, whose fourth derivative leaves Simpson's rule below 1e-6; the density
    // itself is f32.
    let sum: f64 = probabilities.iter().sum();
    assert!((sum - 1.0).abs() < 2e-6, "{name}: ∫pdf = {sum}");
    assert_chi_square(name, |u| direction_cell(sample(u), z_min), &probabilities);
}

#[test]
fn directions_follow_their_densities() {
    assert_directions("hemisphere_cosine", 0.0, hemisphere_cosine, hemisphere_cosine_pdf);
    assert_directions("hemisphere_uniform", 0.0, hemisphere_uniform, hemisphere_uniform_pdf);
    assert_directions("sphere_uniform", -1.0, sphere_uniform, |_| sphere_uniform_pdf());
    for one_minus_cos in [1e-6, 0.1, 1.7] {
        // A narrow cone's cosines leave f32 too few steps for cells of equal height: measured from the sine instead.
        let cell_z = |d: Vec3| {
            let h = if d.z > 0.0 { d.truncate().length_squared() / (1.0 + d.z) } else { 1.0 - d.z };
            d.with_z(1.0 - h / one_minus_cos)
        };
        let flat = |u| {
            let d = cell_z(cone_uniform(u, one_minus_cos));
            (d.truncate().normalize_or_zero() * (1.0 - d.z * d.z).max(0.0).sqrt()).extend(d.z)
        };
        assert_directions("cone_uniform", 0.0, flat, |_| {
            cone_uniform_pdf(Vec3::Z, one_minus_cos) * one_minus_cos
        });
    }
    for n in [0.0, 1.0, 7.5, 60.0] {
        assert_directions("phong_lobe", 0.0, |u| phong_lobe(u, n), |d| phong_lobe_pdf(d, n));
    }
}

#[test]
fn disc_is_uniform() {
    let cell = |p: Vec2| {
        let row = (p.length_squared() * 32.0) as usize;
        let column = ((f64::from(p.to_angle()) / TAU + 1.0).fract() * 32.0) as usize;
        row.min(31) * 32 + column.min(31)
    };
    assert_chi_square("disc_concentric", |u| cell(disc_concentric(u)), &[1.0 / 1024.0; 1024]);
    // Density times the disc's area.
    assert!((f64::from(disc_concentric_pdf(Vec2::new(0.6, 0.7))) * PI - 1.0).abs() < 1e-7);
    assert_eq!(disc_concentric_pdf(Vec2::new(0.8, 0.7)), 0.0);
}

#[test]
fn triangle_is_uniform() {
    let cell = |p: Vec2| {
        assert!(p.min_element() >= 0.0 && p.x + p.y <= 1.0);
        ((p.y * 32.0) as usize).min(31) * 32 + ((p.x * 32.0) as usize).min(31)
    };
    // Cells are whole, cut in half by the diagonal, or empty.
    let probabilities: Vec<f64> = (0..1024)
        .map(|i| match (i / 32_i32 + i % 32).cmp(&31) {
            core::cmp::Ordering::Less => 2.0 / 1024.0,
            core::cmp::Ordering::Equal => 1.0 / 1024.0,
            core::cmp::Ordering::Greater => 0.0,
        })
        .collect();
    assert_chi_square("triangle_uniform", |u| cell(triangle_uniform(u)), &probabilities);
    assert_eq!(triangle_uniform_pdf(Vec2::new(0.3, 0.3)), 2.0);
    assert_eq!(triangle_uniform_pdf(Vec2::new(0.6, 0.6)), 0.0);
}

/// 256 spherical triangles by halving edges four times, each with its own solid angle by the formula of Van Oosterom and
/// Strackee in f64.
#[test]
fn spherical_triangles_are_uniform() {
    let small = 0.02;
    let triangles = [
        [Vec3::X, Vec3::Y, Vec3::Z],
        [Vec3::new(1.0, 0.2, 0.1), Vec3::new(-0.9, 0.8, 0.3), Vec3::new(0.1, -0.9, -0.6)],
        [Vec3::new(0.0, 0.0, 1.0), Vec3::new(3.0 * small, 0.0, 1.0), Vec3::new(small, small, 1.0)],
    ];
    for vertices in triangles {
        let vertices = vertices.map(Vec3::normalize);
        let triangle = SphericalTriangle::new(vertices).unwrap();
        let [a, mut b, mut c] = vertices.map(|v| v.as_dvec3().normalize());
        if a.dot(b.cross(c)) < 0.0 {
            (b, c) = (c, b);
        }
        let mid = |p: glam::DVec3, q: glam::DVec3| (p + q).normalize();
        let mut cells = vec![[a, b, c]];
        for _ in 0..4 {
            cells = cells
                .iter()
                .flat_map(|&[a, b, c]| {
                    let (ab, bc, ca) = (mid(a, b), mid(b, c), mid(c, a));
                    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
                })
                .collect();
        }
        let angle = |[a, b, c]: [glam::DVec3; 3]| {
            2.0 * a.dot(b.cross(c)).abs().atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
        };
        let total = angle([a, b, c]);
        assert!((f64::from(triangle.solid_angle()) / total - 1.0).abs() < 1e-5);
        let probabilities: Vec<f64> = cells.iter().map(|&t| angle(t) / total).collect();
        assert!((probabilities.iter().sum::<f64>() - 1.0).abs() < 1e-9);
        // The path down the four subdivisions.
        let cell_of = |d: glam::DVec3| {
            let (mut t, mut index) = ([a, b, c], 0);
            for _ in 0..4 {
                let [a, b, c] = t;
                let (ab, bc, ca) = (mid(a, b), mid(b, c), mid(c, a));
                let beyond = |p: glam::DVec3, q: glam::DVec3| p.cross(q).dot(d) > 0.0;
                let child = if beyond(ab, ca) {
                    0
                } else if beyond(bc, ab) {
                    1
                } else if beyond(ca, bc) {
                    2
                } else {
                    3
                };
                t = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]][child];
                index = index * 4 + child;
            }
            index
        };
        assert_chi_square("spherical triangle", |u| cell_of(triangle.sample(u).as_dvec3()), &probabilities);
    }
}

fn unit_vector() -> impl Strategy<Value = Vec3> {
    (0.0_f32..1.0, 0.0_f32..1.0).prop_map(|(x, y)| sphere_uniform(Vec2::new(x, y)))
}

fn unit() -> impl Strategy<Value = f32> {
    // The corners of the square, its centre lines and diagonals are where mappings branch.
    prop_oneof![8 => 0.0_f32..1.0, 1 => Just(0.0), 1 => Just(0.5), 1 => Just(1.0 - f32::EPSILON / 2.0)]
}

fn square() -> impl Strategy<Value = Vec2> {
    prop_oneof![
        8 => (unit(), unit()).prop_map(|(x, y)| Vec2::new(x, y)),
        1 => unit().prop_map(Vec2::splat),
        1 => unit().prop_map(|x| Vec2::new(x, 1.0 - x)),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 8192, max_global_rejects: 65_536, failure_persistence: None, ..ProptestConfig::default() })]

    /// A mapping stretches u by at most 2 along its axes, inverses shrink it again; about ten roundings of 2⁻²⁴ relative to
    /// numbers up to 2 lie between.
    #[test]
    fn inverses_undo_samples(u in square(), log_cone in -6.0_f32..0.3, n in 0.0_f32..200.0) {
        const TOLERANCE: f32 = 20.0 * f32::EPSILON;
        let close = |name: &str, back: Vec2| -> Result<(), TestCaseError> {
            prop_assert!((back - u).abs().max_element() <= TOLERANCE, "{}: {} → {}", name, u, back);
            Ok(())
        };
        close("disc", disc_concentric_invert(disc_concentric(u)))?;
        close("triangle", triangle_uniform_invert(triangle_uniform(u)))?;
        close("cosine", hemisphere_cosine_invert(hemisphere_cosine(u)))?;
        close("hemisphere", hemisphere_uniform_invert(hemisphere_uniform(u)))?;
        let cone = 10.0_f32.powf(log_cone).min(1.9);
        close("cone", cone_uniform_invert(cone_uniform(u, cone), cone))?;
        close("phong", phong_lobe_invert(phong_lobe(u, n), n))?;
        close("sphere", sphere_uniform_invert(sphere_uniform(u)))?;
    }

    #[test]
    fn densities_are_positive_where_samples_fall(u in square(), n in 0.0_f32..200.0) {
        prop_assert!(hemisphere_cosine_pdf(hemisphere_cosine(u)) > 0.0);
        prop_assert!(hemisphere_uniform_pdf(hemisphere_uniform(u)) > 0.0);
        prop_assert!(phong_lobe(u, n).z > 0.0);
        for d in [hemisphere_cosine(u), hemisphere_uniform(u), sphere_uniform(u), phong_lobe(u, n), cone_uniform(u, 0.3)] {
            prop_assert!((d.length() - 1.0).abs() <= 4.0 * f32::EPSILON, "{} {}", d, d.length() - 1.0);
        }
    }

    /// 1/2π(1 − cosθ_max) wherever samples fall, the rim included, and 0 outside of the cone.
    #[test]
    fn cone_density_ends_at_the_rim(u in square(), log_cone in -9.0_f32..0.3, off in 1e-5_f32..1.0) {
        let cone = 10.0_f32.powf(log_cone).min(1.9);
        let density = 1.0 / (core::f32::consts::TAU * cone);
        let rim = cone_uniform(Vec2::new(u.x, 0.0), cone);
        for d in [cone_uniform(u, cone), rim, cone_uniform(Vec2::new(1.0 - f32::EPSILON / 2.0, u.y), cone)] {
            prop_assert_eq!(cone_uniform_pdf(d, cone), density, "{} {}", d, cone);
        }
        // Beyond the rim by two steps of a cosine near 1 and more, down to the opposite pole.
        let z = 1.0 - cone - 2.0 * f32::EPSILON - off * (2.0 - cone - 2.0 * f32::EPSILON);
        let outside = (rim.truncate().normalize_or(Vec2::X) * (1.0 - z * z).max(0.0).sqrt()).extend(z);
        prop_assert_eq!(cone_uniform_pdf(outside, cone), 0.0, "{} {}", outside, cone);
        prop_assert_eq!(cone_uniform_pdf(Vec3::NEG_Z, cone), 0.0);
    }

    /// Directions are rounded to 2⁻²⁴; how far that moves `u` grows as the three vertices approach one plane through the
    /// centre, where the triangle is a sliver or nearly a hemisphere: as 1 / det(a, b, c). Half an ulp at each vertex, at the sample
    /// and in a dozen operations make the 16ε; the largest of 60 million random cases is 7.7ε.
    #[test]
    fn spherical_triangle_is_inverted(x in 0.0_f32..1.0, y in 0.01_f32..1.0, a in unit_vector(), b in unit_vector(), c in unit_vector()) {
        let edges = [(a, b), (b, c), (c, a)];
        prop_assume!(edges.iter().all(|(p, q)| p.distance(*q) > 0.4 && p.dot(*q) > -0.8));
        let Some(triangle) = SphericalTriangle::new([a, b, c]) else { return Ok(()) };
        prop_assume!(triangle.solid_angle() > 0.1);
        let u = Vec2::new(x, y);
        let d = triangle.sample(u);
        prop_assert!((d.length() - 1.0).abs() <= 4.0 * f32::EPSILON, "{}", d.length() - 1.0);
        let back = triangle.invert(d);
        let tolerance = 16.0 * f32::EPSILON / a.dot(b.cross(c)).abs();
        prop_assert!((back - u).abs().max_element() <= tolerance, "{} → {} → {}", u, d, back);
    }

    #[test]
    fn hopeless_spherical_triangles_are_refused(a in unit_vector(), b in unit_vector(), t in 0.0_f32..1.0) {
        prop_assert_eq!(SphericalTriangle::new([a, a, b]), None);
        prop_assert_eq!(SphericalTriangle::new([a, b, b]), None);
        // A third vertex on the edge: no area.
        let on_edge = a.lerp(b, t).normalize_or(a);
        prop_assert_eq!(SphericalTriangle::new([a, b, on_edge]), None);
    }
}
