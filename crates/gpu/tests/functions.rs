//! The shared WGSL functions compute what their Rust twins compute.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3, Vec4};
use indirect_core::{Projection, View, form_factor, math, octahedral};
use indirect_gpu::shaders::{FILTER_SHADE, FORM_FACTOR, GRID, Module, OCTAHEDRAL, SCENE, VIEW};
use indirect_gpu::{
    Context, GpuError, Kernel, PassTimer, ViewUniform, empty_storage_buffer, named, storage_buffer,
    workgroups_1d,
};
use testkit::{CpuOutput, GpuOutput, Tolerance, compare, compare_exact};

/// Evenly spread numbers in `[-1, 1)`: the fractions of multiples of powers of the plastic number.
fn spread(i: u32, axis: u32) -> f32 {
    const STEP: [f64; 4] =
        [0.856_674_883_854_502_9, 0.733_891_856_627_126, 0.628_706_721_150_388_6, 0.538_597_234_4];
    (2.0 * (f64::from(i) * STEP[axis as usize]).fract() - 1.0) as f32
}

fn direction(i: u32) -> Vec3 {
    let (z, phi) = (spread(i, 0), core::f32::consts::PI * spread(i, 1));
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(r * phi.cos(), r * phi.sin(), z)
}

const OCTAHEDRAL_TEST: Module = Module {
    name: "octahedral test",
    files: &[
        OCTAHEDRAL.files[0],
        (
            "octahedral_test.wgsl",
            "struct Output { encoded: vec2<f32>, packed: u32, pad: u32, unpacked: vec4<f32> }
             @group(0) @binding(0) var<storage, read> inputs: array<vec4<f32>>;
             @group(0) @binding(1) var<storage, read_write> outputs: array<Output>;
             @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
                 if id.x >= arrayLength(&inputs) { return; }
                 let n = inputs[id.x].xyz;
                 let packed = octahedral_pack(n);
                 outputs[id.x] = Output(octahedral_encode(n), packed, 0u, vec4(octahedral_unpack(packed), 0.0));
             }",
        ),
    ],
    entry_points: &["main"],
};

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct OctahedralOutput {
    encoded: [f32; 2],
    packed: u32,
    pad: u32,
    unpacked: [f32; 4],
}

#[test]
fn octahedral_normals() {
    let Some(gpu) = testkit::gpu() else { return };
    let mut normals: Vec<Vec3> = (0..10_000).map(direction).collect();
    normals.extend([
        Vec3::X,
        Vec3::Y,
        Vec3::Z,
        -Vec3::X,
        -Vec3::Y,
        -Vec3::Z,
        Vec3::ZERO,
        Vec3::new(-0.0, 0.0, -1.0),
    ]);
    let inputs: Vec<[f32; 4]> = normals.iter().map(|n| n.extend(0.0).to_array()).collect();
    let found: Vec<OctahedralOutput> = gpu.run(&OCTAHEDRAL_TEST, "main", &inputs, inputs.len()).unwrap();
    let cpu: Vec<Vec2> = normals.iter().map(|n| octahedral::encode(*n)).collect();
    let gpu: Vec<Vec2> = found.iter().map(|o| o.encoded.into()).collect();
    compare("encode", CpuOutput(&cpu), GpuOutput(&gpu), Tolerance { relative: 1e-6, absolute: 1e-6 }, None)
        .unwrap();
    // A component that lies half way between two steps may round either way: one step of 1/32767 apart.
    for (n, o) in normals.iter().zip(&found) {
        let step = |shift: u32| {
            let q = |p: u32| i32::from((p >> shift) as u16 as i16);
            (q(octahedral::pack(*n)) - q(o.packed)).abs()
        };
        assert!(step(0) <= 1 && step(16) <= 1, "{n}");
    }
    let cpu: Vec<Vec3> = found.iter().map(|o| octahedral::unpack(o.packed)).collect();
    let gpu: Vec<Vec3> = found.iter().map(|o| Vec4::from(o.unpacked).truncate()).collect();
    compare("unpack", CpuOutput(&cpu), GpuOutput(&gpu), Tolerance { relative: 1e-6, absolute: 1e-6 }, None)
        .unwrap();
}

const FORM_FACTOR_TEST: Module = Module {
    name: "form factor test",
    files: &[
        FORM_FACTOR.files[0],
        (
            "form_factor_test.wgsl",
            "struct Input { n: vec3<f32>, area: f32, centre: vec3<f32>, pad: f32, m: vec3<f32>, pad2: f32 }
             @group(0) @binding(0) var<storage, read> inputs: array<Input>;
             @group(0) @binding(1) var<storage, read_write> outputs: array<vec2<f32>>;
             @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
                 if id.x >= arrayLength(&inputs) { return; }
                 let i = inputs[id.x];
                 outputs[id.x] = vec2(
                     point_to_point(vec3(0.0), i.n, i.centre, i.m, i.area),
                     point_to_disc(vec3(0.0), i.n, i.centre, i.m, i.area),
                 );
             }",
        ),
    ],
    entry_points: &["main"],
};

#[test]
fn form_factors() {
    let Some(gpu) = testkit::gpu() else { return };
    let case = |i: u32| {
        let centre = direction(i) * 10.0_f32.powf(3.0 * spread(i, 3));
        (direction(3 * i + 1), 10.0_f32.powf(4.0 * spread(i, 2)), centre, direction(7 * i + 5))
    };
    let mut cases: Vec<_> = (0..10_000).map(case).collect();
    // Coincident, nearly coincident, beyond each other's horizon, and face to face.
    for centre in [Vec3::ZERO, Vec3::Y * 1e-20, Vec3::Y * 1e-18, Vec3::NEG_Y, Vec3::Y, Vec3::X] {
        cases.push((Vec3::Y, 1.0, centre, Vec3::NEG_Y));
    }
    let inputs: Vec<[Vec4; 3]> =
        cases.iter().map(|(n, a, c, m)| [n.extend(*a), c.extend(0.0), m.extend(0.0)]).collect();
    let inputs: Vec<[f32; 12]> = inputs.iter().map(|v| bytemuck::cast(v.map(|v| v.to_array()))).collect();
    let found: Vec<[f32; 2]> = gpu.run(&FORM_FACTOR_TEST, "main", &inputs, inputs.len()).unwrap();
    type Form = fn(Vec3, Vec3, Vec3, Vec3, f32) -> f32;
    let forms: [(&str, Form); 2] =
        [("point to point", form_factor::point_to_point), ("point to disc", form_factor::point_to_disc)];
    for (i, (name, form)) in forms.into_iter().enumerate() {
        let cpu: Vec<f32> = cases.iter().map(|(n, a, c, m)| form(Vec3::ZERO, *n, *c, *m, *a)).collect();
        let gpu: Vec<f32> = found.iter().map(|f| f[i]).collect();
        // A cosine near 0 is the difference of products near 1: it keeps an absolute error of a few 2⁻²⁴, which the
        // geometry's A/(πd²) multiplies. Cosines above 10⁻² keep the relative 1e-4 of all twins.
        let clear: Vec<bool> = cases
            .iter()
            .map(|(n, _, c, m)| {
                let w = c.normalize_or_zero();
                (n.dot(w).abs() > 1e-2 && m.dot(w).abs() > 1e-2) || w == Vec3::ZERO
            })
            .collect();
        let c = compare(name, CpuOutput(&cpu), GpuOutput(&gpu), Tolerance::TWINS, Some(&clear)).unwrap();
        assert!(c.compared > 9000 && gpu.iter().all(|f| f.is_finite() && *f >= 0.0));
    }
}

const GRID_TEST: Module = Module {
    name: "grid test",
    files: &[
        GRID.files[0],
        (
            "grid_test.wgsl",
            "@group(0) @binding(0) var<storage, read_write> outputs: array<u32>;
             @compute @workgroup_size(64) fn main(
                 @builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
                 @builtin(local_invocation_index) local: u32,
             ) {
                 let i = grid_index(group, groups, local, 64u);
                 if i < arrayLength(&outputs) { outputs[i] += i; }
             }",
        ),
    ],
    entry_points: &["main"],
};

#[test]
fn grids_reach_every_index_once_beyond_65535_workgroups() -> Result<(), GpuError> {
    let Some(gpu) = testkit::gpu() else { return Ok(()) };
    let Context { device, queue, .. } = gpu;
    let n = 65_535 * 64 + 1000;
    let output = empty_storage_buffer::<u32>(device, "outputs", n)?;
    let kernel = Kernel::new(device, &GRID_TEST, "main", &[]);
    let group = kernel.bind(device, 0, &[(0, output.as_entire_binding())]);
    let mut encoder = device.create_command_encoder(&Default::default());
    kernel.dispatch(&mut encoder, &mut PassTimer::off(), "grid", &[&group], workgroups_1d(n, 64)?);
    queue.submit([encoder.finish()]);
    let cpu: Vec<u32> = (0..n as u32).collect();
    compare_exact("indices", CpuOutput(&cpu), GpuOutput(&gpu.read(&output)?), None).unwrap();
    Ok(())
}

const VIEW_TEST: Module = Module {
    name: "view test",
    files: &[
        VIEW.files[0],
        (
            "view_test.wgsl",
            "struct Input { view: View, p: vec4<f32>, pixel: vec4<f32>, a: vec4<f32>, b: vec4<f32>, c: vec4<f32> }
             struct Output { clip: vec4<f32>, direction: vec4<f32>, hit: vec4<f32>, at: vec4<f32> }
             @group(0) @binding(0) var<storage, read> inputs: array<Input>;
             @group(0) @binding(1) var<storage, read_write> outputs: array<Output>;
             @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
                 if id.x >= arrayLength(&inputs) { return; }
                 let i = inputs[id.x];
                 let d = view_direction(i.view, i.pixel.xy);
                 let hit = view_barycentrics(i.view, i.pixel.xy, i.a.xyz, i.b.xyz, i.c.xyz);
                 outputs[id.x] = Output(view_clip(i.view, i.p.xyz), vec4(d, 0.0), hit, vec4(view_image_point(i.view, i.p.xyz), 0.0));
             }",
        ),
    ],
    entry_points: &["main"],
};

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct ViewInput {
    view: ViewUniform,
    p: [f32; 4],
    pixel: [f32; 4],
    corners: [[f32; 4]; 3],
}

#[test]
fn views_project_and_cast_alike() {
    let Some(gpu) = testkit::gpu() else { return };
    let size = [321, 123];
    let views: Vec<View> = (0..300)
        .map(|i| {
            let extent = Vec2::new(0.4 + spread(i, 2).abs(), 0.7);
            let (projection, far) = match i % 3 {
                0 => (Projection::Perspective { tan_half: extent }, f32::INFINITY),
                1 => (Projection::Perspective { tan_half: extent }, 50.0),
                _ => (Projection::Orthographic { half_size: extent * 9.0 }, 50.0),
            };
            View::look_to(direction(i) * 5.0, direction(i + 999), Vec3::Y, projection, 0.1, far)
        })
        .collect();
    let point = |i: u32| direction(5 * i) * 20.0;
    let pixel = |i: u32| Vec2::new(160.0 * (1.0 + spread(i, 0)), 60.0 * (1.0 + spread(i, 1)));
    // Triangles around the point where the ray is at depth 5: some are hit, the rays beside the others are clamped to them.
    let corners = |i: u32, view: &View| {
        let target = view.ray(pixel(i), size).at(5.0);
        [0, 1, 2].map(|k| target + direction(11 * i + k) * 2.0)
    };
    let inputs: Vec<ViewInput> = (0..)
        .zip(&views)
        .map(|(i, view)| ViewInput {
            view: ViewUniform::new(view, size, 0),
            p: point(i).extend(1.0).to_array(),
            pixel: pixel(i).extend(0.0).extend(0.0).to_array(),
            corners: corners(i, view).map(|c| c.extend(0.0).to_array()),
        })
        .collect();
    let found: Vec<[[f32; 4]; 4]> = gpu.run(&VIEW_TEST, "main", &inputs, inputs.len()).unwrap();
    let gpu_clip: Vec<_> = found.iter().map(|o| Vec4::from(o[0])).collect();
    let gpu_direction: Vec<_> = found.iter().map(|o| Vec4::from(o[1]).truncate()).collect();
    let gpu_hit: Vec<_> = found.iter().map(|o| Vec4::from(o[2])).collect();
    let clip: Vec<Vec4> =
        (0..).zip(&views).map(|(i, v)| v.clip_from_world() * point(i).extend(1.0)).collect();
    let directions: Vec<Vec3> = (0..).zip(&views).map(|(i, v)| v.ray(pixel(i), size).direction).collect();
    // Coordinates of at most 25 m, divided by at least 0.4, to a few roundings each.
    let tolerance = Tolerance { relative: 2e-6, absolute: 2e-5 };
    compare("clip", CpuOutput(&clip), GpuOutput(&gpu_clip), tolerance, None).unwrap();
    compare("direction", CpuOutput(&directions), GpuOutput(&gpu_direction), tolerance, None).unwrap();
    let at: Vec<Vec3> = (0..)
        .zip(&views)
        .map(|(i, v)| v.image_point(point(i)).map_or(Vec3::ZERO, |at| at.extend(1.0)))
        .collect();
    let gpu_at: Vec<_> = found.iter().map(|o| Vec4::from(o[3]).truncate()).collect();
    // A point at a small angle to the image plane is as far outside of the image as its depth, a difference of metres, is small.
    let clear: Vec<bool> = at.iter().map(|at| at.truncate().abs().max_element() < 1e3).collect();
    compare("image point", CpuOutput(&at), GpuOutput(&gpu_at), Tolerance::TWINS, Some(&clear)).unwrap();
    let behind = at.iter().filter(|at| at.z == 0.0).count();
    assert!(behind > 30 && at.len() - behind > 30, "{behind} of {} are behind the eye", at.len());
    let hit: Vec<Vec4> = (0..)
        .zip(&views)
        .map(|(i, view)| {
            let (w, depth) = view.barycentrics(pixel(i), size, corners(i, view));
            Vec4::new(1.0 - w.x - w.y, w.x, w.y, depth)
        })
        .collect();
    compare("barycentrics", CpuOutput(&hit), GpuOutput(&gpu_hit), Tolerance::TWINS, None).unwrap();
    let inside = hit.iter().filter(|h| h.x > 0.0 && h.y > 0.0 && h.z > 0.0).count();
    assert!(inside > 30 && hit.len() - inside > 30, "{inside} of {} are hit", hit.len());
}

const NORMALIZE_TEST: Module = Module {
    name: "normalize test",
    files: &[
        SCENE.files[0],
        SCENE.files[1],
        SCENE.files[2],
        (
            "normalize_test.wgsl",
            "@group(1) @binding(0) var<storage, read> inputs: array<vec4<f32>>;
             @group(1) @binding(1) var<storage, read_write> outputs: array<vec4<f32>>;
             @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
                 if id.x >= arrayLength(&inputs) { return; }
                 outputs[id.x] = vec4(normalize_or(inputs[id.x].xyz, vec3(0.0, 1.0, 0.0)), 0.0);
             }",
        ),
    ],
    entry_points: &["main"],
};

#[test]
fn normalize_survives_extremes() -> Result<(), GpuError> {
    let Some(gpu) = testkit::gpu() else { return Ok(()) };
    let mut vectors = vec![Vec3::ZERO, Vec3::new(f32::NAN, 1.0, 0.0), Vec3::new(1.0, f32::INFINITY, 0.0)];
    // Numbers below the smallest normal one may be flushed to 0 by a GPU; these are above it.
    vectors.extend([1e-37_f32, 1e-20, 1.0, 1e20, 3e38].map(|s| Vec3::new(s, -s, 0.5 * s)));
    let inputs: Vec<[f32; 4]> = vectors.iter().map(|v| v.extend(0.0).to_array()).collect();
    let input = storage_buffer(&gpu.device, "inputs", &inputs)?;
    let output = empty_storage_buffer::<[f32; 4]>(&gpu.device, "outputs", inputs.len() as u64)?;
    let kernel = Kernel::new(&gpu.device, &NORMALIZE_TEST, "main", &[]);
    let nothing = kernel.bind(&gpu.device, 0, &[]);
    let group =
        kernel.bind(&gpu.device, 1, &[(0, input.as_entire_binding()), (1, output.as_entire_binding())]);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    kernel.dispatch(&mut encoder, &mut PassTimer::off(), "normalize", &[&nothing, &group], [1, 1, 1]);
    gpu.queue.submit([encoder.finish()]);
    let found: Vec<Vec3> = gpu.read::<[f32; 4]>(&output)?.iter().map(|v| Vec4::from(*v).truncate()).collect();
    let cpu: Vec<Vec3> = vectors.iter().map(|v| math::normalize_or(*v, Vec3::Y)).collect();
    compare(
        "normalize_or",
        CpuOutput(&cpu),
        GpuOutput(&found),
        Tolerance { relative: 1e-6, absolute: 0.0 },
        None,
    )
    .unwrap();
    Ok(())
}

/// Layouts are explicit: a bind group that one instance of a pipeline made serves another.
#[test]
fn bind_groups_fit_every_instance_of_a_pipeline() -> Result<(), GpuError> {
    let Some(gpu) = testkit::gpu() else { return Ok(()) };
    let Context { device, queue, .. } = gpu;
    let kernel = || Kernel::new(device, &FILTER_SHADE, "shade", &[]);
    let (first, second) = (kernel(), kernel());
    let albedo = storage_buffer(device, "albedos", &[[0.5_f32, 0.25, 1.0, 0.0]])?;
    let irradiance = storage_buffer(device, "irradiance", &[[core::f32::consts::PI; 4]])?;
    let image = empty_storage_buffer::<[f32; 4]>(device, "image", 1)?;
    let names = [named("albedos", &albedo), named("irradiance", &irradiance), named("image", &image)];
    let group = first.group(device, 0, &[&names])?;
    let mut encoder = device.create_command_encoder(&Default::default());
    second.dispatch(&mut encoder, &mut PassTimer::off(), "shade", &[&group], [1, 1, 1]);
    queue.submit([encoder.finish()]);
    let [[r, g, b, _]] = gpu.read::<[f32; 4]>(&image)?[..] else { panic!("one pixel") };
    assert!((r - 0.5).abs() < 1e-6 && (g - 0.25).abs() < 1e-6 && (b - 1.0).abs() < 1e-6, "{r} {g} {b}");
    // A name that is missing is an error that says so.
    let error = first.group(device, 0, &[&names[1..]]).unwrap_err().to_string();
    assert!(error.contains("shade") && error.contains("albedos"), "{error}");
    Ok(())
}
