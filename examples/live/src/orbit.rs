//! A camera that looks at a point from around it.

use glam::Vec3;
use indirect_core::{Camera, Scene, View};

/// A camera around a point.
#[derive(Debug, Clone)]
pub struct Orbit {
    camera: Camera,
    target: Vec3,
    /// Turned to the right, radians.
    pub yaw: f32,
    /// Turned upwards, radians.
    pub pitch: f32,
    /// Distance over that of the scene's camera.
    pub zoom: f32,
}

impl Orbit {
    /// Around the middle of the scene, at first where `camera` is.
    #[must_use]
    pub fn of(camera: &Camera, scene: &Scene) -> Self {
        let centre = scene.bounds().map_or(camera.position + camera.forward, |b| b.centre());
        let along = (centre - camera.position).dot(camera.forward);
        let target = camera.position + camera.forward * along;
        Self { camera: camera.clone(), target, yaw: 0.0, pitch: 0.0, zoom: 1.0 }
    }

    /// Turns it, radians, and moves it, as a factor of its distance; the room's open side stays in view.
    pub fn turn(&mut self, yaw: f32, pitch: f32, zoom: f32) {
        self.yaw = (self.yaw + yaw).clamp(-1.2, 1.2);
        self.pitch = (self.pitch + pitch).clamp(-0.6, 0.6);
        self.zoom = (self.zoom * zoom).clamp(0.4, 1.5);
    }

    /// What it sees of an image of `size` pixels.
    #[must_use]
    pub fn view(&self, size: [u32; 2]) -> View {
        let mut camera = self.camera.clone();
        if (self.yaw, self.pitch, self.zoom) != (0.0, 0.0, 1.0) {
            let right = camera.forward.cross(camera.up).normalize();
            let turn =
                glam::Quat::from_rotation_y(-self.yaw) * glam::Quat::from_axis_angle(right, -self.pitch);
            let away = turn * (camera.position - self.target) * self.zoom;
            camera.forward = -away.normalize();
            camera.up = turn * camera.up;
            camera.position = self.target + away;
        }
        camera.view(size)
    }
}
