//! Structures that own their scene, that are made of triangles alone, and that follow what moves.

mod common;

use common::Random;
use glam::{Affine3A, Quat, Vec2, Vec3};
use indirect_accel::{Accel, BadTriangles, BuildPreset, RefitError};
use indirect_core::{AlphaMode, Hit, Material, Mesh, Ray, Scene};

const PRESETS: [BuildPreset; 3] = [BuildPreset::Fast, BuildPreset::Balanced, BuildPreset::Best];

fn point(random: &mut Random) -> Vec3 {
    (random.cube() + 1.0) * 5.0
}

/// Large and small triangles, so that `Best` splits some; every third is a mask that is solid in one half.
fn cloud(random: &mut Random) -> Scene {
    let texture = indirect_core::Texture {
        name: String::new(),
        size: [2, 1],
        texels: vec![[0; 4], [u16::MAX; 4]],
        wrap: [indirect_core::Wrap::Clamp; 2],
    };
    let masked = Material {
        alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
        base_color_texture: Some(indirect_core::TextureRef {
            texture: 0,
            uv_transform: glam::Affine2::IDENTITY,
        }),
        ..Material::diffuse("mask", Vec3::splat(0.5))
    };
    let materials = vec![Material::diffuse("solid", Vec3::splat(0.5)), masked];
    let mut scene = Scene { materials, textures: vec![texture], ..Scene::default() };
    for i in 0..600 {
        let (a, size) = (point(random), if i % 50 == 0 { 0.6 } else { 0.05 });
        let (b, c) = (a + (point(random) - a) * size, a + (point(random) - a) * size);
        scene.mesh.push_polygon(&[a, b, c], u32::from(i % 3 == 0));
    }
    scene.mesh.uvs = (0..scene.mesh.positions.len()).map(|i| Vec2::new((i % 3) as f32 * 0.5, 0.5)).collect();
    scene
}

fn moved(scene: &Scene, random: &mut Random, most: f32) -> Scene {
    let mut moved = scene.clone();
    for p in &mut moved.mesh.positions {
        *p += (point(random) - 5.0) * 0.2 * most;
    }
    moved
}

fn rays(random: &mut Random, count: usize) -> Vec<Ray> {
    (0..count)
        .map(|_| {
            let from = point(random);
            Ray { t_max: f32::INFINITY, ..Ray::new(from, point(random) - from) }
        })
        .collect()
}

fn bits(h: Option<Hit>) -> Option<[u32; 4]> {
    h.map(|h| [h.t.to_bits(), h.u.to_bits(), h.v.to_bits(), h.triangle])
}

/// Rays that two structures answer differently.
fn differing(a: &Accel<'_>, b: &Accel<'_>, rays: &[Ray]) -> usize {
    let other = |r: &&Ray| bits(a.closest_hit(r)) != bits(b.closest_hit(r)) || a.any_hit(r) != b.any_hit(r);
    rays.iter().filter(other).count()
}

#[test]
fn a_refitted_tree_answers_as_a_new_one() {
    let mut random = Random(5);
    let scene = cloud(&mut random);
    let rays = rays(&mut random, 20_000);
    for preset in PRESETS {
        for most in [0.02, 0.5, 5.0] {
            let moved = moved(&scene, &mut random, most);
            let new = Accel::build(&moved, preset);
            let mut refitted = Accel::build(&scene, preset);
            assert!(differing(&refitted, &new, &rays) > 100, "the tree of before would do");
            refitted.refit(&moved).unwrap();
            assert_eq!(differing(&refitted, &new, &rays), 0, "{preset:?} {most}");
            assert_eq!(refitted.unit(), new.unit());
            let mut owner = Accel::owning(scene.clone(), preset);
            owner.move_to(&moved.mesh.positions).unwrap();
            assert_eq!(differing(&owner, &new, &rays), 0, "{preset:?} {most}");
        }
    }
}

#[test]
fn vertices_that_are_no_more_are_hit_by_no_ray_and_may_come_back() {
    let mut random = Random(6);
    let scene = cloud(&mut random);
    let rays = rays(&mut random, 5_000);
    let mut accel = Accel::build(&scene, BuildPreset::Best);
    let whole = accel.clone();
    let mut gone = scene.clone();
    for i in 0..scene.mesh.positions.len() {
        if i % 2 == 0 {
            gone.mesh.positions[i] = if i % 4 == 0 { Vec3::NAN } else { Vec3::INFINITY };
        }
    }
    accel.refit(&gone).unwrap();
    let found = rays.iter().filter_map(|r| accel.closest_hit(r));
    assert!(found.into_iter().all(|h| scene.mesh.triangles[h.triangle as usize].iter().all(|&v| v % 2 == 1)));
    // Every triangle has a vertex that is gone.
    assert!(rays.iter().all(|r| !accel.any_hit(r)) && accel.unit() == 0.0);
    accel.refit(&scene).unwrap();
    assert_eq!(differing(&accel, &whole, &rays), 0);
}

#[test]
fn another_topology_is_refused() {
    let mut random = Random(7);
    let scene = cloud(&mut random);
    let mut more = scene.clone();
    more.mesh.push_polygon(&[Vec3::ZERO, Vec3::X, Vec3::Y], 0);
    let mut accel = Accel::build(&scene, BuildPreset::Fast);
    assert_eq!(accel.refit(&more), Err(RefitError::Triangles { expected: 600, found: 601 }));
    let mut owner = Accel::owning(scene.clone(), BuildPreset::Fast);
    assert_eq!(owner.move_to(&[Vec3::ZERO]), Err(RefitError::Positions { expected: 1800, found: 1 }));
    let rays = rays(&mut random, 500);
    assert_eq!(differing(&owner, &accel, &rays), 0);
}

#[test]
fn triangles_alone_are_hit_as_those_of_a_scene() {
    let mut random = Random(8);
    let mut scene = cloud(&mut random);
    scene.mesh.materials.iter_mut().for_each(|m| *m = 0);
    let rays = rays(&mut random, 10_000);
    let (positions, triangles) = (scene.mesh.positions.clone(), scene.mesh.triangles.clone());
    let expected = Accel::build(&scene, BuildPreset::Balanced);
    // A structure that owns its triangles outlives where they came from.
    let alone = Accel::from_triangles(&positions, &triangles, BuildPreset::Balanced).unwrap();
    drop((positions, triangles));
    assert_eq!(differing(&alone, &expected, &rays), 0);
    assert!(rays.iter().filter(|r| alone.any_hit(r)).count() > 1000);
    let bad = Accel::from_triangles(&[Vec3::ZERO; 3], &[[0, 1, 2], [0, 3, 1]], BuildPreset::Fast);
    assert_eq!(bad.unwrap_err(), BadTriangles::Index { triangle: 1, index: 3, positions: 3 });
    assert!(!Accel::from_triangles(&[], &[], BuildPreset::Best).unwrap().any_hit(&rays[0]));
}

#[test]
fn what_no_ray_can_hit_is_counted() {
    let mut scene = cloud(&mut Random(9));
    assert_eq!(Accel::build(&scene, BuildPreset::Fast).left_out(), 0);
    scene.mesh.positions[4] = scene.mesh.positions[3];
    scene.mesh.positions[7] = Vec3::NAN;
    scene.mesh.triangles[5][0] = 5000;
    scene.mesh.materials[9] = 2;
    assert_eq!(Accel::build(&scene, BuildPreset::Fast).left_out(), 4);
    scene.materials.clear();
    let accel = Accel::build(&scene, BuildPreset::Fast);
    assert_eq!(accel.left_out(), 600, "without materials nothing is hit, which is said");
}

#[test]
fn instances_move_with_their_matrices() {
    let mut random = Random(10);
    let shape = cloud(&mut random).mesh;
    let matrix = |random: &mut Random| {
        let rotation =
            Quat::from_rotation_y(random.unit() * 6.0) * Quat::from_rotation_x(random.unit() * 6.0);
        Affine3A::from_scale_rotation_translation(Vec3::new(0.3, 0.2, -0.4), rotation, point(random))
    };
    let materials = cloud(&mut random).materials;
    let mut scene = Scene { materials: vec![materials[0].clone(); 2], ..Scene::default() };
    let mut parts = Vec::new();
    let mut rest = Mesh::default();
    for _ in 0..4 {
        let placed = scene.mesh.push_instance(&shape, &matrix(&mut random));
        assert_eq!(placed, rest.push_instance(&shape, &Affine3A::IDENTITY));
        parts.push(placed);
    }
    let before = scene.clone();
    let mut accel = Accel::build(&before, BuildPreset::Best);
    let matrices: Vec<_> = parts.iter().map(|_| matrix(&mut random)).collect();
    for (part, m) in parts.iter().zip(&matrices).skip(1) {
        scene.mesh.pose(&rest, part.clone(), m);
    }
    let rays = rays(&mut random, 10_000);
    let mut fresh = Scene { materials: scene.materials.clone(), ..Scene::default() };
    fresh.mesh.positions = before.mesh.positions[parts[0].clone()].to_vec();
    fresh.mesh.normals = before.mesh.normals[parts[0].clone()].to_vec();
    fresh.mesh.uvs = shape.uvs.clone();
    fresh.mesh.triangles = shape.triangles.clone();
    fresh.mesh.materials = shape.materials.clone();
    matrices.iter().skip(1).for_each(|m| {
        fresh.mesh.push_instance(&shape, m);
    });
    assert!(fresh.mesh.positions == scene.mesh.positions && fresh.mesh.triangles == scene.mesh.triangles);
    let new = Accel::build(&fresh, BuildPreset::Best);
    assert!(differing(&accel, &new, &rays) > 100);
    accel.refit(&scene).unwrap();
    assert_eq!(differing(&accel, &new, &rays), 0);
}
