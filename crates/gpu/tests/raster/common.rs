//! Scenes, and the comparison of a rasterised with a ray-cast G-buffer.

use glam::{Affine2, Vec2, Vec3};
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::{AlphaMode, GBuffer, Material, Projection, Scene, Texture, TextureRef, View, Wrap};
use indirect_gpu::{Context, GBufferTarget, PassTimer, Raster, SceneBuffers};
use testkit::{CpuOutput, Element, GpuOutput, Tolerance, compare};

pub(crate) fn perspective(origin: Vec3, target: Vec3, half_height: f32, size: [u32; 2]) -> View {
    let tan_half = Vec2::new(half_height * size[0] as f32 / size[1] as f32, half_height);
    let projection = Projection::Perspective { tan_half };
    View::look_to(origin, target - origin, Vec3::new(0.1, 1.0, 0.05), projection, 0.01, f32::INFINITY)
}

pub(crate) fn render(gpu: &Context, scene: &Scene, view: &View, size: [u32; 2]) -> GBuffer {
    let buffers = SceneBuffers::upload(&gpu.device, scene).unwrap();
    let target = GBufferTarget::new(&gpu.device, size).unwrap();
    target.prepare(&gpu.queue, view);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    Raster::new(&gpu.device).encode(&mut encoder, &mut PassTimer::off(), "camera", &buffers, [&target]);
    gpu.queue.submit([encoder.finish()]);
    target.read(&gpu.device, &gpu.queue).unwrap()
}

/// What a comparison found, for tests that ask for more than that it passed.
#[derive(Debug)]
pub(crate) struct Twins {
    pub(crate) gpu: GBuffer,
    pub(crate) mismatched: usize,
}

/// Rasterises and ray-casts, and fails unless both see the same.
///
/// Triangle numbers may differ where the centre of a texel is closer to the image of an edge than a rasteriser's vertices are
/// exact: they are snapped to 1/256 texel, an error of up to √2/512. Of the texels beside an edge, whose centres are
/// spread evenly over one texel on either side, a share of √2/512 is that close; the count may exceed its mean by 5 standard
/// deviations and 2. Where numbers agree, all attributes must.
pub(crate) fn assert_twins(gpu: &Context, scene: &Scene, view: &View, size: [u32; 2]) -> Twins {
    let name = &scene.name;
    let accel = Accel::build(scene, BuildPreset::Fast);
    let cpu = cast::gbuffer(&accel, view, size);
    let found = render(gpu, scene, view, size);
    let same: Vec<bool> = cpu.triangle.iter().zip(&found.triangle).map(|(a, b)| a == b).collect();
    let mismatched = same.iter().filter(|same| !**same).count();
    let beside = edge_texels(&cpu).iter().filter(|edge| **edge).count();
    let mean = beside as f32 * core::f32::consts::SQRT_2 / 512.0;
    let bound = (mean + 5.0 * mean.sqrt() + 2.0) as usize;
    assert!(
        mismatched <= bound,
        "{name} {size:?}: {mismatched} ids differ, {beside} texels beside edges allow {bound}"
    );
    // An image of one texel may lose it to the bound.
    if mismatched < cpu.len() {
        for (what, cpu, gpu) in [
            ("position", &cpu.position, &found.position),
            ("normal", &cpu.normal, &found.normal),
            ("albedo", &cpu.albedo, &found.albedo),
        ] {
            assert_close(&format!("{name} {size:?}: {what}"), cpu, gpu, &same);
        }
        assert_close(&format!("{name} {size:?}: depth"), &cpu.depth, &found.depth, &same);
    }
    Twins { gpu: found, mismatched }
}

fn assert_close<T: Element>(what: &str, cpu: &[T], gpu: &[T], same: &[bool]) {
    if let Err(e) = compare(what, CpuOutput(cpu), GpuOutput(gpu), Tolerance::TWINS, Some(same)) {
        panic!("{e}");
    }
}

/// Texels that see another triangle than one of their eight neighbours does.
fn edge_texels(g: &GBuffer) -> Vec<bool> {
    let [w, h] = g.size.map(|s| s as i64);
    let at = |x: i64, y: i64| g.triangle[(y * w + x) as usize];
    (0..w * h)
        .map(|i| {
            let (x, y) = (i % w, i / w);
            let beside = |d: i64| (x + d % 3 - 1, y + d / 3 - 1);
            (0..9).map(beside).any(|(a, b)| a >= 0 && b >= 0 && a < w && b < h && at(a, b) != at(x, y))
        })
        .collect()
}

/// A sphere of radius 1 with smooth normals and, on request, vertex colours.
pub(crate) fn smooth_sphere(rings: u32, colored: bool) -> Scene {
    let mut scene = Scene { name: "smooth sphere".into(), ..Scene::default() };
    scene.materials.push(Material::diffuse("ball", Vec3::new(0.8, 0.6, 0.4)));
    let segments = 2 * rings;
    for ring in 0..=rings {
        for segment in 0..=segments {
            let theta = core::f32::consts::PI * ring as f32 / rings as f32;
            let phi = core::f32::consts::TAU * segment as f32 / segments as f32;
            let n = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            scene.mesh.positions.push(n);
            scene.mesh.normals.push(n);
            if colored {
                scene.mesh.colors.push(n * 0.5 + 0.5);
            }
        }
    }
    let vertex = |ring, segment| ring * (segments + 1) + segment;
    for ring in 0..rings {
        for segment in 0..segments {
            let quad = [
                vertex(ring, segment),
                vertex(ring, segment + 1),
                vertex(ring + 1, segment + 1),
                vertex(ring + 1, segment),
            ];
            // The poles' quads are triangles.
            if ring > 0 {
                scene.mesh.triangles.push([quad[0], quad[1], quad[2]]);
                scene.mesh.materials.push(0);
            }
            if ring + 1 < rings {
                scene.mesh.triangles.push([quad[0], quad[2], quad[3]]);
                scene.mesh.materials.push(0);
            }
        }
    }
    scene
}

/// A wall with holes before a wall of textured metal, with transformed texture coordinates and every wrap mode.
pub(crate) fn textured_and_masked() -> Scene {
    let mut scene = Scene { name: "textured and masked".into(), ..Scene::default() };
    let size = [8_u32, 4];
    let texel = |x: u32, y: u32| {
        let ramp = |v: u32, n: u32| (65535.0 * (0.2 + 0.6 * v as f32 / n as f32)) as u16;
        [ramp(x, 8), ramp(y, 4), ramp(x + y, 12), if (x + y).is_multiple_of(3) { 0 } else { 65535 }]
    };
    for wrap in [[Wrap::Repeat, Wrap::Mirror], [Wrap::Clamp, Wrap::Repeat], [Wrap::Mirror, Wrap::Clamp]] {
        let texels = (0..size[0] * size[1]).map(|i| texel(i % size[0], i / size[0])).collect();
        scene.textures.push(Texture { name: "t".into(), size, texels, wrap });
    }
    let slot = |texture, transform| Some(TextureRef { texture, uv_transform: transform });
    let turned = Affine2::from_scale_angle_translation(Vec2::new(1.7, 0.9), 0.4, Vec2::new(-0.3, 0.2));
    scene.materials = vec![
        Material {
            base_color_texture: slot(1, Affine2::IDENTITY),
            alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
            ..Material::diffuse("grid", Vec3::new(0.9, 0.8, 0.7))
        },
        Material {
            base_color_texture: slot(0, turned),
            metallic: 0.6,
            metallic_roughness_texture: slot(2, Affine2::IDENTITY),
            ..Material::diffuse("metal", Vec3::ONE)
        },
    ];
    for (z, half, uv, material) in [(0.0, 1.0, 2.0, 0), (-1.0, 1.6, 1.5, 1)] {
        let corner = |x: f32, y: f32| Vec3::new(x, y, z) * Vec3::new(half, half, 1.0);
        let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let vertices = scene.mesh.positions.len();
        scene.mesh.push_polygon(&corners, material);
        scene.mesh.uvs.truncate(vertices);
        let uvs = [Vec2::new(-0.5, 1.0), Vec2::new(1.0, 1.0), Vec2::new(1.0, -0.5), Vec2::new(-0.5, -0.5)];
        scene.mesh.uvs.extend(uvs.map(|p| p * uv));
    }
    scene
}
