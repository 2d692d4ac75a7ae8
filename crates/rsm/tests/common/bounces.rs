//! Lists of virtual point lights of several bounces, and receivers: what the tree's example and its tests share.

use glam::{Mat3, Vec2, Vec3};
use indirect_accel::{Accel, cast};
use indirect_core::{Ray, View, math};
use indirect_sampling::{mapping, sobol};
use rsm::{Rsm, Selection, Vpl, cpu};

/// `count` lights: half of them drawn from the maps, a quarter each of the second and the third bounce, found by one
/// ray each.
pub(crate) fn vpls(accel: &Accel<'_>, maps: &Rsm, count: u32) -> Vec<Vpl> {
    let scene = accel.scene();
    let triangles = 0..scene.mesh.triangles.len() as u32;
    let surface_area: f32 = triangles.map(|t| scene.mesh.area(t)).sum();
    let selection = Selection::Importance { count: (count / 2).max(1) };
    let mut list = cpu::compact(&cpu::vpls(maps, selection, &selection.points(1)));
    let mut before = 0..list.len();
    for bounce in 2..4 {
        let paths = count / 4;
        for i in 0..paths {
            let from = list[before.start + i as usize * before.len() / (paths as usize).max(1)];
            let (x, y) = math::orthonormal_basis(from.normal);
            let towards = mapping::hemisphere_cosine(sobol::sample_2d(i, bounce));
            let direction = Mat3::from_cols(x, y, from.normal) * towards;
            let origin = math::offset_ray_origin_scaled(from.position, from.normal, accel.unit());
            let Some(hit) = accel.closest_hit(&Ray::new(origin, direction)) else { continue };
            let surface = scene.surface(hit.triangle, hit.u, hit.v);
            let flux = from.flux * surface.albedo * (before.len() as f32 / paths as f32);
            let area = surface_area / paths as f32;
            list.push(Vpl::new(surface.position, surface.facing(-direction).1, flux, area));
        }
        before = before.end..list.len();
    }
    list
}

/// Positions and normals that a camera sees, neighbours near each other (Z order).
pub(crate) fn receivers(accel: &Accel<'_>, view: &View, size: [u32; 2]) -> (Vec<Vec3>, Vec<Vec3>) {
    let seen = cast::gbuffer(accel, view, size);
    let spread = |v: u32| (0..16).fold(0, |s, bit| s | (((v >> bit) & 1) << (2 * bit)));
    let mut pixels: Vec<u32> = (0..seen.len() as u32).filter(|i| seen.is_surface(*i as usize)).collect();
    pixels.sort_unstable_by_key(|i| spread(i % size[0]) | (spread(i / size[0]) << 1));
    pixels.iter().map(|i| (seen.position[*i as usize], seen.normal[*i as usize])).unzip()
}

#[allow(dead_code, reason = "not every user compares")]
/// `√mean((x − ref)²)/mean(ref)`, all channels together.
pub(crate) fn rel_rmse(found: &[Vec3], expected: &[Vec3]) -> f64 {
    let (mut square, mut sum) = (0.0, 0.0);
    for (x, r) in found.iter().zip(expected) {
        let (x, r) = (x.as_dvec3(), r.as_dvec3());
        square += (x - r).length_squared() / 3.0;
        sum += r.element_sum() / 3.0;
    }
    let n = found.len() as f64;
    (square / n).sqrt() / (sum / n)
}

/// Points of a plane, for lists that need no scene.
#[allow(dead_code, reason = "the example has a scene")]
pub(crate) fn plane(side: u32, scale: f32) -> (Vec<Vec3>, Vec<Vec3>) {
    let at = |i: u32| Vec2::new((i % side) as f32 + 0.5, (i / side) as f32 + 0.5) / side as f32;
    (0..side * side).map(|i| (Vec3::new(at(i).x, 0.0, at(i).y) * scale, Vec3::Y)).unzip()
}
