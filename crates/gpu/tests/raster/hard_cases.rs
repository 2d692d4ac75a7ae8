//! Odd sizes, empty views, extreme scales, degenerate triangles, several views, and what must be refused.

use crate::common::{assert_twins, perspective, render, smooth_sphere, textured_and_masked};
use glam::{Vec2, Vec3};
use indirect_core::{Material, NO_TRIANGLE, Projection, Scene, View};
use indirect_gpu::{GBufferTarget, GpuError, PassTimer, Raster, SceneBuffers};
use indirect_scene::fixtures;

fn triangle(corners: [Vec3; 3]) -> Scene {
    let mut scene = Scene { name: "triangle".into(), ..Scene::default() };
    scene.materials.push(Material::diffuse("m", Vec3::splat(0.5)));
    scene.mesh.push_polygon(&corners, 0);
    scene
}

#[test]
fn nothing_to_see() {
    let Some(gpu) = testkit::gpu() else { return };
    let size = [17, 5];
    let away = perspective(Vec3::Z * 3.0, Vec3::Z * 9.0, 0.5, size);
    for scene in [smooth_sphere(8, false), Scene::default()] {
        let g = render(gpu, &scene, &away, size);
        assert_eq!(g, indirect_core::GBuffer::new(size));
    }
}

#[test]
fn one_texel() {
    let Some(gpu) = testkit::gpu() else { return };
    let size = [1, 1];
    let view = perspective(Vec3::new(0.3, 0.4, 3.0), Vec3::ZERO, 0.5, size);
    let twins = assert_twins(gpu, &smooth_sphere(8, true), &view, size);
    assert!(twins.gpu.is_surface(0) && twins.mismatched == 0);
}

#[test]
fn scale_does_not_matter() {
    let Some(gpu) = testkit::gpu() else { return };
    let size = [96, 64];
    for scale in [1e-3_f32, 1.0, 1e3] {
        let mut scene = smooth_sphere(16, false);
        scene.mesh.positions.iter_mut().for_each(|p| *p *= scale);
        let mut view = perspective(Vec3::new(1.0, 0.8, 2.0) * scale, Vec3::ZERO, 0.6, size);
        view.near *= scale;
        let twins = assert_twins(gpu, &scene, &view, size);
        assert!((0..twins.gpu.len()).any(|i| twins.gpu.is_surface(i)));
    }
}

#[test]
fn far_from_the_origin() {
    let Some(gpu) = testkit::gpu() else { return };
    let size = [96, 64];
    // A power of two: the sphere's corners lose digits, the camera does not.
    let offset = Vec3::new(131_072.0, -65_536.0, 65_536.0);
    let mut scene = smooth_sphere(16, false);
    scene.mesh.positions.iter_mut().for_each(|p| *p += offset);
    let mut view = perspective(Vec3::new(1.0, 0.75, 2.0) + offset, offset, 0.6, size);
    // The CPU's rays start at the near plane, where their origin would be rounded to 2⁻⁷ m: here that is the eye itself.
    view.near = 1e-6;
    let twins = assert_twins(gpu, &scene, &view, size);
    // Depth is relative to the camera and keeps what the corners' own rounding, 2⁻⁷ m, leaves of it.
    for i in (0..twins.gpu.len()).filter(|i| twins.gpu.is_surface(*i)) {
        let p = twins.gpu.position[i] - offset;
        assert!((p.length() - 1.0).abs() < 0.05 && twins.gpu.depth[i] > 1.0, "{p}");
    }
}

#[test]
fn cameras_inside_geometry_are_clipped_at_the_near_plane() {
    let Some(gpu) = testkit::gpu() else { return };
    let size = [127, 61];
    let mut view = perspective(Vec3::new(0.2, 0.1, 0.3), Vec3::new(0.0, 0.3, -1.0), 0.9, size);
    let scene = smooth_sphere(16, false);
    let inside = assert_twins(gpu, &scene, &view, size);
    // Every ray meets the sphere from the inside, and the normal is turned to it.
    for i in 0..inside.gpu.len() {
        assert!(inside.gpu.is_surface(i) && inside.gpu.normal[i].dot(inside.gpu.position[i]) < 0.0);
    }
    // The near plane cuts the sphere: through the hole nothing is left to see of its near side.
    view.near = 1.05;
    let cut = assert_twins(gpu, &scene, &view, size);
    let seen = (0..cut.gpu.len()).filter(|i| cut.gpu.is_surface(*i)).count();
    assert!(seen > 0 && seen < cut.gpu.len());
    // The far plane is the end as well.
    (view.near, view.far) = (0.01, 1.05);
    let ended = assert_twins(gpu, &scene, &view, size);
    assert!(ended.gpu.depth.iter().all(|d| *d < 1.05));
    assert_eq!(seen, (0..ended.gpu.len()).filter(|i| !ended.gpu.is_surface(*i)).count());
}

#[test]
fn orthographic_views() {
    let Some(gpu) = testkit::gpu() else { return };
    let size = [127, 61];
    let projection = Projection::Orthographic { half_size: Vec2::new(2.1, 1.05) };
    let view =
        View::look_to(Vec3::new(2.0, 3.0, 1.0), Vec3::new(-2.0, -3.0, -1.0), Vec3::Y, projection, 0.5, 9.0);
    for scene in [smooth_sphere(16, true), textured_and_masked()] {
        let twins = assert_twins(gpu, &scene, &view, size);
        assert!((0..twins.gpu.len()).any(|i| twins.gpu.is_surface(i)));
    }
}

#[test]
fn degenerate_and_edge_on_triangles_stay_finite() {
    let Some(gpu) = testkit::gpu() else { return };
    let size = [64, 64];
    let view = perspective(Vec3::new(0.0, 0.0, 2.0), Vec3::ZERO, 1.0, size);
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    for corners in [
        [Vec3::ZERO; 3],
        [-x, Vec3::ZERO, x],
        [-x, x, x],
        // In a plane through the eye, and turned out of it by less and less.
        [-z, z, x],
        [-z, z + y * 1e-3, x],
        [-z, z + y * 1e-6, x],
        // Slivers of a fraction of a texel.
        [-x, x, x + y * 1e-4],
        [-x, x + y * 1e-7, y * 1e-7],
        // Huge, across the eye.
        [-x * 1e6 - y, x * 1e6 - y, z * 1e6 - y],
    ] {
        let g = render(gpu, &triangle(corners), &view, size);
        let near = corners.iter().fold(0.0_f32, |m, c| m.max(c.length()));
        for i in 0..g.len() {
            let seen = g.is_surface(i);
            assert!(g.position[i].is_finite() && g.normal[i].is_finite() && g.depth[i].is_finite());
            // On the triangle, up to rounding.
            assert!(!seen || g.position[i].length() <= near * 1.000_01 && g.triangle[i] == 0, "{corners:?}");
        }
    }
}

#[test]
fn views_of_one_submission_do_not_mix() -> Result<(), GpuError> {
    let Some(gpu) = testkit::gpu() else { return Ok(()) };
    let scene = fixtures::build("cornell_spot").unwrap();
    let size = [32, 32];
    let centre = scene.bounds().unwrap().centre() + Vec3::new(0.02, 0.015, 0.01);
    let projection = Projection::Perspective { tan_half: Vec2::ONE };
    let faces = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z].map(|forward| {
        View::look_to(centre, forward, Vec3::new(0.1, 1.0, 0.2), projection, 0.01, f32::INFINITY)
    });
    let buffers = SceneBuffers::upload(&gpu.device, &scene)?;
    let target = |view: &View| {
        let target = GBufferTarget::new(&gpu.device, size)?;
        target.prepare(&gpu.queue, view);
        Ok::<_, GpuError>(target)
    };
    let targets = faces.iter().map(target).collect::<Result<Vec<_>, _>>()?;
    let raster = Raster::new(&gpu.device);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    raster.encode(&mut encoder, &mut PassTimer::off(), "maps", &buffers, &targets);
    gpu.queue.submit([encoder.finish()]);
    for (view, target) in faces.iter().zip(&targets) {
        // The same bits as alone, which also shows that a run repeats.
        assert_eq!(target.read(&gpu.device, &gpu.queue)?, render(gpu, &scene, view, size));
    }
    Ok(())
}

#[test]
fn sizes_and_scenes_that_do_not_fit_are_refused() {
    let Some(gpu) = testkit::gpu() else { return };
    let limit = gpu.device.limits().max_texture_dimension_2d;
    assert!(matches!(GBufferTarget::new(&gpu.device, [0, 4]), Err(GpuError::EmptySize { .. })));
    let e = GBufferTarget::new(&gpu.device, [limit + 1, 1]).unwrap_err();
    assert!(e.to_string().contains("max_texture_dimension_2d"), "{e}");
    let e = GBufferTarget::new(&gpu.device, [limit, limit]).unwrap_err();
    assert!(e.to_string().contains("max_storage_buffer_binding_size"), "{e}");
    let mut scene = triangle([Vec3::ZERO, Vec3::X, Vec3::Y]);
    scene.mesh.triangles[0][2] = 3;
    let e = SceneBuffers::upload(&gpu.device, &scene).unwrap_err();
    assert!(e.to_string().contains("triangle 0 names vertex 3"), "{e}");
}

#[test]
fn scenes_upload_only_what_they_need() {
    let Some(gpu) = testkit::gpu() else { return };
    let bytes = |scene: &Scene| SceneBuffers::upload(&gpu.device, scene).unwrap().bytes();
    let (plain, colored) = (smooth_sphere(8, false), smooth_sphere(8, true));
    assert_eq!(bytes(&colored) - bytes(&plain), 16 * plain.mesh.positions.len() as u64);
    let textured = textured_and_masked();
    assert!(SceneBuffers::upload(&gpu.device, &textured).unwrap().is_masked());
    assert!(!SceneBuffers::upload(&gpu.device, &plain).unwrap().is_masked());
    // All three textures are used; without metal the third is not.
    let mut dielectric = textured.clone();
    dielectric.materials.iter_mut().for_each(|m| m.metallic = 0.0);
    assert_eq!(bytes(&textured) - bytes(&dielectric), 8 * 8 * 4);
    assert_eq!(SceneBuffers::largest_binding(&plain), 32 * plain.mesh.positions.len() as u64);
    assert!(SceneBuffers::largest_binding(&textured) >= 3 * 8 * 8 * 4);
    assert_eq!(NO_TRIANGLE, u32::MAX);
}

#[test]
fn timers_name_the_passes_and_change_nothing() -> Result<(), GpuError> {
    let Some(gpu) = testkit::gpu() else { return Ok(()) };
    let (scene, size) = (smooth_sphere(16, false), [64, 64]);
    let view = perspective(Vec3::new(1.0, 0.8, 2.0), Vec3::ZERO, 0.6, size);
    let untimed = render(gpu, &scene, &view, size);
    let buffers = SceneBuffers::upload(&gpu.device, &scene)?;
    let raster = Raster::new(&gpu.device);
    let timers =
        [PassTimer::new(&gpu.device, &gpu.queue), PassTimer::wall(&gpu.device, &gpu.queue), PassTimer::off()];
    for mut timer in timers {
        for _ in 0..2 {
            let target = GBufferTarget::new(&gpu.device, size)?;
            target.prepare(&gpu.queue, &view);
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            raster.encode(&mut encoder, &mut timer, "camera", &buffers, [&target]);
            gpu.queue.submit([encoder.finish()]);
            let times = timer.finish()?;
            let names: Vec<_> = times.iter().map(|t| t.name).collect();
            let expected: &[&str] = if timer.clock() == "off" { &[] } else { &["camera"] };
            assert_eq!(names, expected);
            assert!(times.iter().all(|t| t.ms.is_finite() && t.ms >= 0.0));
            assert_eq!(target.read(&gpu.device, &gpu.queue)?, untimed);
        }
    }
    Ok(())
}
