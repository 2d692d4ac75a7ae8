//! Whole images by ray casting, in parallel over rows.

use glam::Vec2;
use indirect_core::{GBuffer, View};
use rayon::prelude::*;

use crate::Accel;

/// What `view` sees through the centres of the texels of an image of `size`: the CPU twin of the raster pass.
///
/// The normal is the shading normal on the side that is seen, the depth the view depth. What a texel sees of the triangle
/// that its ray hits is evaluated by [`View::barycentrics`], as on the GPU.
#[must_use]
pub fn gbuffer(accel: &Accel<'_>, view: &View, size: [u32; 2]) -> GBuffer {
    let mut g = GBuffer::new(size);
    let width = size[0] as usize;
    if g.is_empty() {
        return g;
    }
    let rows = (
        g.triangle.par_chunks_mut(width),
        g.depth.par_chunks_mut(width),
        g.position.par_chunks_mut(width),
        g.normal.par_chunks_mut(width),
        g.albedo.par_chunks_mut(width),
    );
    rows.into_par_iter().enumerate().for_each(|(y, (triangle, depth, position, normal, albedo))| {
        for x in 0..width {
            let pixel = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
            let ray = view.ray(pixel, size);
            let Some(hit) = accel.closest_hit(&ray) else {
                continue;
            };
            let scene = accel.scene();
            let (uv, hit_depth) = view.barycentrics(pixel, size, scene.mesh.corners(hit.triangle));
            let surface = scene.surface(hit.triangle, uv.x, uv.y);
            triangle[x] = hit.triangle;
            depth[x] = hit_depth;
            position[x] = surface.position;
            normal[x] = surface.facing(-ray.direction).1;
            albedo[x] = surface.albedo;
        }
    });
    g
}
