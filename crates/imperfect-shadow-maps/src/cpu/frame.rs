use glam::{Vec2, Vec3};
use indirect_core::math::orthonormal_basis;
use rsm::Vpl;

/// A VPL's view of its hemisphere, made once per VPL: `z` along its normal.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Frame {
    /// World position, metres.
    pub position: Vec3,
    /// Unit vector along the rows of the map.
    pub tangent: Vec3,
    /// Unit vector along its columns.
    pub bitangent: Vec3,
    /// Unit normal.
    pub normal: Vec3,
}

impl Frame {
    /// The frame of a VPL.
    #[must_use]
    pub fn new(vpl: &Vpl) -> Self {
        let (tangent, bitangent) = orthonormal_basis(vpl.normal);
        Self { position: vpl.position, tangent, bitangent, normal: vpl.normal }
    }

    /// A vector of the world along the axes of the frame.
    #[must_use]
    #[inline]
    pub fn local(&self, v: Vec3) -> Vec3 {
        Vec3::new(self.tangent.dot(v), self.bitangent.dot(v), self.normal.dot(v))
    }

    /// A vector along the axes of the frame, in the world.
    #[must_use]
    #[inline]
    pub fn world(&self, v: Vec3) -> Vec3 {
        self.tangent * v.x + self.bitangent * v.y + self.normal * v.z
    }
}

/// Unit direction, along the axes of the frame, of the place `q` of a paraboloid map: `|q| = 0` along the normal, 1 at the
/// horizon. Places beyond the horizon are moved onto it.
#[must_use]
#[inline]
pub(super) fn direction(q: Vec2) -> Vec3 {
    let r2 = q.length_squared();
    let q = if r2 > 1.0 { q / r2.sqrt() } else { q };
    let r2 = r2.min(1.0);
    (Vec3::new(2.0 * q.x, 2.0 * q.y, 1.0 - r2)) / (1.0 + r2)
}
