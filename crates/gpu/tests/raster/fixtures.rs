//! Whole scenes: rasterised on the GPU, ray-cast on the CPU.

use crate::common::{assert_twins, perspective, smooth_sphere, textured_and_masked};
use glam::Vec3;
use indirect_scene::fixtures;

/// The fixture through its own camera, which is moved by a little: seen straight on, edges run through rows of texel
/// centres, and neither side is right there.
fn fixture(name: &str, size: [u32; 2]) {
    let Some(gpu) = testkit::gpu() else { return };
    let scene = fixtures::build(name).unwrap();
    let mut view = scene.cameras[0].view(size);
    view.origin += scene.bounds().unwrap().diagonal() * Vec3::new(0.003, 0.002, 0.0);
    let twins = assert_twins(gpu, &scene, &view, size);
    assert!((0..twins.gpu.len()).any(|i| twins.gpu.is_surface(i)));
}

#[test]
fn cornell_box() {
    fixture("cornell_spot", [256, 256]);
    fixture("cornell_spot", [127, 61]);
}

#[test]
fn plane_and_wall() {
    fixture("plane_wall", [200, 150]);
}

#[test]
fn two_rooms() {
    fixture("two_rooms", [160, 120]);
}

#[test]
fn furnace_from_the_inside() {
    fixture("sphere_furnace", [127, 61]);
}

#[test]
fn smooth_normals_and_vertex_colours() {
    let Some(gpu) = testkit::gpu() else { return };
    let size = [311, 207];
    let view = perspective(Vec3::new(1.2, 0.8, 2.1), Vec3::new(0.0, 0.1, 0.0), 0.6, size);
    let twins = assert_twins(gpu, &smooth_sphere(24, true), &view, size);
    // Colours were made from normals: both were interpolated, not taken from a corner.
    for i in (0..twins.gpu.len()).filter(|i| twins.gpu.is_surface(*i)) {
        let from_normal = (twins.gpu.normal[i] * 0.5 + 0.5) * Vec3::new(0.8, 0.6, 0.4);
        assert!((twins.gpu.albedo[i] - from_normal).length() < 0.02);
    }
}

#[test]
fn textures_metal_and_holes() {
    let Some(gpu) = testkit::gpu() else { return };
    let (scene, size) = (textured_and_masked(), [311, 207]);
    let view = perspective(Vec3::new(0.6, 0.4, 2.1), Vec3::new(0.0, 0.1, 0.0), 0.6, size);
    let twins = assert_twins(gpu, &scene, &view, size);
    // Both walls are seen where the front one is, through its holes.
    let of_material = |m: u32| {
        twins.gpu.triangle.iter().filter(|t| scene.mesh.materials.get(**t as usize) == Some(&m)).count()
    };
    assert!(of_material(0) > 1000 && of_material(1) > 1000);
    let mut solid = scene.clone();
    solid.materials[0].alpha_mode = indirect_core::AlphaMode::Opaque;
    let solid = assert_twins(gpu, &solid, &view, size);
    let hidden = (0..solid.gpu.len()).filter(|i| solid.gpu.triangle[*i] != twins.gpu.triangle[*i]).count();
    assert!(hidden > 1000, "{hidden} texels see through holes");
}
