//! Meshes and random numbers that the tests share.
#![allow(dead_code, reason = "each test file uses a part")]

use glam::{Affine2, Mat3, Vec2, Vec3};
use indirect_accel::Accel;
use indirect_core::math::{offset_ray_origin_scaled, orthonormal_basis};
use indirect_core::{AlphaMode, Material, Ray, Scene, Texture, TextureRef, Wrap};

/// A reproducible stream of numbers (PCG-RXS-M-XS 32).
pub(crate) struct Random(pub(crate) u32);

impl Random {
    pub(crate) fn bits(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((self.0 >> ((self.0 >> 28) + 4)) ^ self.0).wrapping_mul(277_803_737);
        (word >> 22) ^ word
    }

    /// Uniform in `[0, 1)`.
    pub(crate) fn unit(&mut self) -> f32 {
        (self.bits() >> 8) as f32 / 16_777_216.0
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        ((u64::from(self.bits()) * n as u64) >> 32) as usize
    }

    /// Uniform in the cube `[-1, 1)³`.
    pub(crate) fn cube(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    /// Uniform on the unit sphere.
    pub(crate) fn direction(&mut self) -> Vec3 {
        loop {
            let p = self.cube();
            let l = p.length_squared();
            if l > 1e-3 && l <= 1.0 {
                return p / l.sqrt();
            }
        }
    }

    /// Cosine-distributed about `n`.
    pub(crate) fn hemisphere(&mut self, n: Vec3) -> Vec3 {
        let (t, b) = orthonormal_basis(n);
        let (r2, phi) = (self.unit(), core::f32::consts::TAU * self.unit());
        t * (r2.sqrt() * phi.cos()) + b * (r2.sqrt() * phi.sin()) + n * (1.0 - r2).sqrt()
    }

    /// Barycentric coordinates of a point spread uniformly over a triangle.
    pub(crate) fn barycentric(&mut self) -> (f32, f32) {
        let (a, b) = (self.unit().sqrt(), self.unit());
        (a * (1.0 - b), a * b)
    }
}

/// A scene of these triangles with one grey material.
pub(crate) fn scene(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Scene {
    let mut scene =
        Scene { materials: vec![Material::diffuse("grey", Vec3::splat(0.5))], ..Scene::default() };
    scene.mesh.normals = vec![Vec3::Y; positions.len()];
    scene.mesh.positions = positions;
    scene.mesh.materials = vec![0; triangles.len()];
    scene.mesh.triangles = triangles;
    scene
}

/// The same scene, scaled, then moved: vertices round, but shared ones stay shared.
pub(crate) fn placed(mut scene: Scene, scale: f32, offset: Vec3) -> Scene {
    for p in &mut scene.mesh.positions {
        *p = *p * scale + offset;
    }
    scene
}

/// Two scenes as one.
pub(crate) fn both(mut a: Scene, b: Scene) -> Scene {
    let base = a.mesh.positions.len() as u32;
    a.mesh.positions.extend(b.mesh.positions);
    a.mesh.triangles.extend(b.mesh.triangles.iter().map(|t| t.map(|i| i + base)));
    scene(a.mesh.positions, a.mesh.triangles)
}

/// A closed sphere of radius about 1 with bumps, `4·n·(n−1)` triangles: poles, and `2n` vertices on each of `n−1` rings.
pub(crate) fn bumpy_sphere(n: u32) -> Scene {
    use core::f32::consts::PI;
    let around = 2 * n;
    let mut positions = vec![Vec3::Y, Vec3::NEG_Y];
    for j in 1..n {
        let theta = PI * j as f32 / n as f32;
        for i in 0..around {
            let phi = PI * i as f32 / n as f32;
            let r = 1.0 + 0.1 * (7.0 * phi).sin() * (5.0 * theta).sin() * theta.sin();
            positions.push(r * Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()));
        }
    }
    let at = |j: u32, i: u32| 2 + (j - 1) * around + i % around;
    let mut triangles = Vec::new();
    for i in 0..around {
        triangles.push([0, at(1, i + 1), at(1, i)]);
        triangles.push([1, at(n - 1, i), at(n - 1, i + 1)]);
        for j in 1..n - 1 {
            triangles.push([at(j, i), at(j, i + 1), at(j + 1, i + 1)]);
            triangles.push([at(j, i), at(j + 1, i + 1), at(j + 1, i)]);
        }
    }
    scene(positions, triangles)
}

/// Two cones base to base: `2·n` slivers of aspect ratio about `n/6` that all meet in two points.
pub(crate) fn slivers(n: u32) -> Scene {
    let angle = |i: u32| core::f32::consts::TAU * i as f32 / n as f32;
    let ring = (0..n).map(|i| Vec3::new(angle(i).cos(), 0.0, angle(i).sin()));
    let positions = [Vec3::Y, Vec3::NEG_Y].into_iter().chain(ring).collect();
    let side = |i: u32| [[0, 2 + (i + 1) % n, 2 + i], [1, 2 + i, 2 + (i + 1) % n]];
    scene(positions, (0..n).flat_map(side).collect())
}

/// A cube of half-edge 1, its faces split into `n·n` squares of two triangles, turned by `rotation`.
pub(crate) fn cube(n: u32, rotation: Mat3) -> Scene {
    let mut positions: Vec<Vec3> = Vec::new();
    let mut index = std::collections::HashMap::new();
    let mut triangles = Vec::new();
    let mut vertex = |p: [i64; 3]| {
        *index.entry(p).or_insert_with(|| {
            let unit = |c: i64| c as f32 / n as f32 * 2.0 - 1.0;
            positions.push(rotation * Vec3::new(unit(p[0]), unit(p[1]), unit(p[2])));
            positions.len() as u32 - 1
        })
    };
    let n = i64::from(n);
    for axis in 0..3 {
        for side in [0, n] {
            for i in 0..n {
                for j in 0..n {
                    let mut corner = |a: i64, b: i64| {
                        let mut p = [0; 3];
                        (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, i + a, j + b);
                        vertex(p)
                    };
                    let (p, q, r, s) = (corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1));
                    let quad = if side == 0 { [[p, r, q], [p, s, r]] } else { [[p, q, r], [p, r, s]] };
                    triangles.extend(quad);
                }
            }
        }
    }
    scene(positions, triangles)
}

/// Variants of a ray that hits something, none of which hits anything.
pub(crate) fn odd_rays(good: Ray) -> Vec<Ray> {
    let mut rays = vec![Ray { direction: Vec3::ZERO, ..good }, Ray { direction: -Vec3::ZERO, ..good }];
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for axis in 0..3 {
            let (mut o, mut d) = (good, good);
            o.origin[axis] = bad;
            d.direction[axis] = bad;
            rays.extend([o, d]);
        }
    }
    rays.extend([0.0, -0.0, -1.0, f32::NAN, -f32::NAN, f32::NEG_INFINITY].map(|t_max| Ray { t_max, ..good }));
    rays
}

/// `top` with a checkerboard of 2 × 2 holes, over `floor`.
pub(crate) fn masked(top: Scene, floor: Scene) -> Scene {
    let mut scene = top;
    let (hole, solid) = ([0, 0, 0, 0], [65535, 0, 0, 65535]);
    scene.textures.push(Texture {
        name: "checker".into(),
        size: [2, 2],
        texels: vec![hole, solid, solid, hole],
        wrap: [Wrap::Clamp; 2],
    });
    scene.mesh.uvs = scene.mesh.positions.iter().map(|p| Vec2::new(p.x, p.z) * 0.5 + 0.5).collect();
    scene.materials[0].base_color_texture = Some(TextureRef { texture: 0, uv_transform: Affine2::IDENTITY });
    scene.materials[0].alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
    scene.materials.push(Material::diffuse("floor", Vec3::ONE));
    scene.mesh.push_polygon(&floor.mesh.positions, 1);
    scene
}

/// Triangles of very different sizes; some share edges, some repeat, some are degenerate, some lie in one plane.
pub(crate) fn soup(random: &mut Random, n: usize, size: f32, offset: Vec3) -> Scene {
    let mut positions = Vec::new();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for _ in 0..n {
        let old = positions.len() as u32;
        match (random.below(10), triangles.last().copied()) {
            (0, Some(last)) => triangles.push(last),
            (1, Some([a, b, _])) => {
                positions.push(random.cube() * size + offset);
                triangles.push([b, a, old]);
            }
            (2, Some([a, b, _])) => triangles.push([a, b, b]),
            (kind, _) => {
                let reach = size * 10.0_f32.powf(-3.0 * random.unit());
                let centre = random.cube() * size;
                let mut corner = || {
                    let mut p = centre + random.cube() * reach;
                    if kind == 3 {
                        p.y = 0.0;
                    }
                    p + offset
                };
                positions.extend([corner(), corner(), corner()]);
                triangles.push([old, old + 1, old + 2]);
            }
        }
    }
    scene(positions, triangles)
}

/// The square `[-1, 1]²` in the plane y = `y`.
pub(crate) fn square(y: f32) -> Scene {
    let mut square = scene(vec![], vec![]);
    let corner = |x, z| Vec3::new(x, y, z);
    let corners = [corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)];
    square.mesh.push_polygon(&corners, 0);
    square
}

/// Rays from inside of a closed mesh around `centre`, aimed at its edges, one in four at a vertex.
pub(crate) fn aimed(scene: &Scene, centre: Vec3, scale: f32, count: usize, random: &mut Random) -> Vec<Ray> {
    let aim = |_| {
        let corners = scene.mesh.corners(random.below(scene.mesh.triangles.len()) as u32);
        let k = random.below(3);
        let s = if random.bits() & 3 == 0 { 0.0 } else { random.unit() };
        let target = corners[k] + (corners[(k + 1) % 3] - corners[k]) * s;
        // Within a quarter of the radius; the target lies at t = 1.
        let origin = centre + random.cube() * (0.25 * scale);
        Ray { t_max: 1.5, ..Ray::new(origin, target - origin) }
    };
    // A target that rounds to the origin has no direction.
    (0..count).map(aim).filter(|r| r.direction != Vec3::ZERO).collect()
}

/// Rays of the scene's first camera (`side²` pixels), what leaves their hits in a random direction, one in three only a part of the way,
/// and 3000 rays from and to near vertices.
pub(crate) fn rays(accel: &Accel<'_>, side: u32, random: &mut Random) -> Vec<Ray> {
    let scene = accel.scene();
    let size = [side; 2];
    let mut rays = Vec::new();
    if let Some(camera) = scene.cameras.first() {
        let view = camera.view(size);
        for i in 0..side * side {
            let pixel = Vec2::new((i % side) as f32 + 0.5, (i / side) as f32 + 0.5);
            rays.push(Ray { t_max: f32::INFINITY, ..view.ray(pixel, size) });
        }
    }
    for i in 0..rays.len() {
        let Some(hit) = accel.closest_hit(&rays[i]) else { continue };
        let surface = scene.surface(hit.triangle, hit.u, hit.v);
        let n = surface.facing(-rays[i].direction).0;
        let origin = offset_ray_origin_scaled(surface.position, n, accel.unit());
        let t_max = if i % 3 == 0 { accel.unit() * random.unit() } else { f32::INFINITY };
        rays.push(Ray { origin, direction: random.hemisphere(n), t_max });
    }
    let positions = &scene.mesh.positions;
    for _ in 0..if positions.is_empty() { 0 } else { 3000 } {
        let (a, b) = (positions[random.below(positions.len())], positions[random.below(positions.len())]);
        rays.push(Ray::new(a + random.cube() * (0.1 * accel.unit()), b - a));
    }
    rays
}
