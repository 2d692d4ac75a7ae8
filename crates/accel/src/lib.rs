#![doc = include_str!("../README.md")]

pub mod cast;
#[cfg(feature = "gpu")]
pub mod gpu;

mod builder;
mod error;
mod flat;
mod layout;
mod query;
mod refit;
mod simd;
mod traverse;

use std::borrow::Cow;

use glam::Vec3;
use indirect_core::{Hit, Material, Mesh, Ray, Scene};

pub use builder::BuildPreset;
pub use error::{BadTriangles, RefitError};
pub use flat::{FlatNode, FlatTree, FlatTriangle, STACK};
pub use glam;
pub use traverse::opaque;

use layout::{Node, Packet, Tree};
use query::{Any, Closest};
use simd::Isa;

/// An acceleration structure over the triangles of a scene, which it borrows or owns.
///
/// Queries are two-sided, take the scene's alpha masks into account and are watertight: a ray never passes between
/// two triangles that share an edge or a vertex. They count hits with `0 ≤ t < t_max`. They take `&self`; share one
/// structure among threads.
#[derive(Debug, Clone)]
pub struct Accel<'a> {
    scene: Cow<'a, Scene>,
    tree: Tree,
    unit: f32,
    left_out: usize,
    isa: Isa,
}

impl<'a> Accel<'a> {
    /// Builds the structure, on all of rayon's threads. The same scene and preset give the same structure on any number
    /// of threads.
    ///
    /// The scene should have passed [`Scene::validate`]; triangles that are degenerate, not finite or name a vertex or material that
    /// does not exist are left out, and [`Self::left_out`] says how many.
    #[must_use]
    pub fn build(scene: &'a Scene, preset: BuildPreset) -> Self {
        Self::of(Cow::Borrowed(scene), preset)
    }

    fn of(scene: Cow<'a, Scene>, preset: BuildPreset) -> Self {
        let (tree, left_out) = builder::build(&scene, preset);
        let mut accel = Self { scene, tree, unit: 0.0, left_out, isa: Isa::detect() };
        accel.measure();
        accel
    }

    fn measure(&mut self) {
        let [lo, hi] = self.tree.bounds.map(Vec3::from);
        self.unit = (hi - lo).length();
    }

    /// The scene it was built for.
    #[must_use]
    #[inline]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Triangles that no ray can hit: degenerate, not finite or absurdly far, or naming a vertex or material that does not exist. A scene
    /// without materials is left out whole.
    #[must_use]
    pub const fn left_out(&self) -> usize {
        self.left_out
    }

    /// Follows `scene`, the same with moved vertices: the topology of the tree stays, so that every hit is right, and queries become slow
    /// where triangles that were neighbours no longer are. Triangles that were left out stay out; those that lose their area, or whose
    /// vertices are not finite, are hit by no ray.
    ///
    /// # Errors
    /// [`RefitError`]; the structure is then as it was.
    pub fn refit(&mut self, scene: &'a Scene) -> Result<(), RefitError> {
        self.refit_to(Cow::Borrowed(scene))
    }

    fn refit_to(&mut self, scene: Cow<'a, Scene>) -> Result<(), RefitError> {
        let (expected, found) = (self.scene.mesh.triangles.len(), scene.mesh.triangles.len());
        if expected != found {
            return Err(RefitError::Triangles { expected, found });
        }
        refit::refit(&mut self.tree, &scene);
        self.scene = scene;
        self.measure();
        Ok(())
    }

    /// The nearest hit with `0 ≤ t < ray.t_max`; of equally near ones that of the triangle with the smallest index. `None`
    /// for a ray with a zero direction or a NaN.
    #[must_use]
    #[inline]
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let (tree, scene) = (&self.tree, &*self.scene);
        if tree.masked {
            self.isa.run(Closest::<true> { tree, scene, ray })
        } else {
            self.isa.run(Closest::<false> { tree, scene, ray })
        }
    }

    /// Whether there is any hit with `0 ≤ t < ray.t_max`: the same answer as `closest_hit(ray).is_some()`, sooner.
    #[must_use]
    #[inline]
    pub fn any_hit(&self, ray: &Ray) -> bool {
        let (tree, scene) = (&self.tree, &*self.scene);
        if tree.masked {
            self.isa.run(Any::<true> { tree, scene, ray })
        } else {
            self.isa.run(Any::<false> { tree, scene, ray })
        }
    }

    /// Memory of the structure, bytes, without the scene.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.tree.nodes.len() * size_of::<Node>() + self.tree.packets.len() * size_of::<Packet>()
    }

    /// The scene's characteristic length, metres: the diagonal of its triangles' bounds. Meant for
    /// [`indirect_core::math::offset_ray_origin_scaled`].
    #[must_use]
    #[inline]
    pub fn unit(&self) -> f32 {
        self.unit
    }
}

impl Accel<'static> {
    /// [`Accel::build`] for a scene that the structure keeps.
    #[must_use]
    pub fn owning(scene: Scene, preset: BuildPreset) -> Self {
        Self::of(Cow::Owned(scene), preset)
    }

    /// The structure over triangles alone, each three indices into `positions`, metres: what rays hit is all that is known of them.
    ///
    /// # Errors
    /// [`BadTriangles`] for an index that names no position.
    pub fn from_triangles(
        positions: &[Vec3],
        indices: &[[u32; 3]],
        preset: BuildPreset,
    ) -> Result<Self, BadTriangles> {
        let count = positions.len();
        for (triangle, corners) in indices.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|&&i| i as usize >= count) {
                return Err(BadTriangles::Index { triangle, index, positions: count });
            }
        }
        let mesh = Mesh {
            positions: positions.to_vec(),
            normals: vec![Vec3::Y; count],
            triangles: indices.to_vec(),
            materials: vec![0; indices.len()],
            ..Mesh::default()
        };
        let materials = vec![Material::diffuse("", Vec3::splat(0.5))];
        Ok(Self::owning(Scene { mesh, materials, ..Scene::default() }, preset))
    }

    /// [`Accel::refit`] for a structure that keeps its scene: where its vertices are now.
    ///
    /// # Errors
    /// [`RefitError::Positions`] for another number of them; the structure is then as it was.
    pub fn move_to(&mut self, positions: &[Vec3]) -> Result<(), RefitError> {
        let mesh = &mut self.scene.to_mut().mesh;
        let (expected, found) = (mesh.positions.len(), positions.len());
        if expected != found {
            return Err(RefitError::Positions { expected, found });
        }
        mesh.positions.copy_from_slice(positions);
        refit::refit(&mut self.tree, &self.scene);
        self.measure();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles in a regular lattice of planes, so that many rays meet edges and vertices exactly.
    fn lattice() -> Scene {
        let mut scene =
            Scene { materials: vec![Material::diffuse("m", Vec3::splat(0.5))], ..Scene::default() };
        for i in 0..1000 {
            let p = Vec3::new((i % 10) as f32, (i / 10 % 10) as f32, (i / 100) as f32);
            let (a, b) = [(Vec3::X, Vec3::Y), (Vec3::Y, Vec3::Z), (Vec3::Z, Vec3::X)][i % 3];
            scene.mesh.push_polygon(&[p, p + a, p + a + b, p + b], 0);
        }
        scene
    }

    #[test]
    fn instruction_sets_and_stacks_agree_bit_for_bit() {
        let scene = lattice();
        let fast = Accel::build(&scene, BuildPreset::Best);
        let portable = Accel { isa: Isa::Portable, ..fast.clone() };
        // A stack too large for the inline one.
        let deep = Accel { tree: Tree { stack: 1000, ..fast.tree.clone() }, ..fast.clone() };
        let mut state = 1_u64;
        let mut next = |steps: f32| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 40) as f32 / 16_777_216.0 * steps).round() / steps
        };
        let mut hits = 0;
        for i in 0..100_000 {
            // Every other ray joins lattice points, half points and thirds.
            let steps = if i % 2 == 0 { 1e9 } else { 60.0 };
            let mut point = || Vec3::new(next(steps), next(steps), next(steps)) * 10.0;
            let (a, b) = (point(), point());
            let ray = Ray::new(a, b - a);
            let hit = fast.closest_hit(&ray);
            let bits = |h: Option<Hit>| h.map(|h| (h.t.to_bits(), h.u.to_bits(), h.v.to_bits(), h.triangle));
            for other in [&portable, &deep] {
                assert_eq!(bits(hit), bits(other.closest_hit(&ray)));
                assert_eq!(hit.is_some(), other.any_hit(&ray));
            }
            assert_eq!(hit.is_some(), fast.any_hit(&ray));
            hits += usize::from(hit.is_some());
        }
        assert!(hits > 10_000, "{hits}");
    }
}
