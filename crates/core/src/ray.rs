use glam::Vec3;

/// A half line, or a segment, in world space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Start, metres.
    pub origin: Vec3,
    /// Direction. It does not need to be normalized: `t` is measured in its length.
    pub direction: Vec3,
    /// Only hits with `t < t_max` count; `f32::INFINITY` for a half line.
    pub t_max: f32,
}

impl Ray {
    /// A half line.
    #[must_use]
    pub const fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_max: f32::INFINITY }
    }

    /// The point at parameter `t`.
    #[must_use]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}

/// Where a [`Ray`] meets a triangle `(v0, v1, v2)`: the point is `(1−u−v)·v0 + u·v1 + v·v2`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance in units of the ray's direction.
    pub t: f32,
    /// Barycentric weight of the second vertex, `[0, 1]`.
    pub u: f32,
    /// Barycentric weight of the third vertex, `[0, 1]`.
    pub v: f32,
    /// Index into [`Mesh::triangles`](crate::Mesh::triangles).
    pub triangle: u32,
}
