#![doc = include_str!("../README.md")]

pub mod cast;
#[cfg(feature = "gpu")]
pub mod gpu;

mod builder;
mod flat;
mod layout;
mod query;
mod simd;
mod traverse;

use indirect_core::{Hit, Ray, Scene};

pub use builder::BuildPreset;
pub use flat::{FlatNode, FlatTree, FlatTriangle, RefitError, STACK};
pub use glam;
pub use traverse::opaque;

use layout::{Node, Packet, Tree};
use query::{Any, Closest};
use simd::Isa;

/// An acceleration structure over the triangles of a scene.
///
/// Queries are two-sided, take the scene's alpha masks into account and are watertight: a ray never passes between
/// two triangles that share an edge or a vertex. They count hits with `0 ≤ t < t_max`. They take `&self`; share one
/// structure among threads.
#[derive(Debug, Clone)]
pub struct Accel<'a> {
    scene: &'a Scene,
    tree: Tree,
    unit: f32,
    isa: Isa,
}

impl<'a> Accel<'a> {
    /// Builds the structure, on all of rayon's threads. The same scene and preset give the same structure on any number
    /// of threads.
    ///
    /// The scene should have passed [`Scene::validate`]; triangles that are degenerate, not finite or name what does
    /// not exist are left out.
    #[must_use]
    pub fn build(scene: &'a Scene, preset: BuildPreset) -> Self {
        let tree = builder::build(scene, preset);
        let [lo, hi] = tree.bounds.map(glam::Vec3::from);
        let unit = (hi - lo).length();
        Self { scene, tree, unit, isa: Isa::detect() }
    }

    /// The scene it was built for.
    #[must_use]
    #[inline]
    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// The nearest hit with `0 ≤ t < ray.t_max`; of equally near ones that of the triangle with the smallest index. `None`
    /// for a ray with a zero direction or a NaN.
    #[must_use]
    #[inline]
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let (tree, scene) = (&self.tree, self.scene);
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
        let (tree, scene) = (&self.tree, self.scene);
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

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use indirect_core::Material;

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
