use glam::{DVec2, DVec3, DVec4, Mat4, Vec2, Vec3, Vec4};

use crate::{Ray, solid_angle};

/// How a [`View`] maps its image plane to rays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// All rays start at the view's origin.
    Perspective {
        /// Tangent of half the horizontal and half the vertical opening angle.
        tan_half: Vec2,
    },
    /// All rays are parallel to the view's forward axis.
    Orthographic {
        /// Half the width and half the height, metres.
        half_size: Vec2,
    },
}

/// A rectangular window into the scene: a camera, a spot light's map, one face of a point light's cube, or a directional
/// light's map. Everything that turns pixels into rays, and vertices into clip space, for CPU and GPU alike.
///
/// `right`, `up` and `forward` are orthonormal and right-handed with `right × up = −forward`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Eye of a perspective view, or the centre of an orthographic view's start plane, metres.
    pub origin: Vec3,
    /// Unit vector to the right of the image.
    pub right: Vec3,
    /// Unit vector to the top of the image.
    pub up: Vec3,
    /// Unit view direction.
    pub forward: Vec3,
    /// Perspective or orthographic.
    pub projection: Projection,
    /// Nearest visible view depth, metres, `> 0` for a perspective view.
    pub near: f32,
    /// Farthest visible view depth, metres; may be infinite for a perspective view.
    pub far: f32,
}

/// A window through which a light sees the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapView {
    /// Index into [`Scene::lights`](crate::Scene::lights).
    pub light: usize,
    /// The window, square in texels.
    pub view: View,
}

impl View {
    /// A view from `origin` along `forward`; `up` only needs to differ from `forward`, where it does not any
    /// perpendicular serves.
    #[must_use]
    pub fn look_to(
        origin: Vec3,
        forward: Vec3,
        up: Vec3,
        projection: Projection,
        near: f32,
        far: f32,
    ) -> Self {
        let forward = crate::math::normalize_or(forward, Vec3::NEG_Z);
        let right = forward.cross(up);
        let right = if right.length_squared() > 1e-12 * up.length_squared() {
            right.normalize()
        } else {
            crate::math::orthonormal_basis(forward).0
        };
        Self { origin, right, up: right.cross(forward), forward, projection, near, far }
    }

    /// The point of the image plane at view depth 1 (perspective) or in metres (orthographic) for the continuous pixel
    /// coordinate `pixel` (`(0, 0)` is the top left corner of the image) of an image of `size` pixels.
    #[must_use]
    #[inline]
    pub fn plane_point(&self, pixel: Vec2, size: [u32; 2]) -> Vec2 {
        let ndc = Vec2::new(2.0 * pixel.x / size[0] as f32 - 1.0, 1.0 - 2.0 * pixel.y / size[1] as f32);
        match self.projection {
            Projection::Perspective { tan_half } => ndc * tan_half,
            Projection::Orthographic { half_size } => ndc * half_size,
        }
    }

    /// The ray through the continuous pixel coordinate `pixel`, from the near to the far plane. Its direction is not
    /// normalized but has view depth 1 per unit of `t`: a hit at `t` has the view depth `near + t`.
    #[must_use]
    #[inline]
    pub fn ray(&self, pixel: Vec2, size: [u32; 2]) -> Ray {
        let p = self.plane_point(pixel, size);
        let lateral = self.right * p.x + self.up * p.y;
        let (origin, direction) = match self.projection {
            Projection::Perspective { .. } => (self.origin, self.forward + lateral),
            Projection::Orthographic { .. } => (self.origin + lateral, self.forward),
        };
        Ray { origin: origin + direction * self.near, direction, t_max: self.far - self.near }
    }

    /// Where the ray through the continuous pixel coordinate `pixel` meets the plane of a triangle `[v0, v1, v2]`: the
    /// barycentric weights of `v1` and `v2`, clamped to the triangle, and the view depth, metres.
    ///
    /// For whoever knows by other means that the texel sees the triangle, such as a rasteriser, which snaps corners to a
    /// fraction of a texel: clamping keeps the result finite and on the surface, even edge-on. CPU and GPU evaluate
    /// G-buffers by this function, step by step alike, so that what they see of a triangle agrees to rounding however
    /// small or slanted it is. The corners are sheared into a frame in which the ray is the z axis (Woop, Benthin & Wald
    /// 2013, "Watertight Ray/Triangle Intersection", JCGT 2(1)).
    #[must_use]
    #[inline]
    pub fn barycentrics(&self, pixel: Vec2, size: [u32; 2], corners: [Vec3; 3]) -> (Vec2, f32) {
        let plane = self.plane_point(pixel, size);
        let parallel = matches!(self.projection, Projection::Orthographic { .. });
        // The origin is subtracted first: digits survive far from 0.
        let local = corners.map(|p| {
            let d = p - self.origin;
            Vec3::new(self.right.dot(d), self.up.dot(d), self.forward.dot(d))
        });
        let [a, b, c] = local.map(|l| l.truncate() - plane * if parallel { 1.0 } else { l.z });
        let w = Vec3::new(c.x * b.y - c.y * b.x, a.x * c.y - a.y * c.x, b.x * a.y - b.y * a.x);
        // Both faces are seen: the three weights share the sign of their sum.
        let w = (if w.x + w.y + w.z < 0.0 { -w } else { w }).max(Vec3::ZERO);
        let sum = w.x + w.y + w.z;
        let (u, v) = if sum > 0.0 { (w.y / sum, w.z / sum) } else { (0.0, 0.0) };
        let depth = local[0].z * (1.0 - u - v) + local[1].z * u + local[2].z * v;
        (Vec2::new(u, v), depth)
    }

    /// Exact solid angle of pixel `(x, y)` of a perspective view, sr; `None` for an orthographic view.
    #[must_use]
    pub fn texel_solid_angle(&self, x: u32, y: u32, size: [u32; 2]) -> Option<f32> {
        let (x, y) = (x as f32, y as f32);
        let lo = self.plane_point(Vec2::new(x, y + 1.0), size);
        let hi = self.plane_point(Vec2::new(x + 1.0, y), size);
        matches!(self.projection, Projection::Perspective { .. }).then(|| solid_angle::rectangle(lo, hi))
    }

    /// Area of one texel of an orthographic view across its axis, m²; `None` for a perspective view.
    #[must_use]
    pub fn texel_area(&self, size: [u32; 2]) -> Option<f32> {
        match self.projection {
            Projection::Perspective { .. } => None,
            Projection::Orthographic { half_size } => {
                Some(4.0 * half_size.x * half_size.y / (size[0] as f32 * size[1] as f32))
            }
        }
    }

    /// View depth of `p`, metres.
    #[must_use]
    #[inline]
    pub fn depth(&self, p: Vec3) -> f32 {
        (p - self.origin).dot(self.forward)
    }

    /// The continuous pixel coordinate and view depth of a world point; `None` at or behind the eye of a perspective
    /// view.
    #[must_use]
    pub fn project(&self, p: Vec3, size: [u32; 2]) -> Option<(Vec2, f32)> {
        let c = self.clip_from_world() * p.extend(1.0);
        if c.w <= 0.0 {
            return None;
        }
        let ndc = Vec2::new(c.x, c.y) / c.w;
        let pixel = Vec2::new((ndc.x + 1.0) * 0.5 * size[0] as f32, (1.0 - ndc.y) * 0.5 * size[1] as f32);
        Some((pixel, self.depth(p)))
    }

    /// Where a world point falls on the image: the unit square is the image, `(0, 0)` its top left corner. `None` at or behind
    /// the eye of a perspective view; neither `near` nor `far` count. Step by step what WGSL's `view_image_point` does, so
    /// that both backends agree to rounding also for views far from the world's origin, where [`View::project`] loses digits.
    #[must_use]
    #[inline]
    pub fn image_point(&self, p: Vec3) -> Option<Vec2> {
        let d = p - self.origin;
        let (local, z) = (Vec2::new(self.right.dot(d), self.up.dot(d)), self.forward.dot(d));
        let plane = match self.projection {
            Projection::Perspective { tan_half } => {
                if z <= 0.0 {
                    return None;
                }
                local / z / tan_half
            }
            Projection::Orthographic { half_size } => local / half_size,
        };
        Some(Vec2::new(0.5 + 0.5 * plane.x, 0.5 - 0.5 * plane.y))
    }

    /// World to clip space with reversed depth: NDC z is 1 at `near` and 0 at `far`, which keeps f32 depth even.
    #[must_use]
    pub fn clip_from_world(&self) -> Mat4 {
        let row = |axis: Vec3| axis.extend(-axis.dot(self.origin));
        let (right, up, depth) = (row(self.right), row(self.up), row(self.forward));
        let (near, far) = (self.near, self.far);
        let unit_w = Vec4::W;
        let (x, y, z, w) = match self.projection {
            Projection::Perspective { tan_half } => {
                // z = near·(far − d)/(far − near), w = d; the limit for an infinite far plane is near.
                let (a, b) = if far.is_finite() {
                    (-near / (far - near), near * far / (far - near))
                } else {
                    (0.0, near)
                };
                (right / tan_half.x, up / tan_half.y, depth * a + unit_w * b, depth)
            }
            Projection::Orthographic { half_size } => {
                let scale = 1.0 / (far - near);
                (right / half_size.x, up / half_size.y, unit_w * (far * scale) - depth * scale, unit_w)
            }
        };
        Mat4::from_cols(x, y, z, w).transpose()
    }
}

/// A renderer's matrix from world to clip space, taken apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClipView {
    /// The view whose image the matrix makes; its `near` and `far` are the view depths of the NDC depths 1 and 0, or 0 and 1.
    pub view: View,
    /// How far the image is shifted off the view's axis, in NDC: the jitter of temporal anti-aliasing. A point that `view` sees at
    /// `p` is at `p + offset`.
    pub offset: Vec2,
    /// View depth, metres, is `scale / (z − shift)` (perspective) or `(z − shift) / scale` (orthographic) for an NDC depth `z`.
    pub scale: f32,
    /// See `scale`.
    pub shift: f32,
    /// Whether NDC depth is 1 at the near plane and falls with distance.
    pub reversed: bool,
}

/// Why a matrix is not that of a [`View`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BadClipMatrix {
    /// Not invertible, or not finite.
    #[error("clip_from_world is singular or not finite")]
    Singular,
    /// Shears, or scales the axes differently.
    #[error(
        "clip_from_world shears the world: it must be a rigid view and a perspective or orthographic projection"
    )]
    Sheared,
    /// Turns right-handed axes into left-handed ones.
    #[error("clip_from_world mirrors the image: NDC y must point up, as WebGPU has it")]
    Mirrored,
}

/// Largest cosine between two axes of a view that rounding of an f32 matrix explains: entries are rounded to 2⁻²⁴ of themselves, and
/// renderers make them by a few multiplications.
const SQUARE: f64 = 1e-4;

impl View {
    /// The view of a renderer that has one matrix from a right-handed world to clip space, with NDC as WebGPU has it (y up, z in
    /// `[0, 1]`), depth reversed or not, the far plane finite or not.
    ///
    /// In double precision, so that nothing is lost beside what the matrix' own rounding cost.
    ///
    /// # Errors
    /// [`BadClipMatrix`] where no view makes that image.
    pub fn from_clip(clip_from_world: &Mat4) -> Result<ClipView, BadClipMatrix> {
        let m = clip_from_world.transpose();
        let row = |v: Vec4| -> DVec4 { v.as_dvec4() };
        let (x, y, z, w) = (row(m.x_axis), row(m.y_axis), row(m.z_axis), row(m.w_axis));
        let determinant = f64::from(clip_from_world.determinant());
        if !(clip_from_world.is_finite() && determinant.is_finite() && determinant != 0.0) {
            return Err(BadClipMatrix::Singular);
        }
        let across = x.truncate().length() + y.truncate().length();
        let perspective = w.truncate().length() > 1e-7 * across;
        // Homogeneous coordinates have no scale of their own: w is made view depth, or 1.
        let unit = if perspective { w.truncate().length() } else { w.w };
        let (x, y, z, w) = (x / unit, y / unit, z / unit, w / unit);
        let offset = if perspective {
            DVec2::new(x.truncate().dot(w.truncate()), y.truncate().dot(w.truncate()))
        } else {
            DVec2::ZERO
        };
        let (x, y) = (x - w * offset.x, y - w * offset.y);
        let half = DVec2::new(1.0 / x.truncate().length(), 1.0 / y.truncate().length());
        let (right, up) = (x.truncate() * half.x, y.truncate() * half.y);
        let forward = up.cross(right);
        if !(half.is_finite() && right.dot(up).abs() < SQUARE) {
            return Err(BadClipMatrix::Sheared);
        }
        // Depth along `forward` of what the third row measures.
        let axis = if perspective { w.truncate() } else { z.truncate().normalize_or_zero() };
        let along = forward.dot(axis);
        if perspective && along < 0.0 {
            return Err(BadClipMatrix::Mirrored);
        }
        if (1.0 - along.abs()) > SQUARE
            || z.truncate().cross(forward).length() > SQUARE * z.truncate().length()
        {
            return Err(BadClipMatrix::Sheared);
        }
        let slope = z.truncate().dot(forward);
        let plane = |row: DVec4, scale: f64| -row.w * scale;
        let (view, scale, shift, reversed, offset) = if perspective {
            let origin = right * plane(x, half.x) + up * plane(y, half.y) + forward * plane(w, 1.0);
            // NDC z = slope + b / depth.
            let b = z.w - slope * w.w;
            let reversed = b > 0.0;
            let [near, far] = if reversed { [1.0, 0.0] } else { [0.0, 1.0] }.map(|ndc: f64| {
                // A matrix made in f32 leaves a little of what should be 0 for an infinite far plane.
                let rest = ndc - slope;
                if rest.abs() < 1e-7 { f64::INFINITY } else { b / rest }
            });
            let tan_half = half.as_vec2();
            let projection = Projection::Perspective { tan_half };
            // Beyond the far plane of a matrix whose far plane rounds to infinity or past it lies nothing.
            let far = if far > near { far } else { f64::INFINITY };
            (of(origin, right, up, forward, projection, [near, far]), b, slope, reversed, offset)
        } else {
            // NDC z = shift + depth · slope from the plane through the world's origin; the view starts at its near plane.
            let reversed = slope < 0.0;
            let [near, far] =
                if reversed { [1.0, 0.0] } else { [0.0, 1.0] }.map(|ndc: f64| (ndc - z.w) / slope);
            let origin = right * plane(x, half.x) + up * plane(y, half.y) + forward * near;
            let projection = Projection::Orthographic { half_size: half.as_vec2() };
            let view = of(origin, right, up, forward, projection, [0.0, far - near]);
            (view, slope, if reversed { 1.0 } else { 0.0 }, reversed, offset)
        };
        Ok(ClipView { view, offset: offset.as_vec2(), scale: scale as f32, shift: shift as f32, reversed })
    }
}

/// A view from double precision.
fn of(
    origin: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    projection: Projection,
    [near, far]: [f64; 2],
) -> View {
    View {
        origin: origin.as_vec3(),
        right: right.as_vec3(),
        up: up.as_vec3(),
        forward: forward.as_vec3(),
        projection,
        near: near as f32,
        far: far as f32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use glam::camera::{lh, rh, rh::proj::directx};

    fn views() -> [View; 2] {
        let look = |p, far| {
            View::look_to(Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, -0.5, -2.0), Vec3::Y, p, 0.1, far)
        };
        [
            look(Projection::Perspective { tan_half: Vec2::new(0.8, 0.5) }, f32::INFINITY),
            look(Projection::Orthographic { half_size: Vec2::new(8.0, 5.0) }, 50.0),
        ]
    }

    #[test]
    fn rays_project_back_to_their_pixel() {
        let size = [64, 40];
        for view in views() {
            for pixel in [Vec2::new(0.5, 0.5), Vec2::new(32.0, 20.0), Vec2::new(63.5, 3.25)] {
                let p = view.ray(pixel, size).at(7.0 - view.near);
                let (back, depth) = view.project(p, size).unwrap();
                assert_relative_eq!(depth, 7.0, max_relative = 1e-5);
                assert!((back - pixel).length() < 1e-3, "{pixel} {back}");
                let at = view.image_point(p).unwrap() * Vec2::new(64.0, 40.0);
                assert!((at - pixel).length() < 1e-3, "{pixel} {at}");
            }
        }
    }

    #[test]
    fn a_point_behind_a_perspective_eye_is_nowhere_on_the_image() {
        let [perspective, orthographic] = views();
        for depth in [0.0, -1.0] {
            let p = perspective.origin + perspective.forward * depth;
            assert_eq!(perspective.image_point(p), None);
            let centre = orthographic.image_point(p).unwrap();
            assert!((centre - 0.5).length() < 1e-6, "{centre}");
        }
    }

    #[test]
    fn barycentrics_are_those_of_the_point_and_stay_in_the_triangle() {
        let size = [64, 40];
        for view in views() {
            // A triangle that is seen, from either side; its corners are anywhere in front of the view.
            let at = |x, y, depth: f32| view.ray(Vec2::new(x, y), size).at(depth - view.near);
            let corners = [at(5.0, 6.0, 3.0), at(60.0, 9.0, 9.0), at(20.0, 38.0, 5.0)];
            for (u, v) in [(0.2, 0.3), (0.0, 0.0), (0.1, 0.9), (0.5, 0.5)] {
                let p = corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v;
                let (pixel, depth) = view.project(p, size).unwrap();
                let (found, found_depth) = view.barycentrics(pixel, size, corners);
                assert!((found - Vec2::new(u, v)).length() < 1e-5, "{found} for {u} {v}");
                assert_relative_eq!(found_depth, depth, max_relative = 1e-5);
                let flipped = [corners[0], corners[2], corners[1]];
                let (found, _) = view.barycentrics(pixel, size, flipped);
                assert!((found - Vec2::new(v, u)).length() < 1e-5, "{found} for {v} {u}");
            }
            for pixel in [Vec2::ZERO, Vec2::new(64.0, 0.0), Vec2::new(30.0, 40.0)] {
                for corners in [corners, [corners[0]; 3], [corners[0], corners[1], corners[0]]] {
                    let (w, depth) = view.barycentrics(pixel, size, corners);
                    assert!(w.min_element() >= 0.0 && w.element_sum() <= 1.0 + 1e-6, "{w}");
                    assert!((3.0 - 1e-4..=9.0 + 1e-4).contains(&depth), "{depth}");
                }
            }
        }
    }

    #[test]
    fn depth_is_reversed() {
        for view in views() {
            let ndc = |depth: f32| {
                let c = view.clip_from_world() * (view.origin + view.forward * depth).extend(1.0);
                c.z / c.w
            };
            assert_relative_eq!(ndc(view.near), 1.0, epsilon = 1e-5);
            assert!(ndc(1.0) > ndc(2.0) && ndc(2.0) > ndc(49.0) && ndc(49.0) > 0.0);
        }
    }

    #[test]
    fn axes_are_right_handed_even_when_up_is_the_direction() {
        for forward in [Vec3::Y, Vec3::NEG_Y, Vec3::X, Vec3::new(1.0, 1e-9, 0.0)] {
            let v = View::look_to(Vec3::ZERO, forward, Vec3::Y, views()[0].projection, 0.1, 1.0);
            assert!((v.right.cross(v.up) + v.forward).length() < 1e-6, "{v:?}");
        }
    }

    #[test]
    fn texels_cover_the_frustum() {
        let [perspective, orthographic] = views();
        let size = [32, 16];
        let sum: f32 =
            (0..32 * 16).map(|i| perspective.texel_solid_angle(i % 32, i / 32, size).unwrap()).sum();
        let whole = solid_angle::rectangle(Vec2::new(-0.8, -0.5), Vec2::new(0.8, 0.5));
        assert_relative_eq!(sum, whole, max_relative = 1e-5);
        assert_relative_eq!(orthographic.texel_area(size).unwrap() * 512.0, 160.0, max_relative = 1e-6);
        assert!(
            orthographic.texel_solid_angle(0, 0, size).is_none() && perspective.texel_area(size).is_none()
        );
    }

    fn assert_same(found: &View, view: &View) {
        for (f, v) in [(found.right, view.right), (found.up, view.up), (found.forward, view.forward)] {
            assert!((f - v).length() < 1e-5, "{found:?}");
        }
        assert!((found.origin - view.origin).length() < 1e-4, "{found:?}");
        let half = |v: &View| match v.projection {
            Projection::Perspective { tan_half } => tan_half,
            Projection::Orthographic { half_size } => half_size,
        };
        assert!((half(found) / half(view) - 1.0).abs().max_element() < 1e-5);
        assert_eq!(core::mem::discriminant(&found.projection), core::mem::discriminant(&view.projection));
    }

    #[test]
    fn views_come_back_from_their_matrix() {
        let [perspective, mut orthographic] = views();
        orthographic.near = 0.0;
        let finite = View { far: 80.0, ..perspective };
        for view in [perspective, finite, orthographic] {
            let c = View::from_clip(&view.clip_from_world()).unwrap();
            assert_same(&c.view, &view);
            assert!(c.reversed && c.offset.length() < 1e-6, "{c:?}");
            assert!((c.view.near - view.near).abs() < 1e-4 * view.near.max(1.0), "{c:?}");
            // An f32 matrix holds 1 / far beside 1 / near: what is left of a far plane 800 times as far has 2⁻²⁴ · 800 of error.
            let far = (c.view.far - view.far).abs() / view.far;
            assert!(c.view.far == view.far || far < 1e-3, "{c:?}");
            for depth in [0.5, 3.0, 40.0] {
                let clip = view.clip_from_world() * (view.origin + view.forward * depth).extend(1.0);
                let z = clip.z / clip.w;
                let found = match view.projection {
                    Projection::Perspective { .. } => c.scale / (z - c.shift),
                    Projection::Orthographic { .. } => (z - c.shift) / c.scale,
                };
                // z has 2⁻²⁴ of 1, and depth / near · depth as much.
                assert!((found - depth).abs() < 1e-6 * depth * depth / 0.1 + 1e-4, "{found} {depth}");
            }
        }
    }

    #[test]
    fn matrices_of_other_renderers_are_understood() {
        let eye = Vec3::new(3.0, 1.0, -2.0);
        let world = rh::view::look_to_mat4(eye, Vec3::new(0.3, -0.2, 1.0).normalize(), Vec3::Y);
        let tan = 0.4_f32;
        let (fov, aspect) = (2.0 * tan.atan(), 1.6);
        let cases = [
            (directx::perspective(fov, aspect, 0.1, 100.0), false, 100.0),
            (directx::perspective_infinite_reverse(fov, aspect, 0.1), true, f32::INFINITY),
            (directx::perspective_infinite(fov, aspect, 0.1), false, f32::INFINITY),
        ];
        for (projection, reversed, far) in cases {
            let c = View::from_clip(&(projection * world)).unwrap();
            assert_eq!(c.reversed, reversed);
            assert!((c.view.origin - eye).length() < 1e-4, "{c:?}");
            assert!((c.view.near - 0.1).abs() < 1e-4, "{c:?}");
            assert!(c.view.far == far || (c.view.far / far - 1.0).abs() < 2e-3, "{c:?}");
            let expected = Projection::Perspective { tan_half: Vec2::new(tan * aspect, tan) };
            assert_same(&c.view, &View { projection: expected, ..c.view });
            // The jitter of temporal anti-aliasing.
            let jitter = Mat4::from_translation(Vec3::new(0.003, -0.001, 0.0));
            let j = View::from_clip(&(jitter * projection * world)).unwrap();
            assert!((j.offset - Vec2::new(0.003, -0.001)).length() < 1e-6, "{j:?}");
            assert_same(&j.view, &c.view);
        }
        // A left-handed world, and clip space that points down.
        let left = lh::proj::directx::perspective(fov, aspect, 0.1, 50.0)
            * lh::view::look_to_mat4(eye, Vec3::new(0.3, -0.2, 1.0).normalize(), Vec3::Y);
        assert_eq!(View::from_clip(&left), Err(BadClipMatrix::Mirrored));
        let down = rh::proj::vulkan::perspective(fov, aspect, 0.1, 50.0) * world;
        assert_eq!(View::from_clip(&down), Err(BadClipMatrix::Mirrored));
        let ortho = directx::orthographic(-2.0, 2.0, -1.0, 1.0, 0.5, 9.0) * world;
        let c = View::from_clip(&ortho).unwrap();
        assert!(!c.reversed && (c.view.far - 8.5).abs() < 1e-3, "{c:?}");
    }

    #[test]
    fn matrices_of_no_view_are_refused() {
        let good = views()[0].clip_from_world();
        let flipped = Mat4::from_scale(Vec3::new(1.0, -1.0, 1.0)) * good;
        assert_eq!(View::from_clip(&flipped), Err(BadClipMatrix::Mirrored));
        let mut shear = Mat4::IDENTITY;
        shear.y_axis.x = 0.5;
        assert_eq!(View::from_clip(&(shear * good)), Err(BadClipMatrix::Sheared));
        assert_eq!(View::from_clip(&Mat4::ZERO), Err(BadClipMatrix::Singular));
        assert_eq!(View::from_clip(&(good * f32::NAN)), Err(BadClipMatrix::Singular));
    }
}
