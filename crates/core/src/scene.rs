use core::ops::Range;

use glam::{Affine3A, Mat3, Vec2, Vec3};

use crate::{AlphaMode, Light, LightKind, Material, Projection, SceneError, Texture, TextureRef, View, math};

/// Axis-aligned box, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Smallest corner.
    pub min: Vec3,
    /// Largest corner.
    pub max: Vec3,
}

impl Aabb {
    /// The box of some points; `None` without any.
    #[must_use]
    pub fn of(points: impl IntoIterator<Item = Vec3>) -> Option<Self> {
        points.into_iter().fold(None, |b: Option<Self>, p| {
            Some(b.map_or(Self { min: p, max: p }, |b| Self { min: b.min.min(p), max: b.max.max(p) }))
        })
    }

    /// Middle of the box.
    #[must_use]
    pub fn centre(&self) -> Vec3 {
        self.min * 0.5 + self.max * 0.5
    }

    /// Edge lengths.
    #[must_use]
    pub fn extent(&self) -> Vec3 {
        self.max - self.min
    }

    /// Length of the diagonal.
    #[must_use]
    pub fn diagonal(&self) -> f32 {
        self.extent().length()
    }

    /// The eight corners.
    #[must_use]
    pub fn corners(&self) -> [Vec3; 8] {
        core::array::from_fn(|i| {
            let pick = |bit: usize, lo: f32, hi: f32| if i >> bit & 1 == 0 { lo } else { hi };
            Vec3::new(
                pick(0, self.min.x, self.max.x),
                pick(1, self.min.y, self.max.y),
                pick(2, self.min.z, self.max.z),
            )
        })
    }
}

/// All triangles of a scene in world space, in one indexed mesh.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Metres.
    pub positions: Vec<Vec3>,
    /// Unit shading normals, one per vertex.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one per vertex; empty where no material is textured.
    pub uvs: Vec<Vec2>,
    /// Linear RGB vertex colours that multiply the base colour, one per vertex; empty where no mesh has them.
    pub colors: Vec<Vec3>,
    /// Three vertex indices per triangle, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Index into [`Scene::materials`] per triangle.
    pub materials: Vec<u32>,
}

impl Mesh {
    /// World positions of a triangle's corners.
    #[must_use]
    #[inline]
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|i| self.positions[i as usize])
    }

    /// Unit normal of a triangle's plane, on the side from which it is counter-clockwise; zero for a degenerate one.
    #[must_use]
    #[inline]
    pub fn geometric_normal(&self, triangle: u32) -> Vec3 {
        let [a, b, c] = self.corners(triangle);
        math::normalize_or((b - a).cross(c - a), Vec3::ZERO)
    }

    /// Area of a triangle, m².
    #[must_use]
    pub fn area(&self, triangle: u32) -> f32 {
        let [a, b, c] = self.corners(triangle);
        0.5 * (b - a).cross(c - a).length()
    }

    /// Appends a copy of `other`, placed by `world_from_rest`, with its materials, and returns its vertices: an instance, which
    /// [`Self::pose`] moves. Vertices that only one of both coloured or textured get white and `(0, 0)`.
    pub fn push_instance(&mut self, other: &Self, world_from_rest: &Affine3A) -> Range<usize> {
        let (base, count) = (self.positions.len(), other.positions.len());
        let normals = Self::normal_matrix(world_from_rest);
        self.positions.extend(other.positions.iter().map(|p| world_from_rest.transform_point3(*p)));
        self.normals.extend(other.normals.iter().map(|n| math::normalize_or(normals * *n, *n)));
        if !(self.uvs.is_empty() && other.uvs.is_empty()) {
            self.uvs.resize(base, Vec2::ZERO);
            self.uvs.extend_from_slice(&other.uvs);
            self.uvs.resize(base + count, Vec2::ZERO);
        }
        if !(self.colors.is_empty() && other.colors.is_empty()) {
            self.colors.resize(base, Vec3::ONE);
            self.colors.extend_from_slice(&other.colors);
            self.colors.resize(base + count, Vec3::ONE);
        }
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + base as u32)));
        self.materials.extend_from_slice(&other.materials);
        base..base + count
    }

    /// The matrix that turns normals where `matrix` moves points: its cofactors, which need no inverse, so that a flattened object
    /// has normals too. Lengths change.
    #[must_use]
    pub fn normal_matrix(matrix: &Affine3A) -> Mat3 {
        let m = Mat3::from(matrix.matrix3);
        let cofactors =
            Mat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
        // A mirrored object keeps its normals on the side that they were on.
        if m.determinant() < 0.0 { cofactors * -1.0 } else { cofactors }
    }

    /// Places `vertices` where `world_from_rest` moves those of `rest`, the same mesh at rest; what neither mesh has is left out. The
    /// twin of `raster/pose.wgsl`.
    pub fn pose(&mut self, rest: &Self, vertices: Range<usize>, world_from_rest: &Affine3A) {
        let normals = Self::normal_matrix(world_from_rest);
        for i in vertices {
            if let (Some(to), Some(from)) = (self.positions.get_mut(i), rest.positions.get(i)) {
                *to = world_from_rest.transform_point3(*from);
            }
            if let (Some(to), Some(from)) = (self.normals.get_mut(i), rest.normals.get(i)) {
                *to = math::normalize_or(normals * *from, *from);
            }
        }
    }

    /// Appends a flat polygon (a fan over `corners`, counter-clockwise seen from the front) with its plane's normal.
    /// Vertices that other meshes coloured or textured get white and `(0, 0)`.
    pub fn push_polygon(&mut self, corners: &[Vec3], material: u32) {
        let [a, b, c, ..] = corners else { return };
        let normal = math::normalize_or((*b - *a).cross(*c - *a), Vec3::Y);
        let base = self.positions.len() as u32;
        self.positions.extend_from_slice(corners);
        self.normals.extend(corners.iter().map(|_| normal));
        if !self.uvs.is_empty() {
            self.uvs.resize(self.positions.len(), Vec2::ZERO);
        }
        if !self.colors.is_empty() {
            self.colors.resize(self.positions.len(), Vec3::ONE);
        }
        for i in 1..corners.len() as u32 - 1 {
            self.triangles.push([base, base + i, base + i + 1]);
            self.materials.push(material);
        }
    }
}

/// A lens without its film: what glTF calls a camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CameraProjection {
    /// Perspective with the vertical opening angle, radians.
    Perspective {
        /// Vertical opening angle, radians, `(0, π)`.
        yfov: f32,
    },
    /// Orthographic.
    Orthographic {
        /// Half the height, metres.
        half_height: f32,
    },
}

/// A named camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Name, for messages and for choosing one.
    pub name: String,
    /// Eye, metres.
    pub position: Vec3,
    /// Unit view direction.
    pub forward: Vec3,
    /// Unit vector to the top of the image.
    pub up: Vec3,
    /// Lens.
    pub projection: CameraProjection,
    /// Width over height that the file asks for, if it does.
    pub aspect: Option<f32>,
    /// Nearest visible depth, metres.
    pub near: f32,
    /// Farthest visible depth, metres, or infinite.
    pub far: f32,
}

impl Camera {
    /// The view of this camera onto an image of `size` pixels: the vertical opening is the camera's, the horizontal one
    /// follows from square pixels.
    #[must_use]
    pub fn view(&self, size: [u32; 2]) -> View {
        let aspect = size[0] as f32 / size[1].max(1) as f32;
        let projection = match self.projection {
            CameraProjection::Perspective { yfov } => {
                let t = (yfov * 0.5).tan();
                Projection::Perspective { tan_half: Vec2::new(t * aspect, t) }
            }
            CameraProjection::Orthographic { half_height } => {
                Projection::Orthographic { half_size: Vec2::new(half_height * aspect, half_height) }
            }
        };
        View::look_to(self.position, self.forward, self.up, projection, self.near, self.far)
    }
}

/// A surface point as light transport sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// World position, metres.
    pub position: Vec3,
    /// Unit normal of the triangle's plane, on its front side.
    pub geometric_normal: Vec3,
    /// Unit interpolated normal, on the same side of the surface as `geometric_normal`.
    pub shading_normal: Vec3,
    /// Lambertian albedo, `[0, 1]`.
    pub albedo: Vec3,
    /// Index into [`Scene::materials`].
    pub material: u32,
}

impl Surface {
    /// Geometric and shading normal turned to the side that `direction`, pointing away from the surface, lies on.
    #[must_use]
    #[inline]
    pub fn facing(&self, direction: Vec3) -> (Vec3, Vec3) {
        if self.geometric_normal.dot(direction) < 0.0 {
            (-self.geometric_normal, -self.shading_normal)
        } else {
            (self.geometric_normal, self.shading_normal)
        }
    }
}

/// A scene as plain data, in world space.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scene {
    /// Name, for messages and titles.
    pub name: String,
    /// All triangles.
    pub mesh: Mesh,
    /// Materials, at least one where there are triangles.
    pub materials: Vec<Material>,
    /// Textures.
    pub textures: Vec<Texture>,
    /// Punctual lights.
    pub lights: Vec<Light>,
    /// Cameras, in file order.
    pub cameras: Vec<Camera>,
}

impl Scene {
    /// Bounds of all vertices; `None` for an empty mesh.
    #[must_use]
    pub fn bounds(&self) -> Option<Aabb> {
        Aabb::of(self.mesh.positions.iter().copied())
    }

    /// The surface at barycentric `(u, v)` of a triangle.
    #[must_use]
    pub fn surface(&self, triangle: u32, u: f32, v: f32) -> Surface {
        let mesh = &self.mesh;
        let [i0, i1, i2] = mesh.triangles[triangle as usize].map(|i| i as usize);
        let w = 1.0 - u - v;
        let position = mesh.positions[i0] * w + mesh.positions[i1] * u + mesh.positions[i2] * v;
        let geometric_normal = mesh.geometric_normal(triangle);
        let n = mesh.normals[i0] * w + mesh.normals[i1] * u + mesh.normals[i2] * v;
        let n = math::normalize_or(n, geometric_normal);
        let shading_normal = if n.dot(geometric_normal) < 0.0 { -n } else { n };
        let material = mesh.materials[triangle as usize];
        let albedo = self.albedo(triangle, u, v);
        Surface { position, geometric_normal, shading_normal, albedo, material }
    }

    /// Lambertian albedo at barycentric `(u, v)` of a triangle: base colour × vertex colour × (1 − metallic).
    #[must_use]
    pub fn albedo(&self, triangle: u32, u: f32, v: f32) -> Vec3 {
        let (base, metallic, _) = self.base(triangle, u, v);
        base * (1.0 - metallic)
    }

    /// What a metal reflects at a point of a triangle, in each channel: the base colour times the metallic share, `[0, 1]`; and the
    /// perceptual roughness, `[0, 1]`.
    #[must_use]
    pub fn specular(&self, triangle: u32, u: f32, v: f32) -> (Vec3, f32) {
        let (base, metallic, roughness) = self.base(triangle, u, v);
        (base * metallic, roughness)
    }

    /// Base colour, metallic share and roughness at a point of a triangle.
    fn base(&self, triangle: u32, u: f32, v: f32) -> (Vec3, f32, f32) {
        let mesh = &self.mesh;
        let m = &self.materials[mesh.materials[triangle as usize] as usize];
        let (mut base, mut metallic, mut roughness) = (m.base_color, m.metallic, m.roughness);
        if let Some(t) = m.base_color_texture {
            base *= self.texel(t, triangle, u, v).truncate();
        }
        if let Some(t) = m.metallic_roughness_texture
            && metallic > 0.0
        {
            let texel = self.texel(t, triangle, u, v);
            metallic *= texel.z;
            roughness *= texel.y;
        }
        if !mesh.colors.is_empty() {
            let [i0, i1, i2] = mesh.triangles[triangle as usize].map(|i| i as usize);
            base *= mesh.colors[i0] * (1.0 - u - v) + mesh.colors[i1] * u + mesh.colors[i2] * v;
        }
        (base, metallic, roughness)
    }

    /// Radiance that barycentric `(u, v)` of a triangle emits to its front (and to its back where the material is
    /// double-sided), W/(sr·m²).
    #[must_use]
    pub fn emission(&self, triangle: u32, u: f32, v: f32) -> Vec3 {
        let m = &self.materials[self.mesh.materials[triangle as usize] as usize];
        match m.emission_texture {
            Some(t) if m.is_emissive() => m.emission * self.texel(t, triangle, u, v).truncate(),
            _ => m.emission,
        }
    }

    /// Whether the alpha test keeps barycentric `(u, v)` of a triangle.
    #[must_use]
    #[inline]
    pub fn is_solid(&self, triangle: u32, u: f32, v: f32) -> bool {
        let m = &self.materials[self.mesh.materials[triangle as usize] as usize];
        match m.alpha_mode {
            AlphaMode::Opaque => true,
            AlphaMode::Mask { cutoff } => {
                let texture = m.base_color_texture.map_or(1.0, |t| self.texel(t, triangle, u, v).w);
                m.base_alpha * texture >= cutoff
            }
        }
    }

    fn texel(&self, t: TextureRef, triangle: u32, u: f32, v: f32) -> glam::Vec4 {
        let uvs = &self.mesh.uvs;
        let uv = if uvs.is_empty() {
            Vec2::ZERO
        } else {
            let [i0, i1, i2] = self.mesh.triangles[triangle as usize].map(|i| i as usize);
            uvs[i0] * (1.0 - u - v) + uvs[i1] * u + uvs[i2] * v
        };
        self.textures[t.texture as usize].sample(t.uv_transform.transform_point2(uv))
    }

    /// Checks every index, length and number, so that the rest of the workspace may rely on them. Loaders call this; so
    /// should whoever builds a scene by hand.
    ///
    /// # Errors
    /// The first element at fault.
    pub fn validate(&self) -> Result<(), SceneError> {
        let mesh = &self.mesh;
        let vertices = mesh.positions.len();
        let lengths = [
            ("normals", mesh.normals.len(), false),
            ("uvs", mesh.uvs.len(), true),
            ("colors", mesh.colors.len(), true),
        ];
        for (attribute, found, optional) in lengths {
            if found != vertices && !(optional && found == 0) {
                return Err(SceneError::AttributeLength { attribute, expected: vertices, found });
            }
        }
        if mesh.materials.len() != mesh.triangles.len() {
            let (expected, found) = (mesh.triangles.len(), mesh.materials.len());
            return Err(SceneError::AttributeLength { attribute: "materials", expected, found });
        }
        let in_range = |what, index, target, value: u32, count: usize| {
            let value = value as usize;
            if value < count {
                Ok(())
            } else {
                Err(SceneError::IndexOutOfRange { what, index, target, value, count })
            }
        };
        for (i, (t, &m)) in mesh.triangles.iter().zip(&mesh.materials).enumerate() {
            for &v in t {
                in_range("triangle", i, "vertex", v, vertices)?;
            }
            in_range("triangle", i, "material", m, self.materials.len())?;
        }
        let require = |ok: bool, what, index, field, value: &dyn core::fmt::Debug, requirement| {
            if ok {
                Ok(())
            } else {
                Err(SceneError::BadValue { what, index, field, value: format!("{value:?}"), requirement })
            }
        };
        for (i, p) in mesh.positions.iter().enumerate() {
            require(p.is_finite(), "vertex", i, "position", p, "finite")?;
        }
        for (i, n) in mesh.normals.iter().enumerate() {
            require(n.is_finite(), "vertex", i, "normal", n, "finite")?;
        }
        for (i, m) in self.materials.iter().enumerate() {
            let unit = |v: Vec3| v.is_finite() && v.min_element() >= 0.0 && v.max_element() <= 1.0;
            require(unit(m.base_color), "material", i, "base_color", &m.base_color, "in [0, 1]")?;
            require((0.0..=1.0).contains(&m.metallic), "material", i, "metallic", &m.metallic, "in [0, 1]")?;
            require(
                (0.0..=1.0).contains(&m.transmission),
                "material",
                i,
                "transmission",
                &m.transmission,
                "in [0, 1]",
            )?;
            let ok = m.ior.is_finite() && m.ior >= 1.0;
            require(ok, "material", i, "ior", &m.ior, "finite and at least 1")?;
            let e = m.emission;
            let ok = e.is_finite() && e.min_element() >= 0.0;
            require(ok, "material", i, "emission", &e, "finite and not negative")?;
            for t in
                [m.base_color_texture, m.metallic_roughness_texture, m.emission_texture].into_iter().flatten()
            {
                in_range("material", i, "texture", t.texture, self.textures.len())?;
            }
        }
        for (i, t) in self.textures.iter().enumerate() {
            let texels = t.size[0] as usize * t.size[1] as usize;
            let ok = texels > 0 && texels == t.texels.len();
            require(ok, "texture", i, "size", &t.size, "at least 1×1 and match its texels")?;
        }
        for (i, l) in self.lights.iter().enumerate() {
            let ok = l.power.is_finite() && l.power.min_element() >= 0.0;
            require(ok, "light", i, "power", &l.power, "finite and not negative")?;
            let ok = l.range.is_none_or(|r| r > 0.0);
            require(ok, "light", i, "range", &l.range, "positive")?;
            let unit = |d: Vec3| (d.length() - 1.0).abs() < 1e-3;
            match l.kind {
                LightKind::Directional { direction } => {
                    require(unit(direction), "light", i, "direction", &direction, "of unit length")?;
                }
                LightKind::Point { position } => {
                    require(position.is_finite(), "light", i, "position", &position, "finite")?;
                }
                LightKind::Spot { position, direction, inner_angle, outer_angle } => {
                    require(position.is_finite(), "light", i, "position", &position, "finite")?;
                    require(unit(direction), "light", i, "direction", &direction, "of unit length")?;
                    let ok = inner_angle >= 0.0
                        && inner_angle <= outer_angle
                        && outer_angle <= core::f32::consts::FRAC_PI_2 + 1e-6;
                    let angles = (inner_angle, outer_angle);
                    require(ok, "light", i, "cone angles", &angles, "0 ≤ inner ≤ outer ≤ π/2")?;
                }
            }
        }
        for (i, c) in self.cameras.iter().enumerate() {
            let ok = c.position.is_finite() && (c.forward.length() - 1.0).abs() < 1e-3 && c.near < c.far;
            require(
                ok,
                "camera",
                i,
                "pose",
                &(c.position, c.forward, c.near, c.far),
                "finite, with near < far",
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quad() -> Scene {
        let mut scene =
            Scene { materials: vec![Material::diffuse("m", Vec3::splat(0.5))], ..Scene::default() };
        let (x, z) = (Vec3::X, Vec3::Z);
        scene.mesh.push_polygon(&[-x + z, x + z, x - z, -x - z], 0);
        scene
    }

    #[test]
    fn polygons_face_up_and_interpolate() {
        let scene = quad();
        scene.validate().unwrap();
        assert_eq!(scene.mesh.triangles.len(), 2);
        let s = scene.surface(0, 0.25, 0.5);
        assert_eq!((s.geometric_normal, s.shading_normal, s.albedo), (Vec3::Y, Vec3::Y, Vec3::splat(0.5)));
        assert_eq!(s.facing(Vec3::NEG_Y), (Vec3::NEG_Y, Vec3::NEG_Y));
        assert!((scene.mesh.area(0) - 2.0).abs() < 1e-6);
    }

    #[test]
    fn validation_names_the_element() {
        let mut s = quad();
        s.mesh.positions[3].x = f32::NAN;
        assert!(s.validate().unwrap_err().to_string().starts_with("vertex 3: position is"));
        let mut s = quad();
        s.mesh.triangles[1][2] = 9;
        assert_eq!(s.validate().unwrap_err().to_string(), "triangle 1 names vertex 9, but there are only 4");
        let mut s = quad();
        s.materials[0].base_color.y = 1.5;
        assert!(s.validate().unwrap_err().to_string().contains("must be in [0, 1]"));
        let mut s = quad();
        s.mesh.normals.pop();
        assert!(s.validate().unwrap_err().to_string().contains("`normals` has 3 entries"));
    }
}
