//! `sampling/*.wgsl` against `indirect_sampling`: integers equal, floats within the twins' tolerance.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3, Vec4};
use indirect_gpu::shaders::{HALTON, MAPPING, Module, SOBOL};
use indirect_sampling::{
    halton::{Halton, PRIMES, Scrambling},
    mapping, rng, sobol,
    warp::{Empty, Pyramid},
};
use testkit::{CpuOutput, GpuOutput, Tolerance, compare, compare_exact};

const HEADER: &str = "
    @group(0) @binding(0) var<storage, read> inputs: array<vec4<u32>>;
    @group(0) @binding(1) var<storage, read_write> outputs: array<vec4<u32>>;
";

/// Indices and seeds, the ends of their range among them.
fn words() -> Vec<[u32; 4]> {
    let edges = [0, 1, 2, 255, 0x7FFF_FFFF, 0x8000_0000, u32::MAX - 1, u32::MAX];
    let mut words: Vec<_> = edges.iter().flat_map(|&a| edges.map(|b| [a, b, b, a])).collect();
    words.extend((0..10_000).map(|i| rng::philox4x32([i, 0, 0, 0], [3, 0])));
    words
}

#[test]
fn hashes_and_sobol_are_equal_as_integers() {
    const TEST: Module = Module {
        name: "sampling integers",
        files: &[
            SOBOL.files[0],
            SOBOL.files[1],
            ("header", HEADER),
            (
                "main",
                "@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
                    if id.x >= arrayLength(&inputs) { return; }
                    let v = inputs[id.x];
                    let p = sobol_2d(v.x, v.y);
                    outputs[3u * id.x] = philox4x32(v, v.yx);
                    outputs[3u * id.x + 1u] = vec4(pcg_hash(v.x), hash_combine(v.x, v.y), sobol_bits_2d(v.x, v.y));
                    outputs[3u * id.x + 2u] =
                        vec4(bitcast<u32>(p.x), bitcast<u32>(p.y), bitcast<u32>(sobol_1d(v.x, v.y)), bitcast<u32>(unit_f32(v.x)));
                }",
            ),
        ],
        entry_points: &["main"],
    };
    let Some(gpu) = testkit::gpu() else { return };
    let words = words();
    let found: Vec<[u32; 4]> = gpu.run(&TEST, "main", &words, 3 * words.len()).unwrap();
    let expected: Vec<[u32; 4]> = words
        .iter()
        .flat_map(|&v| {
            let [a, b, ..] = v;
            let ([x, y], p) = (sobol::bits_2d(a, b), sobol::sample_2d(a, b));
            [
                rng::philox4x32(v, [b, a]),
                [rng::pcg_hash(a), rng::hash_combine(a, b), x, y],
                [p.x, p.y, sobol::sample_1d(a, b), rng::unit_f32(a)].map(f32::to_bits),
            ]
        })
        .collect();
    compare_exact("hashes and Sobol'", CpuOutput(&expected), GpuOutput(&found), None).unwrap();
}

#[test]
fn halton_is_equal_as_integers() {
    const TEST: Module = Module {
        name: "halton",
        files: &[
            HALTON.files[0],
            ("header", HEADER),
            (
                "main",
                "@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
                    if id.x >= arrayLength(&inputs) { return; }
                    let v = inputs[id.x];
                    outputs[id.x] = vec4(radical_inverse(v.x, v.y, v.z == 1u), bitcast<u32>(halton(v.x, v.y, v.z == 1u)), 0u);
                }",
            ),
        ],
        entry_points: &["main"],
    };
    let Some(gpu) = testkit::gpu() else { return };
    let mut inputs = vec![];
    for &base in PRIMES.iter().step_by(5) {
        for [random, ..] in words().into_iter().take(300) {
            let limit = u32::MAX / u32::from(base);
            inputs.extend([0, 1].map(|faure| [u32::from(base), random % limit, faure, 0]));
        }
    }
    let found: Vec<[u32; 4]> = gpu.run(&TEST, "main", &inputs, inputs.len()).unwrap();
    let sequences: Vec<_> = (0..PRIMES.len())
        .map(|d| [Scrambling::None, Scrambling::Faure].map(|s| Halton::dimension(d, s)))
        .collect();
    let cpu: Vec<_> = inputs
        .iter()
        .map(|v| {
            let dimension = PRIMES.iter().position(|p| u32::from(*p) == v[0]).unwrap();
            sequences[dimension][v[2] as usize].fraction(u64::from(v[1]))
        })
        .collect();
    // The GPU leaves trailing zeros away. Brought to its denominator, numerators are equal.
    let numerators: Vec<u128> =
        cpu.iter().zip(&found).map(|(f, g)| f.numerator() * u128::from(g[1]) / f.denominator()).collect();
    let exact: Vec<u128> = found.iter().map(|g| u128::from(g[0])).collect();
    compare_exact("radical inverses", CpuOutput(&numerators), GpuOutput(&exact), None).unwrap();
    for (f, g) in cpu.iter().zip(&found) {
        assert_eq!(f.numerator() * u128::from(g[1]) % f.denominator(), 0, "{f:?} {g:?}");
    }
    let floats: Vec<f32> = cpu.iter().map(|f| f.to_f32()).collect();
    let found: Vec<f32> = found.iter().map(|g| f32::from_bits(g[2])).collect();
    // Two conversions and a quotient of 2.5 ulp.
    let tolerance = Tolerance { relative: 5e-7, absolute: 0.0 };
    compare("radical inverses as floats", CpuOutput(&floats), GpuOutput(&found), tolerance, None).unwrap();
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Mapped {
    disc_triangle: [f32; 4],
    directions: [[f32; 4]; 5],
}

#[test]
fn mappings_agree() {
    const TEST: Module = Module {
        name: "mappings",
        files: &[
            MAPPING.files[0],
            (
                "main",
                "struct Mapped { disc_triangle: vec4<f32>, directions: array<vec4<f32>, 5> }
                @group(0) @binding(0) var<storage, read> inputs: array<vec4<f32>>;
                @group(0) @binding(1) var<storage, read_write> outputs: array<Mapped>;
                @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
                    if id.x >= arrayLength(&inputs) { return; }
                    let u = inputs[id.x].xy;
                    let c = hemisphere_cosine(u);
                    let k = cone_uniform(u, inputs[id.x].z);
                    let p = phong_lobe(u, inputs[id.x].w);
                    outputs[id.x] = Mapped(vec4(disc_concentric(u), triangle_uniform(u)), array<vec4<f32>, 5>(
                        vec4(c, hemisphere_cosine_pdf(c)), vec4(hemisphere_uniform(u), 0.0), vec4(sphere_uniform(u), 0.0),
                        vec4(k, cone_uniform_pdf(k, inputs[id.x].z)), vec4(p, phong_lobe_pdf(p, inputs[id.x].w))));
                }",
            ),
        ],
        entry_points: &["main"],
    };
    let Some(gpu) = testkit::gpu() else { return };
    let mut points: Vec<Vec2> = (0..10_000).map(|i| sobol::sample_2d(i, 5)).collect();
    let edges = [0.0, 0.25, 0.5, 0.75, 1.0 - f32::EPSILON / 2.0];
    points.extend(edges.iter().flat_map(|&x| edges.map(|y| Vec2::new(x, y))));
    let inputs: Vec<Vec4> = (0..)
        .zip(&points)
        .map(|(i, u)| u.extend([0.01, 0.5, 1.9][i % 3]).extend([0.0, 5.0, 40.0][i % 3]))
        .collect();
    let raw: Vec<[f32; 4]> = inputs.iter().map(Vec4::to_array).collect();
    let found: Vec<Mapped> = gpu.run(&TEST, "main", &raw, raw.len()).unwrap();
    let cpu: Vec<Vec4> = points
        .iter()
        .map(|&u| {
            let (d, t) = (mapping::disc_concentric(u), mapping::triangle_uniform(u));
            Vec4::new(d.x, d.y, t.x, t.y)
        })
        .collect();
    let gpu: Vec<Vec4> = found.iter().map(|m| m.disc_triangle.into()).collect();
    compare("disc and triangle", CpuOutput(&cpu), GpuOutput(&gpu), Tolerance::TWINS, None).unwrap();
    type Direction<'a> = (&'a str, &'a dyn Fn(Vec2, Vec4) -> (Vec3, f32));
    let directions: [Direction<'_>; 5] = [
        ("cosine", &|u, _| {
            let d = mapping::hemisphere_cosine(u);
            (d, mapping::hemisphere_cosine_pdf(d))
        }),
        ("hemisphere", &|u, _| (mapping::hemisphere_uniform(u), 0.0)),
        ("sphere", &|u, _| (mapping::sphere_uniform(u), 0.0)),
        ("cone", &|u, v| {
            let d = mapping::cone_uniform(u, v.z);
            (d, mapping::cone_uniform_pdf(d, v.z))
        }),
        ("phong", &|u, v| {
            let d = mapping::phong_lobe(u, v.w);
            (d, mapping::phong_lobe_pdf(d, v.w))
        }),
    ];
    for (i, (name, direction)) in directions.iter().enumerate() {
        let expected: Vec<(Vec3, f32)> = inputs.iter().map(|v| direction(Vec2::new(v.x, v.y), *v)).collect();
        let cpu: Vec<Vec3> = expected.iter().map(|e| e.0).collect();
        let gpu: Vec<Vec3> = found.iter().map(|m| Vec4::from(m.directions[i]).truncate()).collect();
        // A sine taken from a cosine near 1 loses half of the digits: 1 − 2⁻²⁴ has the sine 3.5e-4. Only the lobe does so.
        let absolute = if *name == "phong" { 1e-3 } else { 1e-6 };
        compare(name, CpuOutput(&cpu), GpuOutput(&gpu), Tolerance { relative: 1e-4, absolute }, None)
            .unwrap();
        let cpu: Vec<f32> = expected.iter().map(|e| e.1).collect();
        let gpu: Vec<f32> = found.iter().map(|m| m.directions[i][3]).collect();
        // The narrowest cone's border lies within an ulp of cosine, on one side of it or the other.
        let mask: Vec<bool> = inputs
            .iter()
            .map(|v| *name != "cone" || (v.x - 0.5).abs().max((v.y - 0.5).abs()) < 0.499)
            .collect();
        compare(name, CpuOutput(&cpu), GpuOutput(&gpu), Tolerance::TWINS, Some(&mask)).unwrap();
    }
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Warped {
    point: [f32; 2],
    pdf: f32,
    pad: f32,
    texel: [u32; 2],
    pad2: [u32; 2],
}

#[test]
fn warps_agree() {
    const TEST: Module = Module {
        name: "warp",
        files: &[
            ("sampling/warp.wgsl", include_str!("../../../shaders/wgsl/sampling/warp.wgsl")),
            (
                "main",
                "struct Warped { point: vec2<f32>, pdf: f32, pad: f32, texel: vec2<u32>, pad2: vec2<u32> }
                // A point, an element of the levels, and in the first input the size.
                @group(0) @binding(0) var<storage, read> inputs: array<vec4<f32>>;
                @group(0) @binding(1) var<storage, read_write> outputs: array<Warped>;
                fn warp_weight(i: u32) -> f32 { return inputs[i].z; }
                @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
                    if id.x >= arrayLength(&inputs) { return; }
                    let s = warp_sample(inputs[id.x].xy, vec2(u32(inputs[0].w), u32(inputs[1].w)));
                    outputs[id.x] = Warped(s.point, s.pdf, 0.0, s.texel, vec2(0u));
                }",
            ),
        ],
        entry_points: &["main"],
    };
    let Some(gpu) = testkit::gpu() else { return };
    let value = |i: u32| rng::unit_f32(rng::pcg_hash(i));
    type Map<'a> = (&'a str, [u32; 2], &'a dyn Fn(u32) -> f32);
    let maps: [Map<'_>; 6] = [
        ("noise", [61, 37], &value),
        ("one lit texel", [64, 64], &|i| f32::from(i == 1234)),
        ("zero quads", [33, 65], &|i| if (i / 2) % 2 == 0 { 0.0 } else { value(i) }),
        ("NaN texels", [32, 32], &|i| if i % 5 == 0 { f32::NAN } else { value(i) }),
        ("nothing", [19, 5], &|_| 0.0),
        ("one texel", [1, 1], &|_| 2.0),
    ];
    for (name, size, value) in maps {
        let values: Vec<f32> = (0..size[0] * size[1]).map(value).collect();
        let built = Pyramid::build(size, &values).unwrap();
        // The levels as a GPU may make them: level 0 with what does not count still in it.
        let levels: Vec<f32> = values.iter().chain(&built.levels()[values.len()..]).copied().collect();
        let pyramid = Pyramid::from_levels(size, levels).unwrap();
        let warp = pyramid.warp(Empty::Uniform).unwrap();
        let points: Vec<Vec2> = (0..20_000).map(|i| sobol::sample_2d(i, 9)).collect();
        let inputs: Vec<[f32; 4]> = (0..points.len())
            .map(|i| {
                let level = pyramid.levels().get(i).copied().unwrap_or(0.0);
                [points[i].x, points[i].y, level, if i < 2 { size[i] as f32 } else { 0.0 }]
            })
            .collect();
        let found: Vec<Warped> = gpu.run(&TEST, "main", &inputs, inputs.len()).unwrap();
        let expected: Vec<_> = points.iter().map(|&u| warp.sample(u)).collect();
        // A quotient of 2.5 ulp may carry a point across the border of two parts: where texels differ nothing else can be
        // compared. Six levels of such errors, each stretched by those above it, stay below 2⁻¹⁴ of the points per axis.
        let same: Vec<bool> = expected.iter().zip(&found).map(|(e, f)| e.texel == f.texel).collect();
        let differing = same.iter().filter(|s| !**s).count();
        assert!(differing <= points.len() >> 13, "{name}: {differing} texels differ");
        let cpu: Vec<Vec2> = expected.iter().map(|s| s.point).collect();
        let gpu_points: Vec<Vec2> = found.iter().map(|s| s.point.into()).collect();
        compare(
            name,
            CpuOutput(&cpu),
            GpuOutput(&gpu_points),
            Tolerance { relative: 1e-4, absolute: 1e-4 },
            Some(&same),
        )
        .unwrap();
        let cpu: Vec<f32> = expected.iter().map(|s| s.pdf).collect();
        let gpu_pdfs: Vec<f32> = found.iter().map(|s| s.pdf).collect();
        compare(name, CpuOutput(&cpu), GpuOutput(&gpu_pdfs), Tolerance::TWINS, Some(&same)).unwrap();
        for (f, ok) in found.iter().zip(&same) {
            assert!(
                !ok || (f.point[0] < (f.texel[0] + 1) as f32 && f.point[1] < (f.texel[1] + 1) as f32),
                "{name}"
            );
        }
    }
}
