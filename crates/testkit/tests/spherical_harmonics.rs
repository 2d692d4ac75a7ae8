//! `sh/sh.wgsl` and the patch form factors of `core/form_factor.wgsl` compute what their Rust twins compute.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3, Vec4};
use indirect_core::form_factor;
use indirect_gpu::shaders::{FORM_FACTOR, Module, SH};
use sh_math::{Sh, twins};
use testkit::{CpuOutput, GpuOutput, Tolerance, compare};

/// Evenly spread numbers in `[-1, 1)`.
fn spread(i: usize, axis: usize) -> f32 {
    const STEP: [f64; 3] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_960_4];
    (2.0 * (i as f64 * STEP[axis]).fract() - 1.0) as f32
}

/// Directions over the sphere, the axes first.
fn direction(i: usize) -> Vec3 {
    match i {
        0..3 => Vec3::AXES[i],
        3..6 => -Vec3::AXES[i - 3],
        _ => {
            let (z, phi) = (spread(i, 0), core::f32::consts::PI * spread(i, 1));
            let r = (1.0 - z * z).sqrt();
            Vec3::new(r * phi.cos(), r * phi.sin(), z)
        }
    }
}

/// One field for all: RGB coefficients of an HDR environment, the WGSL's formula below.
fn field<const N: usize>() -> Sh<N, Vec3> {
    Sh(core::array::from_fn(|i| Vec3::new(1.0, -2.5, 1000.0) / (1.0 + i as f32)))
}

const SH_TEST: Module = Module {
    name: "sh test",
    files: &[
        SH.files[0],
        (
            "sh_test.wgsl",
            "struct Output {
                 l1: array<vec4<f32>, 4>, l2: array<vec4<f32>, 9>, values: array<vec4<f32>, 4>,
             }
             @group(0) @binding(0) var<storage, read> inputs: array<vec4<f32>>;
             @group(0) @binding(1) var<storage, read_write> outputs: array<Output>;
             @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
                 if id.x >= arrayLength(&inputs) { return; }
                 let d = inputs[id.x].xyz;
                 let color = vec3<f32>(1.0, -2.5, 1000.0);
                 var sh1: array<vec3<f32>, 4>;
                 var sh2: array<vec3<f32>, 9>;
                 for (var i = 0; i < 9; i += 1) { sh2[i] = color / (1.0 + f32(i)); }
                 for (var i = 0; i < 4; i += 1) { sh1[i] = sh2[i]; }
                 outputs[id.x].values = array<vec4<f32>, 4>(
                     vec4(sh_evaluate_l1(sh1, d), 0.0), vec4(sh_evaluate_l2(sh2, d), 0.0),
                     vec4(sh_irradiance_l1(sh1, d), 0.0), vec4(sh_irradiance_l2(sh2, d), 0.0),
                 );
                 let lobe1 = sh_lobe_l1(vec2(0.7, 0.3), d);
                 let lobe2 = sh_lobe_l2(vec3(0.7, 0.3, -0.2), d);
                 sh_project_add_l1(&sh1, d, vec3(2.0, 1.0, 0.5));
                 sh_project_add_l2(&sh2, d, vec3(2.0, 1.0, 0.5));
                 for (var i = 0; i < 4; i += 1) { outputs[id.x].l1[i] = vec4(sh1[i], lobe1[i]); }
                 for (var i = 0; i < 9; i += 1) { outputs[id.x].l2[i] = vec4(sh2[i], lobe2[i]); }
             }",
        ),
    ],
    entry_points: &["main"],
};

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Output {
    l1: [[f32; 4]; 4],
    l2: [[f32; 4]; 9],
    values: [[f32; 4]; 4],
}

#[test]
fn spherical_harmonics() {
    let Some(gpu) = testkit::gpu() else { return };
    let directions: Vec<Vec3> = (0..5000).map(direction).collect();
    let inputs: Vec<[f32; 4]> = directions.iter().map(|d| d.extend(0.0).to_array()).collect();
    let found: Vec<Output> = gpu.run(&SH_TEST, "main", &inputs, inputs.len()).unwrap();
    // Sums of nine terms of the size of the first; a GPU may fuse a multiply and an add.
    let tolerance = Tolerance { relative: 2e-6, absolute: 1e-6 };
    let check = |name: &str, cpu: &dyn Fn(Vec3) -> Vec4, gpu: &dyn Fn(&Output) -> [f32; 4]| {
        // Per channel: the channels are a thousandfold apart.
        for channel in 0..4 {
            let cpu: Vec<f32> = directions.iter().map(|d| cpu(*d)[channel]).collect();
            let gpu: Vec<f32> = found.iter().map(|o| gpu(o)[channel]).collect();
            let scale = cpu.iter().fold(1.0_f32, |a, c| a.max(c.abs()));
            // A value near 0 is a difference of terms of the field's size.
            let tolerance = Tolerance { absolute: tolerance.absolute * scale, ..tolerance };
            compare(&format!("{name}, channel {channel}"), CpuOutput(&cpu), GpuOutput(&gpu), tolerance, None)
                .unwrap();
        }
    };
    check("evaluate l1", &|d| twins::sh_evaluate_l1(&field(), d).extend(0.0), &|o| o.values[0]);
    check("evaluate l2", &|d| twins::sh_evaluate_l2(&field(), d).extend(0.0), &|o| o.values[1]);
    check("irradiance l1", &|d| twins::sh_irradiance_l1(&field(), d).extend(0.0), &|o| o.values[2]);
    check("irradiance l2", &|d| twins::sh_irradiance_l2(&field(), d).extend(0.0), &|o| o.values[3]);
    let weighted = Vec3::new(2.0, 1.0, 0.5);
    for i in 0..4 {
        let cpu = |d: Vec3| {
            let mut sh = field::<4>();
            twins::sh_project_add_l1(&mut sh, d, weighted);
            sh[i].extend(twins::sh_lobe_l1(Vec2::new(0.7, 0.3), d)[i])
        };
        check(&format!("project and lobe l1 [{i}]"), &cpu, &|o| o.l1[i]);
    }
    for i in 0..9 {
        let cpu = |d: Vec3| {
            let mut sh = field::<9>();
            twins::sh_project_add_l2(&mut sh, d, weighted);
            sh[i].extend(twins::sh_lobe_l2(Vec3::new(0.7, 0.3, -0.2), d)[i])
        };
        check(&format!("project and lobe l2 [{i}]"), &cpu, &|o| o.l2[i]);
    }
}

const PATCH_TEST: Module = Module {
    name: "patch test",
    files: &[
        FORM_FACTOR.files[0],
        (
            "patch_test.wgsl",
            "struct Input { n: vec3<f32>, area: f32, centre: vec3<f32>, pad: f32, m: vec3<f32>, pad2: f32 }
             @group(0) @binding(0) var<storage, read> inputs: array<Input>;
             @group(0) @binding(1) var<storage, read_write> outputs: array<f32>;
             @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
                 if id.x >= arrayLength(&inputs) { return; }
                 let i = inputs[id.x];
                 outputs[id.x] = point_to_patch(vec3(0.0), i.n, i.centre, i.m, i.area);
             }",
        ),
    ],
    entry_points: &["main"],
};

#[test]
fn patch_form_factor() {
    let Some(gpu) = testkit::gpu() else { return };
    let case = |i: usize| {
        let centre = direction(i) * 10.0_f32.powf(1.5 * spread(i, 2));
        (direction(3 * i + 1), 1.0, centre, direction(7 * i + 5))
    };
    let mut cases: Vec<(Vec3, f32, Vec3, Vec3)> = (0..10_000).map(case).collect();
    for centre in [Vec3::ZERO, Vec3::Y * 1e-20, Vec3::Y * 1e-3, Vec3::NEG_Y, Vec3::Y, Vec3::X] {
        cases.push((Vec3::Y, 1.0, centre, Vec3::NEG_Y));
    }
    let inputs: Vec<[f32; 12]> = cases
        .iter()
        .map(|(n, a, c, m)| {
            bytemuck::cast([n.extend(*a), c.extend(0.0), m.extend(0.0)].map(|v| v.to_array()))
        })
        .collect();
    let gpu: Vec<f32> = gpu.run(&PATCH_TEST, "main", &inputs, inputs.len()).unwrap();
    let cpu: Vec<f32> =
        cases.iter().map(|(n, a, c, m)| form_factor::point_to_patch(Vec3::ZERO, *n, *c, *m, *a)).collect();
    // Five edge terms below π, to some ulp each; at the switch from square to point, by the distance's last bit, the two
    // forms may be 5 % apart, and in a receiver that lies in the patch's plane the side it is on is a matter of rounding.
    let clear: Vec<bool> = cases
        .iter()
        .map(|(_, _, c, m)| {
            (c.length() - form_factor::PATCH_FAR).abs() > 1e-5
                && m.dot(*c).abs() > 1e-4 * c.length().max(1e-3)
        })
        .collect();
    let tolerance = Tolerance { relative: 1e-4, absolute: 1e-5 };
    let c = compare("patch", CpuOutput(&cpu), GpuOutput(&gpu), tolerance, Some(&clear)).unwrap();
    assert!(c.compared > 9900 && gpu.iter().all(|f| (0.0..=1.0).contains(f)));
}
