//! The filters on the CPU: energy, histories, edges, degenerate input.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use core::f32::consts::{FRAC_1_PI, PI};

use common::{floor_and_wall, view};
use glam::{Vec2, Vec3};
use indirect_core::{GBuffer, Projection, View};
use indirect_filter::{
    History, Reduced,
    cpu::{bilateral, shade, shade_texels, smooth},
};

/// Irradiance π on white is radiance 1; pixels that are not lit or see nothing are black.
#[test]
fn a_white_pixel_reflects_all() {
    let mut surface = floor_and_wall(&view(), [24, 16]);
    surface.albedo.fill(Vec3::ONE);
    let e: Vec<Vec3> = (0..surface.len())
        .map(|i| if surface.is_surface(i) { Vec3::splat(PI) } else { Vec3::ZERO })
        .collect();
    let image = shade(&surface, &e);
    let white =
        (0..surface.len()).filter(|i| surface.is_surface(*i)).all(|i| (image.pixels[i].x - 1.0).abs() < 1e-6);
    assert!(white && image.pixels[0] == Vec3::ZERO);
    let seen: Vec<u32> = (0..surface.len() as u32).filter(|i| surface.is_surface(*i as usize)).collect();
    assert_eq!(shade_texels(&surface, &seen, &vec![Vec3::splat(PI); seen.len()]), image);
    let one = shade_texels(&surface, &[200], &[Vec3::X]);
    assert!(one.pixels[200] == Vec3::X * FRAC_1_PI && one.pixels[201] == Vec3::ZERO);
}

/// One pixel's history: a still frame stays, a step is followed by halves, what was hidden or is not finite has no past, a cut
/// to another camera forgets all.
#[test]
fn smoothing_follows_and_forgets() {
    let view = view();
    let camera = floor_and_wall(&view, [24, 16]);
    let constant = |v: f32| vec![Vec3::splat(v); camera.len()];
    let history = |view: &View, camera: &GBuffer, depth: f32, irradiance: &[Vec3]| {
        let pixels = irradiance.iter().zip(&camera.depth).map(|(e, d)| e.extend(d * depth)).collect();
        History { view: *view, size: camera.size, pixels }
    };
    let blend = |now: &[Vec3], past: &History| smooth(now, (&view, &camera), Some(past), 0.5).irradiance();
    let same = |past: &[Vec3]| history(&view, &camera, 1.0, past);
    let first = smooth(&constant(3.0), (&view, &camera), None, 0.5);
    assert!((0..camera.len()).all(|i| first.pixels[i].x == if camera.is_surface(i) { 3.0 } else { 0.0 }));
    let mut past = constant(1.0);
    for frame in 1..=6 {
        past = blend(&constant(3.0), &same(&past));
        for i in (0..camera.len()).filter(|i| camera.is_surface(*i)) {
            let exact = 3.0 - 2.0 * 0.5_f32.powi(frame);
            // A pixel of the border reads less than four neighbours, and of them only what it finds.
            assert!((past[i].x - exact).abs() < 1e-4, "{frame}: {} {exact}", past[i]);
        }
    }
    let mut poisoned = constant(1.0);
    poisoned[100] = Vec3::splat(f32::NAN);
    poisoned[101] = Vec3::splat(f32::INFINITY);
    let next = blend(&constant(3.0), &same(&poisoned));
    assert!(next.iter().all(|v| v.is_finite()));
    // Another depth was seen: hidden until now.
    let next = blend(&constant(3.0), &history(&view, &camera, 0.1, &constant(1.0)));
    assert!(
        (0..camera.len())
            .all(|i| next[i] == if camera.is_surface(i) { Vec3::splat(3.0) } else { Vec3::ZERO })
    );
    // Another size of the image: the surface is found where it was seen. A history that is not as long as it says is ignored.
    let large = floor_and_wall(&view, [48, 32]);
    let bright = vec![Vec3::ONE; large.len()];
    let resized = history(&view, &large, 1.0, &bright);
    let short = History { pixels: resized.pixels[1..].to_vec(), ..resized.clone() };
    let (next, none) = (blend(&constant(3.0), &resized), blend(&constant(3.0), &short));
    let seen: Vec<f32> = (0..camera.len()).filter(|i| camera.is_surface(*i)).map(|i| next[i].x).collect();
    // 2 where all four neighbours count, 3 where none does: on the floor a texel's depth is 2 % of the next one's.
    let followed = seen.iter().filter(|v| **v < 2.0 + 1e-4).count();
    assert!(seen.iter().all(|v| (1.999..3.001).contains(v)) && 4 * followed > seen.len(), "{followed}");
    assert!((0..camera.len()).all(|i| !camera.is_surface(i) || none[i] == Vec3::splat(3.0)));
    let elsewhere = View { origin: view.origin * 40.0, ..view };
    let next = blend(&constant(3.0), &history(&elsewhere, &camera, 1.0, &constant(1.0)));
    assert!(
        (0..camera.len())
            .all(|i| next[i] == if camera.is_surface(i) { Vec3::splat(3.0) } else { Vec3::ZERO })
    );
}

/// A field that is linear in a plane is interpolated exactly, with a weight of 1; each surface takes from its own texels alone;
/// the weight of a pixel whose surface no texel shows is 0.
#[test]
fn bilateral_interpolation_keeps_planes_and_edges() {
    for scale in [1.0, 1e-3, 1e3] {
        // Across the axis of a parallel view the floor's coordinates are linear in the pixel.
        let projection = Projection::Orthographic { half_size: Vec2::new(2.0, 1.5) * scale };
        let down = View::look_to(Vec3::Y * scale, Vec3::NEG_Y, Vec3::Z, projection, 0.0, 10.0 * scale);
        let size = [32, 24];
        let mut g = GBuffer::new(size);
        for i in 0..g.len() {
            let ray = down.ray(Vec2::new((i % 32) as f32 + 0.5, (i / 32) as f32 + 0.5), size);
            g.position[i] = ray.at(scale);
            (g.triangle[i], g.normal[i]) = (0, Vec3::Y);
        }
        let field = |p: Vec3| Vec3::new(2.0 + p.x / scale, 3.0 - p.z / scale, 1.0);
        for step in [1, 2, 4] {
            let reduced = Reduced::new(size, step);
            let texel = |i: u32| reduced.pixel_of([i % reduced.small[0], i / reduced.small[0]]) as usize;
            let low: Vec<Vec3> = (0..reduced.texels()).map(|i| field(g.position[texel(i)])).collect();
            // Within the outermost texels' places; beyond them the nearest continues.
            for i in
                (0..g.len() as u32).filter(|i| (4..28).contains(&(i % 32)) && (4..20).contains(&(i / 32)))
            {
                let (sum, weight) = bilateral(&g, &reduced, &low, i);
                let exact = field(g.position[i as usize]);
                assert!(
                    (weight - 1.0).abs() < 1e-5 && (sum - exact).abs().max_element() < 1e-5,
                    "{i} of {step}"
                );
            }
            // Half of the floor lies lower: it hides nothing of the other half.
            let mut stairs = g.clone();
            let low_half = |i: usize| i % 32 >= 15;
            (0..g.len()).filter(|i| low_half(*i)).for_each(|i| stairs.position[i].y -= 0.5 * scale);
            let low: Vec<Vec3> =
                (0..reduced.texels()).map(|i| if low_half(texel(i)) { Vec3::X } else { Vec3::Y }).collect();
            for i in 0..g.len() as u32 {
                let (sum, weight) = bilateral(&stairs, &reduced, &low, i);
                let other = if low_half(i as usize) { sum.y } else { sum.x };
                assert!(weight > 0.0 && other == 0.0, "{i} of {step}: {sum}");
            }
        }
        // A thin bar that no texel shows.
        let reduced = Reduced::new(size, 4);
        let mut bar = g.clone();
        (0..g.len()).filter(|i| i % 32 == 12).for_each(|i| bar.normal[i] = Vec3::X);
        let (_, weight) = bilateral(&bar, &reduced, &[Vec3::ONE; 48], 12 + 32 * 10);
        assert!(weight == 0.0, "{weight}");
    }
}

/// Neither power of two nor multiple: blocks that are cut at the border have a texel, whose pixel exists.
#[test]
fn reduced_images_cover_theirs() {
    for size in [[1, 1], [7, 5], [8, 8], [33, 2]] {
        for step in [0, 1, 2, 4] {
            let r = Reduced::new(size, step);
            assert!(r.small[0] * r.step >= size[0] && (r.small[0] - 1) * r.step < size[0]);
            assert!(r.pixel_of([r.small[0] - 1, r.small[1] - 1]) < size[0] * size[1]);
            assert_eq!(r.texels(), r.small[0] * r.small[1]);
        }
    }
}
