//! Every pass on the GPU against its twin on the CPU.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use bytemuck::{Pod, Zeroable};
use common::{pairs, receivers, vpls};
use glam::Vec3;
use imperfect_shadow_maps::gpu::Atlas;
use imperfect_shadow_maps::{EMPTY, Options, Point, cpu, place};
use indirect_accel::{Accel, BuildPreset};
use indirect_gpu::wgpu::CommandEncoderDescriptor;
use indirect_gpu::{
    Context, Pass, PassTimer, Pipelines, empty_storage_buffer, named, read_buffer, storage_buffer,
};
use rsm::Vpl;
use rsm::gpu::VplList;
use testkit::layout::check;

indirect_core::wgsl_struct! {
    /// As `ism/visible.wgsl` has it.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    struct Pair = "IsmPair" {
        receiver: Vec3,
        vpl: u32,
        normal: Vec3,
        pad0: u32,
    }
}

fn run(context: &Context, pass: &Pass) {
    let mut encoder = context.device.create_command_encoder(&CommandEncoderDescriptor::default());
    pass.encode(&mut encoder, &mut PassTimer::off(), None);
    context.queue.submit([encoder.finish()]);
}

/// Texels beyond `tolerance`, and a share of them that may be: a splat that ends at the middle of a texel falls to either side of
/// it by rounding (10⁻⁶ of a side of 32 texels is 3·10⁻⁵ texels; four ends, some ten splats to a texel), and where a plane is seen
/// edge-on its depth has few digits.
fn differing(cpu: &[f32], gpu: &[f32], tolerance: f32) -> usize {
    assert_eq!(cpu.len(), gpu.len());
    assert!(gpu.iter().all(|u| u.is_finite() && *u >= 0.0));
    cpu.iter().zip(gpu).filter(|(a, b)| (*a - *b).abs() > tolerance * a.abs()).count()
}
const SHARE: usize = 200;

struct Both {
    cpu: [cpu::Atlas; 3],
    /// Maps and coarser levels after each pass.
    gpu: [[Vec<f32>; 2]; 3],
}

/// All three passes on both sides; `pull` and `push` of the GPU begin with its own results. There is room for three maps more
/// than there are VPLs.
fn both(context: &Context, lights: &[Vpl], points: &[Point], options: &Options) -> Both {
    let (device, queue) = (&context.device, &context.queue);
    let pipelines = Pipelines::new(device);
    let tiles = lights.len() as u32 + 3;
    let list = VplList::new(device, tiles).unwrap();
    list.write(queue, lights);
    let atlas = Atlas::new(device, options, points.len() as u32, tiles).unwrap();
    atlas.prepare(queue, options);
    atlas.write(queue, points);
    // What was there before must not matter.
    let dirt = vec![0x7f7f_ffff_u32; tiles as usize * atlas.ism().texels()];
    queue.write_buffer(&atlas.buffers.ism_atlas, 0, bytemuck::cast_slice(&dirt));
    let named = list.buffers.named();
    let read = || {
        [&atlas.buffers.ism_atlas, &atlas.buffers.ism_coarse]
            .map(|b| read_buffer::<f32>(device, queue, b).unwrap())
    };
    let mut passes = ["splat", "pull", "push"].map(Pass::new);
    atlas.splat(&pipelines, &mut passes[0], &named).unwrap();
    atlas.pull(&pipelines, &mut passes[1], &named).unwrap();
    atlas.push(&pipelines, &mut passes[2], &named).unwrap();
    let gpu = passes.each_ref().map(|pass| {
        run(context, pass);
        read()
    });
    // The CPU's passes begin with what the GPU's began with, so that each is compared alone.
    let splat = cpu::splat(lights, points, options);
    let start = |[maps, coarse]: &[Vec<f32>; 2]| {
        let mut a = splat.clone();
        a.depths.copy_from_slice(&maps[..splat.depths.len()]);
        a.coarse.copy_from_slice(&coarse[..splat.coarse.len()]);
        a
    };
    let (mut pull, mut push) = (start(&gpu[0]), start(&gpu[1]));
    cpu::pull(&mut pull);
    cpu::push(&mut push);
    Both { cpu: [splat, pull, push], gpu }
}

#[test]
fn structs_are_those_of_the_shader() {
    check::<Pair>(&indirect_gpu::shaders::ISM_VISIBLE).unwrap();
}

#[test]
fn maps_of_both_backends_agree() {
    let Some(context) = testkit::gpu() else { return };
    for (name, tile, levels) in [("cornell_spot", 32, 2), ("atrium", 64, 4), ("two_rooms", 8, 3)] {
        let scene = indirect_scene::fixtures::build(name).unwrap();
        let accel = Accel::build(&scene, BuildPreset::Fast);
        let lights = vpls(&accel, 20, 1);
        // Fewer points than the maps draw together: the runs wrap.
        let options =
            Options { tile, pull_push: levels, points: 5000, points_per_map: 700, ..Options::default() };
        let points = cpu::resolve(&scene, &place(&scene, options.points, &[], options.placement, 3));
        let Both { cpu, gpu } = both(context, &lights, &points, &options);
        for (k, pass) in ["splat", "pull", "push"].into_iter().enumerate() {
            let maps = cpu[k].depths.len();
            let wrong = differing(&cpu[k].depths, &gpu[k][0][..maps], 1e-4);
            assert!(wrong * SHARE <= maps, "{name} {pass}: {wrong} of {maps}");
            // Maps beyond the VPLs are empty.
            assert!(gpu[k][0].len() > maps && gpu[k][0][maps..].iter().all(|u| *u == EMPTY));
            if k > 0 {
                let coarse = cpu[k].coarse.len();
                let wrong = differing(&cpu[k].coarse, &gpu[k][1][..coarse], 1e-4);
                assert!(coarse > 0 && wrong * SHARE <= coarse, "{name} {pass}: {wrong} of {coarse}");
            }
        }
        assert!(cpu[0].depths.iter().filter(|u| **u != EMPTY).count() * 8 > cpu[0].depths.len());
        // The passes do something, and another map is another map: the comparison can fail.
        assert_ne!(cpu[0].depths, cpu[2].depths);
        let other = gpu[0][0][cpu[0].ism.texels()..][..cpu[0].depths.len()].to_vec();
        assert!(differing(&cpu[0].depths, &other, 1e-4) * SHARE > other.len());
        let filled = differing(&cpu[0].depths, &gpu[2][0][..cpu[0].depths.len()], 1e-4);
        assert!(filled * SHARE > cpu[0].depths.len(), "{name}: {filled}");
    }
}

#[test]
fn queries_of_both_backends_agree() {
    let Some(context) = testkit::gpu() else { return };
    let (device, queue) = (&context.device, &context.queue);
    let pipelines = Pipelines::new(device);
    let scene = indirect_scene::fixtures::build("cornell_spot").unwrap();
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let lights = vpls(&accel, 20, 1);
    let asked = pairs(&accel, &lights, &receivers(&scene, 3000, 2), 8);
    let options = Options::default();
    let cpu = cpu::cast(&accel, &lights, &options);
    let atlas = Atlas::new(device, &options, 0, lights.len() as u32).unwrap();
    atlas.prepare(queue, &options);
    queue.write_buffer(&atlas.buffers.ism_atlas, 0, bytemuck::cast_slice(&cpu.depths));
    let list = VplList::new(device, lights.len() as u32).unwrap();
    list.write(queue, &lights);
    let data: Vec<Pair> = asked
        .iter()
        .map(|p| Pair { receiver: p.receiver, vpl: p.vpl as u32, normal: p.normal, pad0: 0 })
        .collect();
    let buffer = storage_buffer(device, "pairs", &data).unwrap();
    let out = empty_storage_buffer::<u32>(device, "visible_pairs", data.len() as u64).unwrap();
    let mut pass = Pass::new("visible");
    let own = [list.buffers.named(), vec![named("pairs", &buffer), named("visible_pairs", &out)]].concat();
    atlas.visible(&pipelines, &mut pass, data.len() as u64, &own).unwrap();
    run(context, &pass);
    let gpu: Vec<u32> = read_buffer(device, queue, &out).unwrap();
    let ask = |normal: f32| -> Vec<u32> {
        let one = |p: &common::Pair| {
            let surface = cpu.visible_surface(p.vpl, p.receiver, p.normal * normal);
            u32::from(cpu.visible(p.vpl, p.receiver)) + 2 * u32::from(surface)
        };
        asked.iter().map(one).collect()
    };
    let wrong = |cpu: &[u32]| cpu.iter().zip(&gpu).filter(|(a, b)| a != b).count();
    let found = ask(1.0);
    // As for maps: a receiver at the border of a texel reads either.
    assert!(wrong(&found) * 1000 <= found.len(), "{} of {}", wrong(&found), found.len());
    assert!((0..4).filter(|kind| found.contains(kind)).count() >= 3);
    assert!(wrong(&ask(-1.0)) * 10 > found.len());
}

/// No VPL, no point, one point: nothing fails, and nothing is drawn that is not there.
#[test]
fn little_and_nothing() {
    let Some(context) = testkit::gpu() else { return };
    let light = Vpl::new(Vec3::ZERO, Vec3::Z, Vec3::ONE, 0.1);
    let point = Point { position: Vec3::Z, normal: Vec3::Z, area: 0.1, ..Point::default() };
    let on_light = Point { position: Vec3::ZERO, ..point };
    let options = Options { pull_push: 2, ..Options::default() };
    for (lights, points, some) in [
        (&[][..], &[][..], false),
        (&[light], &[], false),
        (&[], &[point], false),
        (&[light], &[on_light], false),
        (&[light], &[point], true),
    ] {
        let Both { cpu, gpu } = both(context, lights, points, &options);
        for (cpu, gpu) in cpu.iter().zip(&gpu) {
            assert_eq!(differing(&cpu.depths, &gpu[0][..cpu.depths.len()], 1e-4), 0);
            assert_eq!(gpu[0].iter().any(|u| *u > 0.0), some);
        }
    }
}

/// What will be allocated is known, and what does not fit is refused before it is made.
#[test]
fn plans_say_what_is_made() {
    let options = Options { pull_push: 2, ..Options::default() };
    let bytes = Atlas::plan(&options, 65_536, 1024).bytes();
    assert_eq!(bytes, 48 * 65_536 + 1024 * 4 * (32 * 32 + 16 * 16 + 8 * 8) + 48);
    let Some(context) = testkit::gpu() else { return };
    let large = Options { tile: 256, ..options };
    assert!(Atlas::new(&context.device, &large, 1, 1 << 24).is_err());
}
