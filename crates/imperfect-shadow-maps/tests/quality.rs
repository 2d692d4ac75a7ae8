//! How often maps err against rays, at the defaults, on the fixtures.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use common::{Stage, Wrong};
use imperfect_shadow_maps::cpu::{Atlas, build, cast};
use imperfect_shadow_maps::{Options, Placement, Point};

/// Bounds of both kinds of errors, percent, at the defaults: the mean of eight seeds (of VPLs, receivers and points) and four of
/// their standard deviations, rounded up to a tenth: 2.63 + 4·0.32 and so on, as `examples/figures.rs` prints them.
#[test]
fn errors_at_the_defaults_stay_within_their_spread() {
    for (name, leak, shade) in BOUNDS {
        let scene = indirect_scene::fixtures::build(name).unwrap();
        for seed in [11, 12] {
            let stage = Stage::new(&scene, seed);
            let found = stage.built(Options::default(), seed);
            assert!(found.leak < leak && found.shade < shade, "{name} {seed}: {found:?}");
        }
    }
}

const BOUNDS: [(&str, f64, f64); 3] =
    [("cornell_spot", 4.0, 8.6), ("two_rooms", 3.8, 10.5), ("atrium", 13.7, 16.4)];

#[test]
fn more_points_more_texels_and_rays_err_less() {
    let scene = indirect_scene::fixtures::build("cornell_spot").unwrap();
    let stage = Stage::new(&scene, 1);
    let d = Options::default();
    let sum = |o: Options| stage.built(o, 3).sum();
    let few = sum(Options { points_per_map: 256, ..d });
    let many = sum(Options { points_per_map: 8192, ..d });
    assert!(sum(d) < few && many < sum(d), "{few} {} {many}", sum(d));
    assert!(sum(Options { tile: 64, ..d }) < sum(d) && sum(d) < sum(Options { tile: 16, ..d }));
    let exact = stage.wrong(&cast(&stage.accel, &stage.vpls, &d));
    assert!(exact.sum() < sum(d), "{exact:?}");
    // Ray-cast maps converge to rays: their errors are at silhouettes and contacts, whose share of texels halves with the side.
    let fine = stage.wrong(&cast(&stage.accel, &stage.vpls, &Options { tile: 256, ..d }));
    assert!(fine.sum() < 0.5 * exact.sum(), "{fine:?} {exact:?}");
    // Even points leave fewer holes, before any are filled.
    let sparse = Options { overlap: 1.0, ..d };
    let even = stage.built(sparse, 3).leak;
    let random = stage.built(Options { placement: Placement::Random, ..sparse }, 3).leak;
    assert!(even < random, "{even} {random}");
    // Filling closes holes: fewer leaks.
    let filled = stage.built(Options { pull_push: 2, ..sparse }, 3).leak;
    assert!(filled < 0.7 * even, "{filled} {even}");
}

/// What the bounds must refuse.
#[test]
fn planted_faults_are_refused() {
    let (name, leak, shade) = BOUNDS[0];
    let scene = indirect_scene::fixtures::build(name).unwrap();
    let stage = Stage::new(&scene, 1);
    let options = Options::default();
    let points = stage.points(&options, 3);
    let refused = |what: &str, found: Wrong| {
        assert!(found.leak > leak || found.shade > shade, "{what}: {found:?}");
    };
    let atlas = build(&stage.vpls, &points, &options);
    refused("no map", stage.wrong(&Atlas { depths: vec![0.0; atlas.depths.len()], ..atlas.clone() }));
    // Axes swapped, in the query only.
    let mut swapped = atlas.clone();
    for frame in &mut swapped.frames {
        core::mem::swap(&mut frame.tangent, &mut frame.bitangent);
    }
    refused("swapped axes", stage.wrong(&swapped));
    // The map of the next VPL.
    let mut shifted = atlas.clone();
    shifted.depths.rotate_left(atlas.ism.texels());
    refused("another's map", stage.wrong(&shifted));
    // Depths a third too near.
    let mut near = atlas.clone();
    near.depths.iter_mut().for_each(|u| *u *= 1.5);
    refused("near depths", stage.wrong(&near));
    // Splats of an area that does not know that a map draws a part of the points.
    let part = options.points_per_map as f32 / options.points as f32;
    let small: Vec<Point> = points.iter().map(|p| Point { area: p.area * part, ..*p }).collect();
    refused("small splats", stage.wrong(&build(&stage.vpls, &small, &options)));
    // Splats with the depth of their points instead of their planes'.
    let facing = |p: &Point| Point { normal: (p.position - stage.vpls[0].position).normalize(), ..*p };
    let turned: Vec<Point> = points.iter().map(facing).collect();
    refused("no planes", stage.wrong(&build(&stage.vpls, &turned, &options)));
}
