//! Every pass on the GPU against its twin on the CPU, and the GPU's whole chain against closed forms.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use common::{floor_and_wall, light, push_box, push_square, scene, spot};
use glam::{Mat3, Vec2, Vec3};
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::{GBuffer, LightKind, Projection, Scene, View};
use indirect_gpu::wgpu::CommandEncoderDescriptor;
use indirect_gpu::{Context, GBufferTarget, PassTimer, SceneBuffers, Vec3Pad};
use rsm::gpu::{Data, Resources, Twin, twins};
use rsm::{Form, Options, Params, Selection, cpu, gpu, layout::Texel, views::views};
use testkit::{CpuOutput, GpuOutput, Tolerance, compare, compare_exact};

const CAMERA: [u32; 2] = [67, 41];

fn camera_view() -> View {
    View::look_to(
        Vec3::new(0.5, 1.8, 3.5),
        Vec3::new(-0.1, -0.3, -1.0),
        Vec3::Y,
        Projection::Perspective { tan_half: Vec2::new(0.9, 0.55) },
        0.01,
        100.0,
    )
}

/// One frame on both backends.
struct Frame {
    twins: Vec<Twin>,
    cpu: cpu::Output,
    /// The image of the whole GPU chain, and its texels per map.
    image: Vec<Vec3Pad>,
    texels: Vec<Vec<Texel>>,
}

fn frame(context: &Context, scene: &Scene, options: &Options, params: &Params) -> Frame {
    let (device, queue) = (&context.device, &context.queue);
    let accel = Accel::build(scene, BuildPreset::Fast);
    let view = camera_view();
    let camera = cast::gbuffer(&accel, &view, CAMERA);
    let cpu = cpu::indirect(&accel, &camera, options, params).unwrap();

    let buffers = SceneBuffers::upload(device, scene).unwrap();
    let target = GBufferTarget::new(device, CAMERA, 1).unwrap();
    let rsm = gpu::Rsm::new(device, options).unwrap();
    let views = views(scene);
    let mut resources = Resources::new(device, &rsm, views.len(), &target).unwrap();
    resources.prepare(queue, &scene.lights, &views, params).unwrap();
    let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
    let timer = &mut PassTimer::off();
    indirect_gpu::Raster::new(device).encode(&mut encoder, timer, &buffers, &view, &target, 0).unwrap();
    rsm.encode(&mut encoder, timer, &buffers, &resources).unwrap();
    queue.submit([encoder.finish()]);
    let image = context.read(&resources.image).unwrap();
    let texels = resources.maps.iter().map(|m| context.read(&m.texels).unwrap()).collect();
    let twins = twins((device, queue), &rsm, &resources, &buffers, &camera, &target, &cpu).unwrap();
    Frame { twins, cpu, image, texels }
}

/// At most this share of a map's texels may show another triangle on the GPU than on the CPU: those that an edge crosses.
const SILHOUETTES: f64 = 0.02;

fn assert_twins(frame: &Frame) {
    for twin in &frame.twins {
        let name = format!("{} {} {:?}", twin.pass, twin.buffer, twin.map);
        let mask = (twin.pass == "surface").then(|| silhouettes(frame, twin.map.unwrap()));
        let result = match (&twin.cpu, &twin.gpu) {
            (Data::F32 { values: a, components }, Data::F32 { values: b, .. }) if !a.is_empty() => {
                // 1e-6 of the buffer's own magnitude where that is below 1: a texel's flux is far below 1 W.
                let largest = a.iter().filter(|v| **v < f32::MAX).fold(0.0_f32, |m, v| m.max(v.abs()));
                let tolerance = Tolerance { absolute: 1e-6 * largest.clamp(1e-30, 1.0), ..Tolerance::TWINS };
                match components {
                    1 => floats::<1>(&name, a, b, tolerance, mask.as_deref()),
                    2 => floats::<2>(&name, a, b, tolerance, mask.as_deref()),
                    3 => floats::<3>(&name, a, b, tolerance, mask.as_deref()),
                    4 => floats::<4>(&name, a, b, tolerance, mask.as_deref()),
                    6 => floats::<6>(&name, a, b, tolerance, mask.as_deref()),
                    n => panic!("{name} has {n} components"),
                }
            }
            (Data::U32(a), Data::U32(b)) => {
                compare_exact(&name, CpuOutput(a), GpuOutput(b), mask.as_deref()).map(|c| println!("{c}"))
            }
            (a, b) => {
                assert_eq!(a, b, "{name}");
                Ok(())
            }
        };
        result.unwrap_or_else(|e| panic!("{e}"));
    }
}

fn floats<const N: usize>(
    name: &str,
    a: &[f32],
    b: &[f32],
    tolerance: Tolerance,
    mask: Option<&[bool]>,
) -> Result<(), testkit::CompareError> {
    let (a, b): (&[[f32; N]], &[[f32; N]]) = (bytemuck::cast_slice(a), bytemuck::cast_slice(b));
    compare(name, CpuOutput(a), GpuOutput(b), tolerance, mask).map(|c| println!("{c}"))
}

/// `true` where both backends see the same triangle.
fn silhouettes(frame: &Frame, map: usize) -> Vec<bool> {
    let triangles = frame.twins.iter().find(|t| t.buffer == "triangle" && t.map == Some(map)).unwrap();
    let (Data::U32(a), Data::U32(b)) = (&triangles.cpu, &triangles.gpu) else {
        panic!("triangles are integers")
    };
    let same: Vec<bool> = a.iter().zip(b).map(|(a, b)| a == b).collect();
    let other = same.iter().filter(|s| !**s).count();
    println!("map {map}: {other} of {} texels are silhouettes", same.len());
    assert!(other as f64 <= SILHOUETTES * same.len() as f64 + 1.0, "{other} of {}", same.len());
    same
}

fn lights() -> [LightKind; 3] {
    [
        spot(Vec3::new(0.2, 3.0, 0.3), Vec3::new(0.1, -1.0, -0.3), 20.0, 35.0),
        LightKind::Point { position: Vec3::new(0.3, 1.5, 0.2) },
        LightKind::Directional { direction: Vec3::new(0.3, -1.0, -0.5).normalize() },
    ]
}

#[test]
fn every_pass_agrees_for_every_light_and_selection() {
    let Some(context) = testkit::gpu() else { return };
    for kind in lights() {
        for selection in [Selection::Importance { count: 1500 }, Selection::Grid { cells: 9 }, Selection::All]
        {
            // Neither a power of two nor a multiple of a workgroup.
            let options = Options { resolution: 45, selection };
            let scene = floor_and_wall(kind, 1.0);
            assert_twins(&frame(context, &scene, &options, &Params { form: Form::Disc, seed: 7 }));
        }
    }
    let options = Options { resolution: 128, selection: Selection::Importance { count: 64 } };
    let scene = floor_and_wall(lights()[0], 1.0);
    assert_twins(&frame(context, &scene, &options, &Params { form: Form::Point, seed: 0 }));
}

#[test]
fn several_lights_with_a_range_agree() {
    let Some(context) = testkit::gpu() else { return };
    let mut scene = floor_and_wall(lights()[0], 1.0);
    for kind in lights() {
        scene.lights.push(light(kind, Vec3::new(0.5, 1.0, 4.0)));
        scene.lights.last_mut().unwrap().range = Some(4.0);
    }
    // No power: no map.
    scene.lights.push(light(lights()[1], Vec3::ZERO));
    let options = Options { resolution: 33, selection: Selection::Importance { count: 300 } };
    let frame = frame(context, &scene, &options, &Params::default());
    assert_twins(&frame);
    // Two spots, one directional, and the faces of one point light that see the scene's bounds.
    assert!((6..=9).contains(&frame.texels.len()), "{}", frame.texels.len());
}

#[test]
fn a_perturbed_buffer_is_found() {
    let Some(context) = testkit::gpu() else { return };
    let options = Options { resolution: 16, selection: Selection::Grid { cells: 4 } };
    let mut frame = frame(context, &floor_and_wall(lights()[0], 1.0), &options, &Params::default());
    assert_twins(&frame);
    for i in 0..frame.twins.len() {
        let good = frame.twins[i].gpu.clone();
        match &mut frame.twins[i].gpu {
            // The largest value, so that the change is beyond the tolerance whatever the buffer holds.
            Data::F32 { values, .. } => {
                let largest = values.iter_mut().max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap();
                *largest = if *largest == 0.0 { 1.0 } else { *largest * 1.001 };
            }
            Data::U32(values) => *values.last_mut().unwrap() ^= 1,
        }
        let changed = frame.twins[i].clone();
        // A single other triangle is a silhouette, which the mask forgives: its turn comes with the count.
        if changed.buffer != "triangle" {
            let found = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| assert_twins(&frame)));
            assert!(found.is_err(), "{} {}", changed.pass, changed.buffer);
        }
        frame.twins[i].gpu = good;
    }
}

/// Sum of the reflected flux of the whole GPU chain per unit of power and albedo.
fn gpu_flux(context: &Context, scene: &Scene, resolution: u32) -> f64 {
    let options = Options { resolution, selection: Selection::Importance { count: 16 } };
    let frame = frame(context, scene, &options, &Params::default());
    let sum: f64 = frame.texels.iter().flatten().map(|t| f64::from(t.reflected.x)).sum();
    sum / f64::from(scene.lights[0].power.x * scene.materials[0].base_color.x)
}

#[test]
fn flux_is_conserved_to_a_thousandth_at_512() {
    use core::f64::consts::{PI, TAU};
    let Some(context) = testkit::gpu() else { return };
    let power = Vec3::new(3.0, 2.0, 1.0);
    let close = |found: f64, exact: f64| {
        println!("flux off by {:+.1e}", found / exact - 1.0);
        assert!((found / exact - 1.0).abs() < 1e-3, "{found} {exact}");
    };

    let tilt = Mat3::from_rotation_x(0.5);
    let mut s = scene(Vec3::splat(0.5));
    push_square(&mut s, Vec3::ZERO, 100.0, tilt);
    s.lights.push(light(spot(Vec3::Y, Vec3::NEG_Y, 20.0, 35.0), power));
    let (ci, co) = (20.0_f64.to_radians().cos(), 35.0_f64.to_radians().cos());
    close(gpu_flux(context, &s, 512), TAU * ((ci - co) / 3.0 + 1.0 - ci));

    let mut s = scene(Vec3::splat(0.5));
    push_square(&mut s, Vec3::ZERO, 2.0, tilt);
    s.lights.push(light(LightKind::Directional { direction: Vec3::NEG_Y }, power));
    close(gpu_flux(context, &s, 512), 16.0 * f64::from((tilt * Vec3::Y).y));

    let mut s = scene(Vec3::splat(0.5));
    push_box(&mut s, 1.0);
    s.lights.push(light(LightKind::Point { position: Vec3::new(0.3, -0.2, 0.4) }, power));
    close(gpu_flux(context, &s, 512), 4.0 * PI);
}

#[test]
fn the_whole_chain_gives_the_same_image() {
    let Some(context) = testkit::gpu() else { return };
    let options = Options { resolution: 64, selection: Selection::All };
    let frame = frame(context, &floor_and_wall(lights()[0], 1.0), &options, &Params::default());
    let mean: Vec3 = frame.image.iter().map(|v| v.vec3()).sum::<Vec3>() / frame.image.len() as f32;
    let expected = frame.cpu.image.mean();
    // The map's silhouettes, one texel in a thousand or fewer, may carry their flux elsewhere.
    assert!((mean - expected).abs().max_element() < 2e-3 * expected.max_element(), "{mean} {expected}");
}

#[test]
fn a_scene_without_light_or_surface_is_black() {
    let Some(context) = testkit::gpu() else { return };
    let mut dark = floor_and_wall(lights()[0], 1.0);
    dark.lights.clear();
    let mut unseen = floor_and_wall(lights()[0], 1.0);
    // A spot that looks away from everything still has a map when the bounds lie before it.
    unseen.lights[0].kind = spot(Vec3::new(0.0, 3.0, 0.0), Vec3::new(1.0, 0.05, 0.0), 1.0, 2.0);
    let mut black = floor_and_wall(lights()[0], 1.0);
    black.materials[0].base_color = Vec3::ZERO;
    for scene in [dark, unseen, black] {
        for selection in [Selection::Importance { count: 10 }, Selection::Grid { cells: 3 }, Selection::All] {
            let options = Options { resolution: 8, selection };
            let frame = frame(context, &scene, &options, &Params::default());
            assert!(frame.image.iter().all(|v| *v == Vec3Pad::default()));
            assert!(frame.cpu.vpls.is_empty());
        }
    }
    // Nothing for the camera either.
    assert_eq!(GBuffer::new(CAMERA).len(), (CAMERA[0] * CAMERA[1]) as usize);
}
