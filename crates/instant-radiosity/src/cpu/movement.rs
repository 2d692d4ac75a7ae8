//! `movement`: where the surface of each pixel was in the frame before (thesis §3.5.1; the place itself is kept instead of its way on the
//! image, which follows from it and the camera of that frame).

use glam::Vec3;
use indirect_core::GBuffer;
use rayon::prelude::*;

use crate::setup::Fitted;

/// World position per pixel, metres; empty where no vertex moved.
///
/// The weights of the triangle's corners at the pixel's position, taken from its areas, give the same point of the triangle as it was: rigid,
/// skinned and deformed meshes alike.
#[must_use]
pub fn movement(fitted: &Fitted, camera: &GBuffer) -> Vec<Vec3> {
    if !fitted.moved() {
        return Vec::new();
    }
    (0..camera.len())
        .into_par_iter()
        .with_min_len(256)
        .map(|i| {
            if !camera.is_surface(i) {
                return Vec3::ZERO;
            }
            let corners = fitted.triangles[camera.triangle[i] as usize];
            before(
                camera.position[i],
                corners.map(|v| fitted.now[v as usize]),
                corners.map(|v| fitted.before[v as usize]),
            )
        })
        .collect()
}

/// Where the point `p` of the triangle `now` was when its corners were at `before`.
fn before(p: Vec3, now: [Vec3; 3], before: [Vec3; 3]) -> Vec3 {
    let (u, v, w) = (now[1] - now[0], now[2] - now[0], p - now[0]);
    let n = u.cross(v);
    let area = n.dot(n);
    if area <= 0.0 {
        return p;
    }
    let b = w.cross(v).dot(n) / area;
    let c = u.cross(w).dot(n) / area;
    // What moved, added to the point: nothing is lost where nothing moved.
    p + ((before[0] - now[0]) * (1.0 - b - c) + (before[1] - now[1]) * b + (before[2] - now[2]) * c)
}
