use core::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};
use indirect_core::{Hit, Scene, math};
use indirect_sampling::mapping;

const SMOOTH: u32 = 1;
const TEXTURED: u32 = 2;
const EMISSIVE: u32 = 4;
const TWO_SIDED: u32 = 8;

/// A triangle as a path needs it, in one cache line.
#[repr(align(64))]
#[derive(Debug, Clone, Copy)]
struct Triangle {
    v0: Vec3,
    e1: Vec3,
    e2: Vec3,
    normal: Vec3,
    /// Where not `TEXTURED`.
    albedo: Vec3,
    flags: u32,
}

/// The scene's surfaces, arranged for random access.
#[derive(Debug)]
pub(crate) struct Surfaces<'a> {
    scene: &'a Scene,
    triangles: Vec<Triangle>,
}

/// A point of a surface seen from one side. Both normals are turned to that side.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Vertex {
    pub(crate) position: Vec3,
    /// Unit normal of the triangle's plane.
    pub(crate) geometric: Vec3,
    /// Unit interpolated normal.
    pub(crate) shading: Vec3,
    pub(crate) albedo: Vec3,
    /// Radiance emitted to this side.
    pub(crate) emission: Vec3,
}

impl<'a> Surfaces<'a> {
    pub(crate) fn new(scene: &'a Scene) -> Self {
        let mesh = &scene.mesh;
        let triangle = |t: u32| {
            let [v0, b, c] = mesh.corners(t);
            let normal = mesh.geometric_normal(t);
            let material = &scene.materials[mesh.materials[t as usize] as usize];
            // A vertex normal may point to either side and need not be of unit length: only its line counts here.
            let parallel = |i: u32| {
                let n = math::normalize_or(mesh.normals[i as usize], normal);
                n.dot(normal).abs() > 1.0 - 1e-6
            };
            let smooth = !mesh.triangles[t as usize].into_iter().all(parallel);
            let textured = material.base_color_texture.is_some()
                || (material.metallic_roughness_texture.is_some() && material.metallic > 0.0)
                || !mesh.colors.is_empty();
            let flags = if smooth { SMOOTH } else { 0 }
                | if textured { TEXTURED } else { 0 }
                | if material.is_emissive() { EMISSIVE } else { 0 }
                | if material.double_sided { TWO_SIDED } else { 0 };
            let albedo = if textured { Vec3::ZERO } else { scene.albedo(t, 0.0, 0.0) };
            Triangle { v0, e1: b - v0, e2: c - v0, normal, albedo, flags }
        };
        Self { scene, triangles: (0..mesh.triangles.len() as u32).map(triangle).collect() }
    }

    pub(crate) fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// The point that a ray along `direction` met.
    #[inline]
    pub(crate) fn vertex(&self, hit: &Hit, direction: Vec3) -> Vertex {
        let Hit { u, v, triangle, .. } = *hit;
        let t = &self.triangles[triangle as usize];
        let back = t.normal.dot(direction) > 0.0;
        let geometric = if back { -t.normal } else { t.normal };
        let shading = if t.flags & SMOOTH == 0 {
            geometric
        } else {
            let mesh = &self.scene.mesh;
            let [a, b, c] = mesh.triangles[triangle as usize].map(|i| mesh.normals[i as usize]);
            let n = math::normalize_or(a * (1.0 - u - v) + b * u + c * v, geometric);
            if n.dot(geometric) < 0.0 { -n } else { n }
        };
        let albedo = if t.flags & TEXTURED == 0 {
            t.albedo
        } else {
            // Barycentric rounding may leave a product of colours a hair outside.
            self.scene.albedo(triangle, u, v).clamp(Vec3::ZERO, Vec3::ONE)
        };
        let emission = if t.flags & EMISSIVE != 0 && (!back || t.flags & TWO_SIDED != 0) {
            self.scene.emission(triangle, u, v)
        } else {
            Vec3::ZERO
        };
        Vertex { position: t.v0 + t.e1 * u + t.e2 * v, geometric, shading, albedo, emission }
    }
}

/// How a vertex distributes reflected light over directions: `ρ` times this density is what it reflects, and sampling
/// it leaves the weight `ρ`.
///
/// The density is `(max(0, nₛ·ω) + (1 − A)·n_g·ω)/π` on the visible side of the plane, `n_g·ω > 0`, and 0 below it, with
/// `A = (1 + nₛ·n_g)/2`, the share of the shading normal's cosine lobe that lies above the plane. For a flat surface
/// that is the Lambertian `cosθ/π`. For an interpolated normal, cutting the lobe at the plane keeps light from leaking
/// through the surface, and the second term returns exactly what the cut takes: it integrates to 1 whatever the
/// normals, so a closed furnace stays exact.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lobe {
    geometric: Vec3,
    shading: Vec3,
    /// `1 − A`.
    rest: f32,
}

impl Lobe {
    #[inline]
    pub(crate) fn new(vertex: &Vertex) -> Self {
        let (geometric, shading) = (vertex.geometric, vertex.shading);
        let rest = if geometric == shading { 0.0 } else { (0.5 - 0.5 * shading.dot(geometric)).max(0.0) };
        Self { geometric, shading, rest }
    }

    /// Density per steradian of the unit direction `w`.
    #[inline]
    pub(crate) fn density(&self, w: Vec3) -> f32 {
        let cos = self.geometric.dot(w);
        if cos <= 0.0 {
            return 0.0;
        }
        (self.shading.dot(w).max(0.0) + self.rest * cos) * FRAC_1_PI
    }

    /// A direction with that density from a uniform `u`; `fresh` yields another uniform point where the first falls
    /// below the plane. `None` for a degenerate triangle, or where rounding puts the direction into the plane.
    #[inline]
    pub(crate) fn sample(&self, u: Vec2, fresh: impl FnOnce() -> Vec2) -> Option<Vec3> {
        let around = |n: Vec3, u: Vec2| {
            let (t, b) = math::orthonormal_basis(n);
            let l = mapping::hemisphere_cosine(u);
            t * l.x + b * l.y + n * l.z
        };
        let mut w = around(self.shading, u);
        if self.rest > 0.0 && self.geometric.dot(w) <= 0.0 {
            w = around(self.geometric, fresh());
        }
        (self.geometric.dot(w) > 0.0).then_some(w)
    }
}
