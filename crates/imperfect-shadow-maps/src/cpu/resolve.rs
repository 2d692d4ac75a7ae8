//! `resolve`: the scene's points where its triangles now are.

use indirect_core::Scene;
use rayon::prelude::*;

use crate::layout::{Point, ScenePoint};

/// Points of the scene in the world, in order. A point on a triangle that the scene does not have, in a hole of an alpha mask or
/// on a triangle without area gets the area 0, which draws nothing.
#[must_use]
pub fn resolve(scene: &Scene, points: &[ScenePoint]) -> Vec<Point> {
    points.par_iter().map(|p| resolve_point(scene, p)).collect()
}

fn resolve_point(scene: &Scene, p: &ScenePoint) -> Point {
    if p.triangle as usize >= scene.mesh.triangles.len() {
        return Point::default();
    }
    let surface = scene.surface(p.triangle, p.u, p.v);
    let normal = surface.geometric_normal;
    let solid = normal.length_squared() > 0.0 && scene.is_solid(p.triangle, p.u, p.v);
    Point {
        position: surface.position,
        area: if solid { p.area } else { 0.0 },
        normal,
        albedo: surface.albedo,
        ..Point::default()
    }
}
