use glam::{Vec3, Vec4};
use indirect_core::View;

/// A frame's smoothed irradiance and the view and depth that reproject it into the next frame.
#[derive(Debug, Clone, PartialEq)]
pub struct History {
    /// The frame's camera.
    pub view: View,
    /// Width and height, pixels; need not be those of the next frame.
    pub size: [u32; 2],
    /// Per pixel, smoothed irradiance, W/m², and view depth, metres; 0 where the camera saw nothing.
    pub pixels: Vec<Vec4>,
}

impl History {
    /// The smoothed irradiance per pixel, W/m².
    #[must_use]
    pub fn irradiance(&self) -> Vec<Vec3> {
        self.pixels.iter().map(|p| p.truncate()).collect()
    }
}
