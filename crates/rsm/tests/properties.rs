//! Pyramids, VPLs and the gather over random maps and poses.
#![cfg(feature = "cpu")]
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use core::f32::consts::PI;

use common::{noise_map, noise_rsm};
use glam::{DVec3, Vec3};
use indirect_core::{form_factor, math::luminance};
use proptest::prelude::*;
use rsm::{Form, Map, Node, PyramidLayout, Selection, Vpl, cpu};

fn config(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

/// The texels beneath a node.
fn beneath(map: &Map, level: usize, x: u32, y: u32) -> impl Iterator<Item = usize> + '_ {
    let [width, height] = map.surface.size;
    let range = move |i: u32, n: u32| (i << level)..((i + 1) << level).min(n);
    let rows = range(y, height);
    rows.flat_map(move |row| range(x, width).map(move |column| (row * width + column) as usize))
        .filter(|&i| map.texels[i].incident.max_element() > 0.0)
}

fn check_node(map: &Map, node: &Node, level: usize, x: u32, y: u32) -> Result<(), TestCaseError> {
    let (mut reflected, mut incident, mut count) = (DVec3::ZERO, DVec3::ZERO, 0);
    let (mut least, mut greatest) = (f32::MAX, 0.0_f32);
    for i in beneath(map, level, x, y) {
        reflected += map.texels[i].reflected.as_dvec3();
        incident += map.texels[i].incident.as_dvec3();
        least = least.min(map.surface.depth[i]);
        greatest = greatest.max(map.surface.depth[i]);
        count += 1;
        // Dots of unit vectors round to 2e-7, and the versine adds up as much per level.
        let versine = 1.0 - map.surface.normal[i].dot(node.cone_axis);
        prop_assert!(
            versine <= node.cone_versine + 3e-6,
            "level {}: {} {}",
            level,
            versine,
            node.cone_versine
        );
    }
    prop_assert_eq!(node.is_empty(), count == 0);
    prop_assert_eq!((node.depth_min, node.depth_max), (least, greatest));
    // A pairwise sum of positive numbers: one rounding per level.
    let close = |a: Vec3, b: DVec3| (a.as_dvec3() - b).abs().max_element() <= 2e-6 * b.max_element();
    prop_assert!(close(node.reflected, reflected) && close(node.incident, incident));
    prop_assert!(count == 0 || (node.cone_axis.length() - 1.0).abs() < 1e-6);
    prop_assert!((0.0..=2.0).contains(&node.cone_versine));
    Ok(())
}

proptest! {
    #![proptest_config(config(64))]

    #[test]
    fn pyramids_bound_and_sum_what_is_beneath(
        width in 1_u32..40, height in 1_u32..40, seed: u32, empty in 0.0_f32..1.0
    ) {
        let map = noise_map([width, height], seed, empty);
        for (level, l) in map.pyramid.layout.levels.iter().enumerate() {
            for (i, node) in map.pyramid.level(level).iter().enumerate() {
                let i = i as u32;
                check_node(&map, node, level, i % l.size[0], i / l.size[0])?;
            }
        }
    }

    #[test]
    fn vpls_carry_the_flux_of_the_maps(
        resolution in 1_u32..24, maps in 1_u32..5, seed: u32, empty in 0.0_f32..1.0, cells in 1_u32..40, count in 1_u32..200
    ) {
        let rsm = noise_rsm(resolution, maps, seed, empty);
        let flux = rsm.reflected();
        let area: f64 = rsm.maps.iter().flat_map(|m| &m.texels).map(|t| f64::from(t.area)).sum();
        for selection in [Selection::All, Selection::Grid { cells }, Selection::Importance { count }] {
            let slots = cpu::vpls(&rsm, selection, &selection.points(seed));
            prop_assert_eq!(slots.len(), selection.slot_count(maps as usize, resolution));
            let vpls = cpu::compact(&slots);
            let sum: DVec3 = vpls.iter().map(|v| v.flux.as_dvec3()).sum();
            if flux == DVec3::ZERO {
                prop_assert!(vpls.is_empty());
                continue;
            }
            let lit = |v: &Vpl| v.flux.min_element() >= 0.0 && v.flux.max_element() > 0.0 && v.flux.is_finite();
            prop_assert!(vpls.iter().all(lit));
            if let Selection::Importance { count } = selection {
                // No VPL is lost to unlit texels, all have the same luminance, and it adds up: roundings of the pyramid's
                // sums and of a density with two factors per level.
                prop_assert_eq!(vpls.len(), count as usize);
                let total = luminance(flux.as_vec3());
                for v in &vpls {
                    let l = luminance(v.flux) * count as f32;
                    prop_assert!((l - total).abs() <= 2e-5 * total, "{} {}", l, total);
                }
            } else {
                prop_assert!((sum - flux).abs().max_element() <= 1e-5 * flux.max_element());
                let found: f64 = vpls.iter().map(|v| f64::from(v.area)).sum();
                prop_assert!((found - area).abs() <= 1e-5 * area);
            }
        }
    }
}

proptest! {
    #![proptest_config(config(2048))]

    /// Image-space radiosity's eq. 1 with 5: radiosity times the disc's form factor.
    #[test]
    fn the_kernel_is_the_disc_and_the_point_form(
        y in prop::array::uniform3(-1.0_f32..1.0), n in prop::array::uniform3(-1.0_f32..1.0),
        m in prop::array::uniform3(-1.0_f32..1.0), exponent in -3_i32..4, area in 1e-4_f32..10.0
    ) {
        let s = 10.0_f32.powi(exponent);
        let (n, m) = (Vec3::from(n).normalize_or(Vec3::Y), Vec3::from(m).normalize_or(Vec3::Y));
        let (position, area) = (Vec3::from(y) * s, area * s * s);
        let vpl = Vpl::new(position, m, Vec3::new(1.0, 2.0, 0.5) * area, area);
        let receivers = [(Vec3::ZERO, n)].into_iter().collect();
        let exact = [
            (Form::Disc, form_factor::point_to_disc(Vec3::ZERO, n, position, m, area)),
            (Form::Point, form_factor::point_to_point(Vec3::ZERO, n, position, m, area)),
        ];
        for (form, factor) in exact {
            let e = cpu::gather(&[vpl], &receivers, form)[0];
            // Cosines near 0 are differences: their error is that of a unit dot product, 2e-7 of the largest factor.
            let largest = area / (PI * position.length_squared());
            prop_assert!((e.x - factor).abs() <= 1e-5 * factor + 5e-7 * largest, "{} {}", e.x, factor);
            prop_assert!((e - e.x * Vec3::new(1.0, 2.0, 0.5)).abs().max_element() <= 1e-6 * e.x);
        }
    }

    #[test]
    fn the_kernel_is_finite_everywhere(
        y in prop::array::uniform3(-1.0_f32..1.0), m in prop::array::uniform3(-1.0_f32..1.0),
        exponent in -30_i32..12, area in prop::sample::select(vec![0.0_f32, 1e-30, 1e-12, 1.0, 1e12]),
        form in prop::sample::select(vec![Form::Disc, Form::Point])
    ) {
        let m = Vec3::from(m).normalize_or(Vec3::Y);
        let vpl = Vpl::new(Vec3::from(y) * 10.0_f32.powi(exponent), m, Vec3::ONE, area);
        let e = cpu::gather(&[vpl, Vpl::default()], &[(Vec3::ZERO, Vec3::Y)].into_iter().collect(), form)[0];
        prop_assert!(e.is_finite() && e.min_element() >= 0.0, "{}", e);
        // A disc never gives more than its own radiosity.
        prop_assert!(form == Form::Point || area == 0.0 || e.x <= 1.0001 / area, "{} {}", e, area);
    }
}

/// Thesis eq. 2.32: the flux of a VPL is what its intensity `Φ/π cosθ` adds up to over the hemisphere. Without the 1/π it
/// would be π times as much.
#[test]
fn a_vpl_radiates_its_flux() {
    let vpl = Vpl::new(Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, 2.0, -2.0) / 3.0, Vec3::splat(5.0), 0.1);
    let (t, b) = indirect_core::math::orthonormal_basis(vpl.normal);
    let (rings, sectors, radius) = (64, 64, 2.0_f32);
    // Equal areas in z: midpoints on a dome that faces the VPL.
    let dome = (0..rings * sectors).map(|i| {
        let z = ((i / sectors) as f32 + 0.5) / rings as f32;
        let phi = ((i % sectors) as f32 + 0.5) / sectors as f32 * 2.0 * PI;
        let w = (t * phi.cos() + b * phi.sin()) * (1.0 - z * z).sqrt() + vpl.normal * z;
        (vpl.position + w * radius, -w)
    });
    let e = cpu::gather(&[vpl], &dome.collect(), Form::Point);
    let patch = 2.0 * PI * radius * radius / (rings * sectors) as f32;
    let total: f64 = e.iter().map(|e| f64::from(e.x * patch)).sum();
    // The integrand is linear in z: the midpoint rule is exact.
    assert!((total / 5.0 - 1.0).abs() < 1e-5, "{total}");
}

/// Radiance Hints eq. 2–4: cosines of unit vectors over d², against the exact form factor of a small square.
#[test]
fn one_patch_matches_the_closed_form() {
    let (h, centre) = (0.01_f32, Vec3::new(0.7, 1.9, -0.4));
    let square = [(-h, -h), (h, -h), (h, h), (-h, h)].map(|(x, z)| centre + Vec3::new(x, 0.0, z));
    let n = Vec3::new(0.2, 0.9, 0.1).normalize();
    let exact = form_factor::point_to_polygon(Vec3::ZERO, n, &square);
    let vpl = Vpl::new(centre, Vec3::NEG_Y, Vec3::splat(4.0 * h * h), 4.0 * h * h);
    let e = cpu::gather(&[vpl], &[(Vec3::ZERO, n)].into_iter().collect(), Form::Point)[0].x;
    // The patch's size over its distance, squared, is 2.5e-5; the exact form rounds to f32.
    assert!((e / exact - 1.0).abs() < 2e-4, "{e} {exact}");
    // As printed, with the unnormalized inner product in the numerator, the factor would be d too large.
    assert!((e * centre.length() / exact - 1.0).abs() > 0.5);
}

/// The disc form's closed form on its axis, and its far field.
#[test]
fn a_disc_on_its_axis_and_far_away() {
    let area = 0.3_f32;
    let at = |d: f32, form| {
        let vpl = Vpl::new(Vec3::Y * d, Vec3::NEG_Y, Vec3::splat(area), area);
        cpu::gather(&[vpl], &[(Vec3::ZERO, Vec3::Y)].into_iter().collect(), form)[0].x
    };
    for d in [1e-3_f32, 0.1, 1.0, 30.0] {
        let r2 = area / PI;
        assert!((at(d, Form::Disc) / (r2 / (r2 + d * d)) - 1.0).abs() < 1e-5);
    }
    assert!((at(100.0, Form::Disc) / at(100.0, Form::Point) - 1.0).abs() < 2e-5);
}

/// Colours come out right in expectation: 65 536 VPLs of a map of random colours.
#[test]
fn importance_keeps_colours_in_expectation() {
    let rsm = noise_rsm(32, 2, 9, 0.3);
    let selection = Selection::Importance { count: 1 << 16 };
    let sum: DVec3 = cpu::vpls(&rsm, selection, &selection.points(1)).iter().map(|v| v.flux.as_dvec3()).sum();
    // Independent draws would have a relative standard error of about 1/√65536 = 0.4 %; stratified ones have less.
    let flux = rsm.reflected();
    assert!(((sum - flux) / flux).abs().max_element() < 5e-3, "{sum} {flux}");
}

#[test]
fn layouts_cover_every_size() {
    for size in [[1, 1], [1, 7], [2, 3], [5, 5], [64, 64], [1023, 3]] {
        let layout = PyramidLayout::new(size);
        assert_eq!(layout.levels[0].size, size);
        assert_eq!(layout.levels.last().unwrap().size, [1, 1]);
        for pair in layout.levels.windows(2) {
            assert_eq!(pair[1].size, pair[0].size.map(|n| n.div_ceil(2)));
            assert_eq!(pair[1].offset, pair[0].offset + pair[0].len() as u32);
        }
        // The layout that hierarchical warping reads.
        assert_eq!(Some(layout.len()), indirect_sampling::warp::pyramid_len(size));
    }
}
