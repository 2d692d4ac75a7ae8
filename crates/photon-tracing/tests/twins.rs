//! Both passes on the GPU against their twins on the CPU.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

mod common;

use common::{light, mixed, room, textured};
use glam::Vec3;
use indirect_accel::gpu::AccelBuffers;
use indirect_accel::{Accel, BuildPreset, FlatTree};
use indirect_core::{AlphaMode, LightKind, Scene};
use indirect_gpu::wgpu::CommandEncoderDescriptor;
use indirect_gpu::{Context, GpuError, Pass, PassTimer, Pipelines, SceneBuffers, read_buffer};
use photon_tracing::gpu::{PhotonSizes, Photons};
use photon_tracing::{Params, Photon, Sources, cpu};

const N: u32 = 8192;
const FLIGHTS: usize = 4;

/// The photons after `emit` and after each `trace`.
fn run(context: &Context, accel: &Accel<'_>, sources: &Sources, params: &Params) -> Vec<Vec<Photon>> {
    let (device, queue) = (&context.device, &context.queue);
    let pipelines = Pipelines::new(device);
    let scene = SceneBuffers::upload(device, accel.scene()).unwrap();
    let tree = AccelBuffers::upload(device, queue, &FlatTree::of(accel)).unwrap();
    let photons = Photons::new(device, PhotonSizes::new(sources, params.photons, 0)).unwrap();
    photons.write_emitters(queue, sources).unwrap();
    photons.write_lights(queue, sources, params.seed).unwrap();
    let mut passes = vec![Pass::new("emit")];
    photons.emit(&pipelines, &mut passes[0]).unwrap();
    for _ in 0..FLIGHTS {
        let mut pass = Pass::new("trace");
        photons.trace(&pipelines, &mut pass, &tree.named()).unwrap();
        passes.push(pass);
    }
    let after = |pass: &Pass| {
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        pass.encode(&mut encoder, &mut PassTimer::off(), Some(&scene));
        queue.submit([encoder.finish()]);
        let mut found: Vec<Photon> = read_buffer(device, queue, &photons.buffers.photons).unwrap();
        found.truncate(params.photons as usize);
        found
    };
    passes.iter().map(after).collect()
}

/// Photons that came from another source, hit another triangle or ended otherwise, and the largest difference of the others: of the place in
/// scene diagonals, of directions and normals, and of the flux in units of the largest.
fn compare(cpu: &[Photon], gpu: &[Photon], unit: f32) -> (usize, [f32; 3]) {
    assert_eq!(cpu.len(), gpu.len());
    let largest = cpu.iter().map(|p| p.flux.max_element()).fold(f32::MIN_POSITIVE, f32::max);
    let (mut apart, mut worst) = (0, [0.0_f32; 3]);
    for (a, b) in cpu.iter().zip(gpu) {
        assert!(
            b.position.is_finite() && b.direction.is_finite() && b.flux.is_finite() && b.normal.is_finite()
        );
        let place = (a.position - b.position).length() / unit.max(f32::MIN_POSITIVE);
        let normal = (a.normal - b.normal).length();
        let same = (a.state, a.reflections) == (b.state, b.reflections) && place < 1e-3 && normal < 1e-3;
        if !same {
            apart += 1;
            continue;
        }
        let direction = (a.direction - b.direction).length();
        let flux = (a.flux - b.flux).abs().max_element() / largest;
        let window = (a.inverse_range - b.inverse_range).abs();
        worst = [worst[0].max(place), worst[1].max(direction.max(normal)), worst[2].max(flux.max(window))];
    }
    (apart, worst)
}

/// Differences beyond rounding, if any. A place on a triangle inherits what its barycentrics round, some 10⁻⁷ of the scene, more at edge-on
/// hits; a texture of some hundred texels across multiplies that.
fn fault(cpu: &[Photon], gpu: &[Photon], unit: f32) -> Option<String> {
    let (apart, worst) = compare(cpu, gpu, unit);
    // One in a thousand may fall to the other side of an edge, of a share of the flux, or of a number that decides.
    let fine = apart * 1000 <= cpu.len() && worst[0] < 1e-5 && worst[1] < 1e-5 && worst[2] < 1e-4;
    (!fine).then(|| format!("{apart} of {} apart, {worst:?}", cpu.len()))
}

/// Each pass begins with what the GPU's began with, so that each is compared alone.
fn twins(context: &Context, scene: &Scene, params: &Params) -> Vec<[Vec<Photon>; 2]> {
    let accel = Accel::build(scene, BuildPreset::Fast);
    let sources = Sources::new(scene);
    let gpu = run(context, &accel, &sources, params);
    let mut all = vec![[cpu::emit(&sources, params), gpu[0].clone()]];
    for pair in gpu.windows(2) {
        let mut photons = pair[0].clone();
        cpu::trace(&accel, params.seed, &mut photons);
        all.push([photons, pair[1].clone()]);
    }
    all
}

fn scenes() -> Vec<(&'static str, Scene)> {
    let mut all: Vec<_> = ["cornell_spot", "cornell_area", "plane_directional", "two_rooms", "atrium"]
        .map(|name| (name, indirect_scene::fixtures::build(name).unwrap()))
        .into();
    let mut windowed = mixed(1.0, Vec3::ZERO);
    windowed.lights[0].range = Some(4.0);
    windowed.lights[1].range = Some(2.0);
    all.push(("all kinds of lights", windowed));
    all.push(("textures and a mask", textured()));
    all.push(("a small room", room(Vec3::new(0.9, 0.4, 0.1), 1e-3, Vec3::ZERO)));
    all
}

#[test]
fn passes_of_both_backends_agree() {
    let Some(context) = testkit::gpu() else { return };
    for (name, scene) in scenes() {
        // No multiple of a workgroup.
        let params = Params { photons: N - 5, seed: 11 };
        let unit = Accel::build(&scene, BuildPreset::Fast).unit();
        for (pass, [cpu, gpu]) in twins(context, &scene, &params).iter().enumerate() {
            let alive = gpu.iter().filter(|p| p.is_alive()).count();
            let (apart, worst) = compare(cpu, gpu, unit);
            println!("{name} {pass}: {alive} alive, {apart} apart, {worst:?}");
            assert_eq!(fault(cpu, gpu, unit), None, "{name} {pass}");
            assert!(alive > 0 || pass > 1, "{name} {pass}");
        }
    }
}

#[test]
fn other_numbers_and_other_albedos_are_noticed() {
    let Some(context) = testkit::gpu() else { return };
    let scene = indirect_scene::fixtures::build("cornell_spot").unwrap();
    let params = Params { photons: N, seed: 1 };
    let passes = twins(context, &scene, &params);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let sources = Sources::new(&scene);
    let emitted = cpu::emit(&sources, &Params { seed: 2, ..params });
    assert!(fault(&emitted, &passes[0][1], accel.unit()).is_some());
    let traced = |scene: &Scene, seed| {
        let accel = Accel::build(scene, BuildPreset::Fast);
        let mut photons = passes[0][1].clone();
        cpu::trace(&accel, seed, &mut photons);
        fault(&photons, &passes[1][1], accel.unit())
    };
    assert_eq!(traced(&scene, 1), None);
    assert!(traced(&scene, 2).is_some());
    let mut brighter = scene.clone();
    brighter.materials.iter_mut().for_each(|m| m.base_color *= 1.01);
    assert!(traced(&brighter, 1).is_some());
    // A screen without its holes.
    let scene = textured();
    let passes = twins(context, &scene, &params);
    let mut solid = scene;
    solid.materials.iter_mut().for_each(|m| m.alpha_mode = AlphaMode::Opaque);
    let accel = Accel::build(&solid, BuildPreset::Fast);
    let mut photons = passes[0][1].clone();
    cpu::trace(&accel, 1, &mut photons);
    assert!(fault(&photons, &passes[1][1], accel.unit()).is_some());
}

#[test]
fn buffers_know_what_fits() {
    let Some(context) = testkit::gpu() else { return };
    let (device, queue) = (&context.device, &context.queue);
    let scene = mixed(1.0, Vec3::ZERO);
    let mut sources = Sources::new(&scene);
    let sizes = PhotonSizes::new(&sources, 100, scene.lights.len());
    assert_eq!(Photons::plan(&sizes).bytes(), 100 * 64 + 2 * 64 + 3 * 64 + 32);
    let photons = Photons::new(device, sizes).unwrap();
    photons.write_emitters(queue, &sources).unwrap();
    photons.write_lights(queue, &sources, 0).unwrap();
    let point = light(LightKind::Point { position: Vec3::Y }, Vec3::ONE);
    sources.set_lights(&vec![point; 4]);
    assert!(matches!(photons.write_lights(queue, &sources, 0), Err(GpuError::Limit { .. })));
    let nothing = PhotonSizes { photons: 0, emitters: 0, lights: 0 };
    let none = Photons::new(device, nothing).unwrap();
    assert!(matches!(none.write_emitters(queue, &sources), Err(GpuError::Limit { .. })));
    let many = PhotonSizes { photons: u32::MAX, ..nothing };
    assert!(matches!(Photons::new(device, many), Err(GpuError::Limit { .. })));
}

/// No light, no photon, no scene: zeroes, and no error.
#[test]
fn nothing_is_nothing_on_the_gpu() {
    let Some(context) = testkit::gpu() else { return };
    let mut dark = room(Vec3::splat(0.5), 1.0, Vec3::ZERO);
    dark.lights.clear();
    let lit = room(Vec3::splat(0.5), 1.0, Vec3::ZERO);
    for (scene, photons) in [(&dark, 100), (&lit, 0), (&Scene::default(), 100)] {
        for [cpu, gpu] in twins(context, scene, &Params { photons, seed: 0 }) {
            assert_eq!(cpu, gpu);
            assert!(gpu.iter().all(|p| *p == Photon::default()));
        }
    }
    // A light in the void: all escape.
    let void = Scene { lights: lit.lights, ..Scene::default() };
    let passes = twins(context, &void, &Params { photons: 100, seed: 0 });
    assert!(passes[1].iter().flatten().all(|p| p.state == Photon::ESCAPED));
}
