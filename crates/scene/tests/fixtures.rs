//! The fixtures: stored bit for bit, read back to the same scene, and lit as they say.

use std::path::Path;

use glam::{Vec2, Vec3};
use indirect_core::{LightKind, Scene};
use indirect_scene::fixtures::{self, Atrium, NAMES};
use indirect_scene::{LoadOptions, load, resolve};

#[test]
fn written_and_read_back_they_are_the_same() {
    let dir = tempfile::tempdir().unwrap();
    let paths = fixtures::write_all(dir.path()).unwrap();
    assert_eq!(paths.len(), NAMES.len() - 1);
    for path in paths {
        let loaded = load(&path, &LoadOptions::default()).unwrap();
        let name = path.file_stem().unwrap().to_str().unwrap();
        assert_eq!(loaded.scene, fixtures::build(name).unwrap(), "{name}");
        assert!(loaded.warnings.is_empty(), "{name}: {:?}", loaded.warnings);
        assert_eq!(resolve(name, &LoadOptions::default()).unwrap(), loaded);
    }
}

#[test]
fn stored_files_are_what_the_code_writes() {
    let stored = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures");
    let dir = tempfile::tempdir().unwrap();
    for path in fixtures::write_all(dir.path()).unwrap() {
        let name = path.file_name().unwrap();
        let (new, old) = (std::fs::read(&path).unwrap(), std::fs::read(stored.join(name)).unwrap());
        assert!(new == old, "{} differs: run `cargo xtask fixtures`", name.display());
        assert!(new.len() < 1 << 17, "{} is too large to be stored", name.display());
    }
}

#[test]
fn a_folder_that_cannot_be_written_is_an_error() {
    let file = tempfile::NamedTempFile::new().unwrap();
    assert!(fixtures::write_all(&file.path().join("below")).is_err());
}

#[test]
fn the_atrium_grows_with_its_detail() {
    let count = |detail: f64| {
        let scene = Atrium { detail }.build();
        scene.validate().unwrap();
        scene.mesh.triangles.len()
    };
    let default = fixtures::build("atrium").unwrap().mesh.triangles.len();
    assert_eq!(default, count(1.0));
    assert!(default >= 100_000, "{default}");
    assert!(count(0.5) < default / 2 && count(2.0) > 3 * default);
    assert_eq!(count(0.0), count(0.25));
}

/// Shading normals of the atrium's curved surfaces lie within 90° of their facets': nothing is inside out.
#[test]
fn the_atrium_is_wound_consistently() {
    let scene = fixtures::build("atrium").unwrap();
    let mesh = &scene.mesh;
    for t in 0..mesh.triangles.len() as u32 {
        let n = mesh.geometric_normal(t);
        let mean: Vec3 = mesh.triangles[t as usize].iter().map(|&v| mesh.normals[v as usize]).sum();
        assert!(n.dot(mean) > 0.0, "triangle {t} at {:?}", mesh.corners(t));
    }
}

/// The nearest triangle along a ray, by brute force in f64.
fn hit(scene: &Scene, origin: Vec3, direction: Vec3) -> Option<u32> {
    let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
    let mut best = (f64::INFINITY, None);
    for t in 0..scene.mesh.triangles.len() as u32 {
        let [a, b, c] = scene.mesh.corners(t).map(|p| p.as_dvec3() - o);
        // Scalar triple products: the ray passes on the same side of all three edges.
        let (u, v, w) = (d.dot(b.cross(c)), d.dot(c.cross(a)), d.dot(a.cross(b)));
        let det = u + v + w;
        if (u >= 0.0 && v >= 0.0 && w >= 0.0 || u <= 0.0 && v <= 0.0 && w <= 0.0) && det != 0.0 {
            let distance = a.dot(b.cross(c)) / det;
            if distance > 0.0 && distance < best.0 {
                best = (distance, Some(t));
            }
        }
    }
    best.1
}

/// Materials that a spot light's cone meets, over a polar grid of directions out to its edge.
fn lit_materials(scene: &Scene) -> Vec<&str> {
    let LightKind::Spot { position, direction, outer_angle, .. } = scene.lights[0].kind else {
        panic!("no spot")
    };
    let (s, t) = indirect_core::math::orthonormal_basis(direction);
    let mut names: Vec<&str> = (0..40 * 64)
        .map(|i| {
            let (ring, turn) = ((i / 64 + 1) as f32 / 40.0, (i % 64) as f32 / 64.0 * core::f32::consts::TAU);
            let r = Vec2::from_angle(turn) * (ring * outer_angle).tan();
            let t = hit(scene, position, direction + s * r.x + t * r.y).expect("the light leaves the scene");
            scene.materials[scene.mesh.materials[t as usize] as usize].name.as_str()
        })
        .collect();
    names.sort_unstable();
    names.dedup();
    names
}

#[test]
fn the_wall_spot_meets_the_red_wall_alone() {
    assert_eq!(lit_materials(&fixtures::build("cornell_wall_spot").unwrap()), ["red"]);
}

#[test]
fn spots_over_planes_stay_on_them() {
    assert_eq!(lit_materials(&fixtures::build("plane_spot").unwrap()), ["floor"]);
    assert_eq!(lit_materials(&fixtures::build("plane_wall").unwrap()), ["floor"]);
}

#[test]
fn the_lamp_of_the_two_rooms_stays_in_its_room() {
    // The doorway is on the light's side of the wall's far face: what crosses it lands on the floor behind it.
    let scene = fixtures::build("two_rooms").unwrap();
    assert!(!lit_materials(&scene).contains(&"blue"));
}

#[test]
fn closed_rooms_are_closed() {
    let rays = |scene: &Scene, from: Vec3| {
        for i in 0..2000 {
            // A Fibonacci sphere, turned off the axes.
            let z = 1.0 - (2.0 * i as f32 + 1.0) / 2000.0;
            let r = Vec2::from_angle(i as f32 * 2.399_963) * (1.0 - z * z).sqrt();
            let d = Vec3::new(r.x, z, r.y);
            assert!(hit(scene, from, d).is_some(), "{d} leaves {}", scene.name);
        }
    };
    rays(&fixtures::build("sphere_furnace").unwrap(), Vec3::new(0.1, 0.2, 0.3));
    for from in [Vec3::new(-1.5, 1.0, 0.3), Vec3::new(1.7, 1.3, -0.4)] {
        rays(&fixtures::build("two_rooms").unwrap(), from);
    }
}

#[test]
fn the_box_is_the_published_one() {
    let scene = fixtures::build("cornell_area").unwrap();
    let extent = scene.bounds().unwrap().extent();
    assert!((extent - Vec3::new(0.556, 0.5488, 0.5592)).length() < 1e-6, "{extent}");
    let area: f32 = (0..scene.mesh.triangles.len() as u32)
        .filter(|&t| scene.materials[scene.mesh.materials[t as usize] as usize].is_emissive())
        .inspect(|&t| assert_eq!(scene.mesh.geometric_normal(t), Vec3::NEG_Y))
        .map(|t| scene.mesh.area(t))
        .sum();
    assert!((area - 0.130 * 0.105).abs() < 1e-7);
}
