//! What a camera sees of a small scene, without rays.
#![allow(dead_code, reason = "each test binary uses its own part")]

use glam::{Vec2, Vec3};
use indirect_core::{GBuffer, Projection, View};

pub(crate) fn view() -> View {
    let projection = Projection::Perspective { tan_half: Vec2::new(0.9, 0.55) };
    let (eye, forward) = (Vec3::new(0.5, 1.8, 3.5), Vec3::new(-0.1, -0.3, -1.0));
    View::look_to(eye, forward, Vec3::Y, projection, 0.01, 100.0)
}

/// What the view sees of a floor, `y = 0`, and of a wall that faces it, `z = −2`; nothing beyond `|x| = 2` and above 2.5.
pub(crate) fn floor_and_wall(view: &View, size: [u32; 2]) -> GBuffer {
    let mut g = GBuffer::new(size);
    for i in 0..g.len() {
        let pixel = Vec2::new((i as u32 % size[0]) as f32 + 0.5, (i as u32 / size[0]) as f32 + 0.5);
        let ray = view.ray(pixel, size);
        let floor = -ray.origin.y / ray.direction.y;
        let wall = (-2.0 - ray.origin.z) / ray.direction.z;
        let on_floor = floor > 0.0 && floor < wall;
        let p = ray.at(if on_floor { floor } else { wall });
        if p.y > 2.5 || p.x.abs() > 2.0 {
            continue;
        }
        g.triangle[i] = u32::from(!on_floor);
        g.position[i] = p;
        g.normal[i] = if on_floor { Vec3::Y } else { Vec3::Z };
        g.depth[i] = view.depth(p);
        g.albedo[i] = Vec3::new(0.8, 0.5, 0.2);
    }
    g
}
