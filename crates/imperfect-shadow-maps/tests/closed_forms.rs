//! Maps of planes and single points, whose depths and sizes are known.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use glam::{Vec2, Vec3};
use imperfect_shadow_maps::cpu::{Atlas, cast, pull, push, splat};
use imperfect_shadow_maps::{EMPTY, Ism, Options, Point};
use indirect_accel::{Accel, BuildPreset};
use indirect_core::{Material, Scene};
use rsm::Vpl;

const SIDE: usize = 32;

fn vpl(normal: Vec3) -> Vpl {
    Vpl::new(Vec3::new(0.3, -0.2, 0.7), normal.normalize(), Vec3::ONE, 0.01)
}

fn point(position: Vec3, normal: Vec3, area: f32) -> Point {
    Point { position, normal, area, ..Point::default() }
}

/// Unit direction in the world of the middle of texel `i`; `None` outside of the hemisphere.
fn direction(atlas: &Atlas, i: usize) -> Option<Vec3> {
    let side = atlas.ism.tile as usize;
    let q = Vec2::new((i % side) as f32 + 0.5, (i / side) as f32 + 0.5) * (2.0 / side as f32) - 1.0;
    let r2 = q.length_squared();
    let local = Vec3::new(2.0 * q.x, 2.0 * q.y, 1.0 - r2) / (1.0 + r2);
    (r2 < 1.0).then(|| atlas.frames[0].world(local))
}

/// `1 / (d + h)` of the plane through `p`, along a unit direction from the VPL; 0 where it is not met.
fn plane(vpl: &Vpl, p: Vec3, normal: Vec3, direction: Vec3) -> f64 {
    let facing = normal.as_dvec3().dot(direction.as_dvec3());
    let d = normal.as_dvec3().dot((p - vpl.position).as_dvec3()) / facing;
    if d > 0.0 { 1.0 / (d * (1.0 + vpl.normal.as_dvec3().dot(direction.as_dvec3()))) } else { 0.0 }
}

/// All that differs by more than rounding: a dozen operations of 6·10⁻⁸, on sums whose terms are up to ten times the result.
fn differ(found: f32, expected: f64, largest: f64) -> bool {
    (f64::from(found) - expected).abs() > 1e-5 * largest
}

fn plane_errors(normal: Vec3, fault: impl Fn(&mut Point)) -> (usize, usize) {
    let vpl = vpl(Vec3::new(0.2, 0.3, 1.0));
    let middle = vpl.position + vpl.normal * 2.0;
    let (t, b) = indirect_core::math::orthonormal_basis(normal);
    let mut points = Vec::new();
    for i in -40..40 {
        for k in -40..40 {
            let p = middle + (t * (i as f32 + 0.5) + b * (k as f32 + 0.5)) * 0.1;
            points.push(point(p, normal, 0.01));
        }
    }
    points.iter_mut().for_each(fault);
    let options = Options { tile: SIDE as u32, points_per_map: 1 << 20, ..Options::default() };
    let atlas = splat(&[vpl], &points, &options);
    let (mut drawn, mut wrong) = (0, 0);
    for (i, u) in atlas.depths.iter().enumerate().filter(|(_, u)| **u != EMPTY) {
        let Some(direction) = direction(&atlas, i) else { continue };
        drawn += 1;
        let expected = plane(&vpl, middle, normal, direction);
        // Near the horizon the plane of a point is cut off at half its distance.
        wrong += usize::from(differ(*u, expected, 1.0 / 2.0));
    }
    (drawn, wrong)
}

/// A plane drawn as points has the plane's depth at the middle of every texel, however it is turned.
#[test]
fn points_of_a_plane_have_its_depth() {
    for normal in [Vec3::Z, Vec3::new(0.4, 0.1, -1.0), Vec3::new(-0.9, 0.3, 0.6)] {
        let normal = normal.normalize();
        let (drawn, wrong) = plane_errors(normal, |_| {});
        assert!(drawn > SIDE * SIDE / 3 && wrong == 0, "{normal}: {wrong} of {drawn}");
    }
    // Planted faults: the depth of the point instead of the plane's (a normal that faces the VPL), and a plane that is tilted.
    let origin = vpl(Vec3::new(0.2, 0.3, 1.0)).position;
    let (drawn, wrong) = plane_errors(Vec3::Z, |p| p.normal = (p.position - origin).normalize());
    assert!(2 * wrong > drawn, "{wrong} of {drawn}");
    let (drawn, wrong) = plane_errors(Vec3::Z, |p| p.normal = Vec3::new(0.01, 0.0, 1.0).normalize());
    assert!(2 * wrong > drawn, "{wrong} of {drawn}");
}

/// Texels that one point covers, the mean over many places of the point; what `side` claims of the solid angle.
fn covered(distance: f32, tilt: f32, area: f32, tile: u32, elevation: f32) -> (f64, f64) {
    let vpl = vpl(Vec3::Z);
    let options = Options { tile, overlap: 1.0, points_per_map: 1, ..Options::default() };
    let (mut found, mut expected) = (0.0, 0.0);
    const PLACES: u32 = 2000;
    for i in 0..PLACES {
        let angle = i as f32 * 2.399_963;
        let z = elevation;
        let r = (1.0 - z * z).sqrt();
        let along = Vec3::new(r * angle.cos(), r * angle.sin(), z);
        let across = along.any_orthonormal_vector();
        let normal = along * tilt.cos() + across * tilt.sin();
        let atlas = splat(&[vpl], &[point(vpl.position + along * distance, normal, area)], &options);
        found += atlas.depths.iter().filter(|u| **u != EMPTY).count() as f64;
        // Solid angle of the tilted disc by its projected area, over that of a texel.
        let (d, c) = (f64::from(distance), f64::from(tilt).cos());
        let omega = f64::from(area) * c / (d * d + f64::from(area) / core::f64::consts::PI);
        let z = f64::from(vpl.normal.dot(along));
        expected += omega * (f64::from(tile) / 2.0).powi(2) / (1.0 + z).powi(2);
    }
    (found / f64::from(PLACES), expected / f64::from(PLACES))
}

/// A splat covers as many texels as its disc's solid angle, where that is more than one and less than the cap.
#[test]
fn splats_cover_their_solid_angle() {
    for (distance, tilt, elevation) in [(2.0, 0.0, 0.9), (3.0, 0.8, 0.5), (5.0, 0.3, 0.7)] {
        let (found, expected) = covered(distance, tilt, 0.4, 64, elevation);
        // A side of s texels covers ⌊s⌋ or ⌈s⌉ of an axis: each count's deviation is below s + ½; 2000 places that are spread
        // evenly average it to less than 3 %.
        assert!((found / expected - 1.0).abs() < 0.05, "{found} {expected}");
        // Planted faults: a dropped cosine, and a dropped density of the paraboloid.
        if tilt > 0.5 {
            assert!((found * f64::from(tilt).cos() / expected - 1.0).abs() > 0.2);
        }
        assert!((found * (1.0 + f64::from(elevation)).powi(2) / expected - 1.0).abs() > 0.2);
    }
}

/// One ray per texel meets a plane where it is.
#[test]
fn cast_maps_of_a_plane() {
    let vpl = vpl(Vec3::new(0.1, 0.0, 1.0));
    let normal = Vec3::new(0.2, 0.3, -1.0).normalize();
    let middle = vpl.position + Vec3::Z * 2.0;
    let (t, b) = indirect_core::math::orthonormal_basis(normal);
    let mut scene = Scene { materials: vec![Material::diffuse("m", Vec3::ONE)], ..Scene::default() };
    let corner = |x: f32, y: f32| middle + (t * x + b * y) * 3.0;
    scene.mesh.push_polygon(&[corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)], 0);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let atlas = cast(&accel, &[vpl], &Options::default());
    let mut hits = 0;
    for (i, u) in atlas.depths.iter().enumerate().filter(|(_, u)| **u != EMPTY) {
        let direction = direction(&atlas, i).unwrap();
        hits += 1;
        // The ray begins 10⁻⁵ of the scene above the VPL.
        let expected = plane(&vpl, middle, normal, direction);
        assert!((f64::from(*u) / expected - 1.0).abs() < 3e-4, "{u} {expected}");
    }
    assert!(hits > 100, "{hits}");
}

/// A map whose texels are `u(x, y)`.
fn map(levels: u32, u: impl Fn(f32, f32) -> f32) -> Atlas {
    let options = Options { tile: SIDE as u32, pull_push: levels, ..Options::default() };
    let ism = Ism::new(&options, 1, 1);
    let mut atlas = Atlas::new(ism, &[vpl(Vec3::Z)]);
    for (i, texel) in atlas.depths.iter_mut().enumerate() {
        *texel = u((i % SIDE) as f32, (i / SIDE) as f32);
    }
    atlas
}

fn filled(mut atlas: Atlas) -> Vec<f32> {
    pull(&mut atlas);
    push(&mut atlas);
    atlas.depths
}

/// Nothing on a plane is taken for a hole, however steep; a silhouette between two planes stays where it is.
#[test]
fn planes_and_silhouettes_stay() {
    for levels in 0..=4 {
        for slope in [0.0, 0.01, 0.1, 1.0] {
            let atlas = map(levels, |x, y| 0.1 + slope * (x + 0.5 * y));
            assert_eq!(changed(&atlas), 0, "slope {slope} levels {levels}");
        }
        // A straight edge on a border of the coarsest texels.
        let atlas = map(levels, |x, _| if x < 16.0 { 1.0 } else { 0.1 });
        assert_eq!(changed(&atlas), 0, "levels {levels}");
    }
}

/// Texels that filling changes.
fn changed(atlas: &Atlas) -> usize {
    filled(atlas.clone()).iter().zip(&atlas.depths).filter(|(a, b)| a != b).count()
}

/// Holes close: those that are empty, and those through which something far is seen. A lone texel in front of others is no
/// surface.
#[test]
fn holes_close() {
    for hole in [EMPTY, 0.2] {
        // One of every 4 × 4.
        let pierced = map(2, |x, y| if x % 4.0 == 1.0 && y % 4.0 == 2.0 { hole } else { 1.0 });
        let closed = filled(pierced.clone());
        // Those that are seen through are told from a border of the map only inside.
        let inner = |i: &usize| hole == EMPTY || (!i.is_multiple_of(SIDE) && i / SIDE + 1 < SIDE);
        let open = (0..SIDE * SIDE).filter(inner).filter(|i| (closed[*i] - 1.0).abs() > 1e-6).count();
        assert_eq!(open, 0, "{hole}");
        // Planted fault: without levels nothing closes.
        let mut open = pierced;
        open.ism.levels = 0;
        assert!(filled(open).contains(&hole));
    }
    let lone = map(2, |x, y| if x == 9.0 && y == 9.0 { 1.0 } else { 0.2 });
    assert_eq!(changed(&lone), 0);
    // Three of four texels are empty, as where points are few.
    let sparse = map(2, |x, y| if x % 2.0 == 0.0 && y % 2.0 == 0.0 { 0.7 } else { EMPTY });
    assert!(filled(sparse).iter().all(|u| (u - 0.7).abs() < 1e-6));
}

/// A receiver on the plane that shades it is lit, one behind it is not, for both queries.
#[test]
fn a_wall_shades_what_is_behind() {
    let vpl = vpl(Vec3::Z);
    let mut scene = Scene { materials: vec![Material::diffuse("m", Vec3::ONE)], ..Scene::default() };
    let corner = |x: f32, y: f32| vpl.position + Vec3::new(x, y, 1.0) * Vec3::new(9.0, 9.0, 1.0);
    scene.mesh.push_polygon(&[corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)], 0);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let atlas = cast(&accel, &[vpl], &Options::default());
    for i in 0..1000 {
        let angle = i as f32;
        let r = 1.5 * (i as f32 / 1000.0).sqrt();
        let across = Vec3::new(r * angle.cos(), r * angle.sin(), 0.0);
        for (height, lit) in [(0.5, true), (1.0, true), (1.6, false), (2.0, false)] {
            let receiver = vpl.position + across * height + Vec3::Z * height;
            assert_eq!(atlas.visible_surface(0, receiver, Vec3::NEG_Z), lit, "{height} {across}");
            // As a point it is told from its own surface only beyond the bias: 3.25 texels of a 16th.
            assert_eq!(atlas.visible(0, receiver), lit, "{height} {across}");
        }
        assert!(!atlas.visible_surface(0, vpl.position - Vec3::Z, Vec3::Z), "behind");
        assert!(!atlas.visible_surface(0, vpl.position + across + Vec3::Z * 0.5, Vec3::Z), "facing away");
        assert!(!atlas.visible(1, vpl.position + Vec3::Z), "no such VPL");
    }
}
