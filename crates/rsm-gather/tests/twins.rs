//! Every pass on the GPU against its twin on the CPU, and the GPU's whole chain against closed forms.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

#[path = "../../rsm/tests/common/mod.rs"]
mod common;

use common::{floor_and_wall, light, push_box, push_square, scene, spot};
use glam::{Mat3, Vec2, Vec3};
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::{GBuffer, LightKind, Projection, Scene, View};
use indirect_gpu::wgpu::CommandEncoderDescriptor;
use indirect_gpu::{Context, GBufferTarget, PassTimer, Pipelines, SceneBuffers, Vec3Pad};
use indirect_technique::gpu::{Backend, Inputs, Twin, run_both};
use rsm::{Form, Select, Selection, layout::Texel, views::views};
use rsm_gather::gpu::Resources;
use rsm_gather::{Options, Output, Params, Setup, cpu};
use testkit::{judge, perturb};

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
    cpu: Output,
    /// The image of the whole GPU chain, and its texels per map.
    image: Vec<Vec3Pad>,
    texels: Vec<Vec<Texel>>,
    /// The image with the pass `gather` on the CPU and all others on the GPU.
    mixed: Output,
}

/// Options of a selection.
fn options(resolution: u32, selection: Selection) -> Options {
    let o = Options { resolution, ..Options::default() };
    match selection {
        Selection::All => Options { select: Select::All, ..o },
        Selection::Grid { cells } => Options { select: Select::Grid, cells, ..o },
        Selection::Importance { count } => Options { vpls: count, ..o },
    }
}

fn frame(context: &Context, scene: &Scene, options: Options, params: Params) -> Frame {
    let (device, queue) = (&context.device, &context.queue);
    let setup = Setup { options, params };
    let accel = Accel::build(scene, BuildPreset::Fast);
    let view = camera_view();
    let camera = cast::gbuffer(&accel, &view, CAMERA);
    let frame = cpu::Frame::new(&accel, &view, &camera, &setup);

    let buffers = SceneBuffers::upload(device, scene).unwrap();
    let pipelines = Pipelines::new(device);
    let target = GBufferTarget::new(device, CAMERA).unwrap();
    let views = views(scene);
    let mut resources = Resources::new(&pipelines, queue, &setup, views.len(), &target).unwrap();
    let inputs = Inputs { lights: &scene.lights, views: &views, camera: &view };
    resources.prepare(queue, &inputs, &setup).unwrap();
    target.prepare(queue, &view);
    let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
    let timer = &mut PassTimer::off();
    pipelines.raster().encode(&mut encoder, timer, "camera", &buffers, [&target]);
    resources.encode(&mut encoder, timer, &buffers);
    queue.submit([encoder.finish()]);
    let image = context.read(resources.image()).unwrap();
    let maps = &resources.buffers.rsm.maps;
    let texels = maps.iter().map(|m| context.read(&m.buffers.texels).unwrap()).collect();
    let run = |keep: &dyn Fn(&str) -> Backend| run_both((device, queue), &frame, &resources, &buffers, keep);
    let (output, twins) = run(&|_| Backend::Cpu).unwrap();
    let (mixed, _) = run(&|pass| if pass == "gather" { Backend::Cpu } else { Backend::Gpu }).unwrap();
    assert_eq!(output, cpu::indirect(&frame).unwrap());
    Frame { twins, cpu: output, image, texels, mixed }
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
            let scene = floor_and_wall(kind, 1.0);
            judge(
                &frame(context, &scene, options(45, selection), Params { form: Form::Disc, seed: 7 }).twins,
            );
        }
    }
    let options = options(128, Selection::Importance { count: 64 });
    let scene = floor_and_wall(lights()[0], 1.0);
    judge(&frame(context, &scene, options, Params { form: Form::Point, seed: 0 }).twins);
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
    let options = options(33, Selection::Importance { count: 300 });
    let frame = frame(context, &scene, options, Params::default());
    judge(&frame.twins);
    // Two spots, one directional, and the faces of one point light that see the scene's bounds.
    assert!((6..=9).contains(&frame.texels.len()), "{}", frame.texels.len());
}

#[test]
fn a_perturbed_buffer_is_found() {
    let Some(context) = testkit::gpu() else { return };
    let options = options(16, Selection::Grid { cells: 4 });
    let mut frame = frame(context, &floor_and_wall(lights()[0], 1.0), options, Params::default());
    judge(&frame.twins);
    for i in 0..frame.twins.len() {
        let good = frame.twins[i].gpu.clone();
        perturb(&mut frame.twins[i]);
        let found = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| judge(&frame.twins)));
        assert!(found.is_err(), "{} {}", frame.twins[i].pass, frame.twins[i].buffer);
        frame.twins[i].gpu = good;
    }
}

/// Sum of the reflected flux of the whole GPU chain per unit of power and albedo.
fn gpu_flux(context: &Context, scene: &Scene, resolution: u32) -> f64 {
    let options = options(resolution, Selection::Importance { count: 16 });
    let frame = frame(context, scene, options, Params::default());
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
    let options = options(64, Selection::All);
    let frame = frame(context, &floor_and_wall(lights()[0], 1.0), options, Params::default());
    let mean: Vec3 = frame.image.iter().map(|v| v.vec3()).sum::<Vec3>() / frame.image.len() as f32;
    let expected = frame.cpu.image.mean();
    // The map's silhouettes, one texel in a thousand or fewer, may carry their flux elsewhere.
    assert!((mean - expected).abs().max_element() < 2e-3 * expected.max_element(), "{mean} {expected}");
    let mixed = frame.mixed.image.mean();
    assert!((mixed - mean).abs().max_element() < 1e-4 * expected.max_element(), "{mixed} {mean}");
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
            let frame = frame(context, &scene, options(8, selection), Params::default());
            assert!(frame.image.iter().all(|v| *v == Vec3Pad::default()));
            assert!(frame.cpu.vpls.is_empty());
        }
    }
    // Nothing for the camera either.
    assert_eq!(GBuffer::new(CAMERA).len(), (CAMERA[0] * CAMERA[1]) as usize);
}
