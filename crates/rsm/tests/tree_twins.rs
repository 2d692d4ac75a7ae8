//! The tree on the GPU against its twin, buffer by buffer.
#![cfg(all(feature = "cpu", feature = "gpu"))]
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

#[path = "common/bounces.rs"]
mod bounces;

use bytemuck::Pod;
use glam::Vec3;
use indirect_accel::{Accel, BuildPreset};
use indirect_gpu::shaders::{Module, RSM_TRAVERSE};
use indirect_gpu::wgpu::{Buffer, CommandEncoderDescriptor};
use indirect_gpu::{
    Context, Pass, PassTimer, Pipelines, Vec3Pad, empty_storage_buffer, named, read_buffer, storage_buffer,
};
use rsm::gpu::{LightTree, TreeParams, VplList};
use rsm::{Bound, Branch, Form, Vpl, cpu};
use testkit::{CpuOutput, GpuOutput, Tolerance, compare, compare_exact};

/// `traverse` with a test of visibility of its own, which binds nothing.
const HALF_HIDDEN: Module = Module {
    name: RSM_TRAVERSE.name,
    files: &{
        let mut files = [RSM_TRAVERSE.files[0]; 6];
        let mut i = 0;
        while i < 5 {
            files[i] = RSM_TRAVERSE.files[i];
            i += 1;
        }
        files[5] = (
            "hidden.wgsl",
            "fn light_visible(representative: u32, receiver: u32, position: vec3<f32>, normal: vec3<f32>) -> bool {
                return (representative + receiver) % 2u == 0u && position.y < 1.0;
            }",
        );
        files
    },
    entry_points: RSM_TRAVERSE.entry_points,
};

struct Found {
    order: Vec<u32>,
    branches: Vec<Branch>,
    reference: f32,
    irradiance: Vec<Vec3>,
    cuts: Vec<u32>,
}

fn on_gpu(
    gpu: &Context,
    vpls: &[Vpl],
    capacity: u32,
    (positions, normals): (&[Vec3], &[Vec3]),
    params: &TreeParams,
    module: &Module,
) -> Found {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let column = |of: &[Vec3]| {
        let data: Vec<_> = of.iter().map(|v| Vec3Pad::new(*v, 0.0)).collect();
        storage_buffer(device, "receivers", &data).unwrap()
    };
    let n = positions.len();
    let (positions, normals) = (column(positions), column(normals));
    let irradiance = empty_storage_buffer::<Vec3Pad>(device, "irradiance", n as u64).unwrap();
    let own = [named("positions", &positions), named("normals", &normals), named("irradiance", &irradiance)];
    let pipelines = Pipelines::new(device);
    let list = VplList::new(device, capacity).unwrap();
    list.write(queue, vpls);
    let tree = LightTree::new(device, capacity.into(), n as u64).unwrap();
    tree.prepare(queue, params);
    let mut pass = Pass::new("tree");
    tree.build(&pipelines, &mut pass, &list.buffers.named()).unwrap();
    tree.reference(&pipelines, &mut pass, &own).unwrap();
    tree.solve_reach(&pipelines, &mut pass).unwrap();
    tree.traverse_with(&pipelines, &mut pass, module, &own).unwrap();
    let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
    pass.encode(&mut encoder, &mut PassTimer::off(), None);
    queue.submit([encoder.finish()]);
    fn read<T: Pod>(gpu: &Context, buffer: &Buffer) -> Vec<T> {
        read_buffer(&gpu.device, &gpu.queue, buffer).unwrap()
    }
    let pairs: Vec<[u32; 2]> = read(gpu, &tree.buffers.pairs);
    let (lights, branches) = (tree.layout().count(0) as usize, tree.layout().len() as usize);
    let e: Vec<Vec3Pad> = read(gpu, &irradiance);
    Found {
        order: pairs.iter().take(lights).map(|p| p[1]).collect(),
        branches: read(gpu, &tree.buffers.branches)[..branches].to_vec(),
        reference: read(gpu, &tree.buffers.reference)[0],
        irradiance: e[..n].iter().map(|e| e.vec3()).collect(),
        cuts: read(gpu, &tree.buffers.cuts)[..n.div_ceil(rsm::TILE)].to_vec(),
    }
}

/// Panics where any buffer is not that of the CPU.
fn agree(gpu: &Context, vpls: &[Vpl], capacity: u32, points: (&[Vec3], &[Vec3]), params: &TreeParams) {
    let found = on_gpu(gpu, vpls, capacity, points, params, &RSM_TRAVERSE);
    // Places beyond the list hold nothing.
    let mut places = vpls.to_vec();
    places.resize(capacity as usize, Vpl::default());
    let mut tree = cpu::LightTree::new(&places, params.seed);
    let reference = tree.reference_irradiance(points.0, points.1);
    tree.solve_reach(params.bound, params.tau * reference);
    let (irradiance, cuts) = cpu::traverse(&tree.branches, points.0, points.1, params.form);

    let floats = |name: &str, cpu: &[f32], gpu: &[f32]| {
        let largest = cpu.iter().fold(1e-30_f32, |m, v| m.max(v.abs()));
        let tolerance =
            Tolerance { absolute: Tolerance::TWINS.absolute * largest.min(1.0), ..Tolerance::TWINS };
        if !cpu.is_empty() || !gpu.is_empty() {
            compare(name, CpuOutput(cpu), GpuOutput(gpu), tolerance, None).unwrap();
        }
    };
    let words = |name: &str, cpu: &[u32], gpu: &[u32]| {
        if !cpu.is_empty() || !gpu.is_empty() {
            compare_exact(name, CpuOutput(cpu), GpuOutput(gpu), None).unwrap();
        }
    };
    words("order", &tree.order, &found.order);
    let of = |get: fn(&Branch) -> Vec<u32>, b: &[Branch]| b.iter().flat_map(get).collect::<Vec<_>>();
    let links: fn(&Branch) -> Vec<u32> = |b| vec![b.next, b.child, b.representative];
    words("links", &of(links, &tree.branches), &of(links, &found.branches));
    type Get = fn(&Branch) -> Vec<f32>;
    let fields: [(&str, Get); 7] = [
        ("position", |b| b.position.to_array().to_vec()),
        ("normal", |b| b.normal.to_array().to_vec()),
        ("flux", |b| b.flux.to_array().to_vec()),
        ("area", |b| vec![b.area]),
        ("radius", |b| vec![b.radius]),
        ("versine", |b| vec![b.versine]),
        ("reach", |b| vec![b.reach]),
    ];
    for (name, get) in fields {
        let of = |b: &[Branch]| b.iter().flat_map(get).collect::<Vec<_>>();
        floats(name, &of(&tree.branches), &of(&found.branches));
    }
    floats("reference", &[reference], &[found.reference]);
    let of = |e: &[Vec3]| e.iter().flat_map(|e| e.to_array()).collect::<Vec<_>>();
    floats("irradiance", &of(&irradiance), &of(&found.irradiance));
    words("cuts", &cuts, &found.cuts);
}

fn cornell(count: u32, side: u32) -> (Vec<Vpl>, Vec<Vec3>, Vec<Vec3>) {
    let scene = indirect_scene::fixtures::build("cornell_spot").unwrap();
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let maps = cpu::generate(&accel, 128).unwrap();
    let (positions, normals) = bounces::receivers(&accel, &scene.cameras[0].view([side; 2]), [side; 2]);
    (bounces::vpls(&accel, &maps, count), positions, normals)
}

#[test]
fn trees_of_several_sizes_agree() {
    let Some(gpu) = testkit::gpu() else { return };
    let (vpls, positions, normals) = cornell(5000, 37);
    let points = (&positions[..], &normals[..]);
    let params = TreeParams { receivers: positions.len() as u32, ..TreeParams::default() };
    // One block, several, and less lights than places.
    for (count, capacity) in [(700, 700), (1024, 1024), (3001, 3001), (2500, 4608), (0, 100), (1, 1), (2, 2)]
    {
        agree(gpu, &vpls[..count], capacity, points, &params);
    }
    for (tau, bound, form, seed) in [
        (0.0, Bound::Error, Form::Point, 7),
        (0.1, Bound::Error, Form::Point, 8),
        (0.01, Bound::ContributionAsPrinted, Form::Disc, 9),
    ] {
        agree(gpu, &vpls[..1500], 1500, points, &TreeParams { tau, bound, form, seed, ..params });
    }
}

#[test]
fn the_tree_of_65536_lights_agrees() {
    let Some(gpu) = testkit::gpu() else { return };
    let (vpls, positions, normals) = cornell(66_000, 16);
    let params = TreeParams { receivers: positions.len() as u32, tau: 0.01, ..TreeParams::default() };
    assert!(vpls.len() > 60_000);
    agree(gpu, &vpls, 65_536, (&positions, &normals), &params);
}

#[test]
fn a_list_without_order_agrees() {
    let Some(gpu) = testkit::gpu() else { return };
    let (positions, normals) = bounces::plane(11, 2.0);
    let params = TreeParams { receivers: positions.len() as u32, ..TreeParams::default() };
    let one = Vpl::new(Vec3::ONE, Vec3::NEG_Y, Vec3::ONE, 1e-3);
    let mut vpls = vec![one; 1200];
    for (i, vpl) in vpls.iter_mut().enumerate() {
        match i % 7 {
            1 => vpl.flux = Vec3::ZERO,
            2 => vpl.flux.x = f32::NAN,
            3 => vpl.position.y = f32::INFINITY,
            4 => vpl.normal = Vec3::Y,
            5 => vpl.position.x = 0.01 * i as f32,
            _ => {}
        }
    }
    agree(gpu, &vpls, 1300, (&positions, &normals), &params);
}

#[test]
fn a_module_says_what_stands_in_the_way() {
    let Some(gpu) = testkit::gpu() else { return };
    assert_eq!(RSM_TRAVERSE.files[5].0, "rsm/unoccluded.wgsl");
    let (vpls, positions, normals) = cornell(2000, 20);
    let params =
        TreeParams { receivers: positions.len() as u32, tau: 0.03, seed: 5, ..TreeParams::default() };
    let points = (&positions[..], &normals[..]);
    let found = on_gpu(gpu, &vpls, vpls.len() as u32, points, &params, &HALF_HIDDEN);
    let mut tree = cpu::LightTree::new(&vpls, params.seed);
    tree.solve_reach(params.bound, params.tau * tree.reference_irradiance(&positions, &normals));
    let visible = |light: u32, i: usize| (light as usize + i).is_multiple_of(2) && positions[i].y < 1.0;
    let (e, cuts) = cpu::traverse_visible(&tree.branches, &positions, &normals, params.form, visible);
    let largest = e.iter().fold(1e-30_f32, |m, e| m.max(e.max_element()));
    let tolerance = Tolerance { absolute: Tolerance::TWINS.absolute * largest.min(1.0), ..Tolerance::TWINS };
    compare("irradiance", CpuOutput(&e), GpuOutput(&found.irradiance), tolerance, None).unwrap();
    assert_eq!(found.cuts, cuts);
    // It must have said something.
    let all = cpu::traverse(&tree.branches, &positions, &normals, params.form).0;
    let sum = |e: &[Vec3]| e.iter().map(|e| f64::from(e.y)).sum::<f64>();
    assert!(sum(&e) > 0.1 * sum(&all) && sum(&e) < 0.6 * sum(&all));
}

#[test]
#[should_panic(expected = "deviate")]
fn a_wrong_light_is_noticed() {
    let Some(gpu) = testkit::gpu() else { panic!("deviate: nothing to compare") };
    let (vpls, positions, normals) = cornell(900, 16);
    let params = TreeParams { receivers: positions.len() as u32, ..TreeParams::default() };
    let points = (&positions[..], &normals[..]);
    let mut found = on_gpu(gpu, &vpls, vpls.len() as u32, points, &params, &RSM_TRAVERSE);
    let tree = cpu::LightTree::new(&vpls, 0);
    found.branches[0].flux *= 1.01;
    let of = |b: &[Branch]| b.iter().map(|b| b.flux.x).collect::<Vec<_>>();
    let (cpu, gpu) = (of(&tree.branches), of(&found.branches));
    assert!(
        compare("flux", CpuOutput(&cpu), GpuOutput(&gpu), Tolerance::TWINS, None).is_ok(),
        "buffers deviate"
    );
}
