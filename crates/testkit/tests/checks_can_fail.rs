//! The checks themselves: each must refuse what it is there to refuse.

use glam::Vec3;
use indirect_core::layout::{Field, Number};
use indirect_gpu::shaders::{Module, VIEW};
use testkit::layout::{check_constant, check_fields, check_workgroup_size};
use testkit::{CompareError, CpuOutput, GpuOutput, Tolerance, compare, compare_exact};

const N: usize = 4096;

fn values() -> Vec<Vec3> {
    (0..N).map(|i| Vec3::new(1.0, (i as f32 * 0.37).sin(), 1e-9) * (1.0 + i as f32)).collect()
}

fn judge(cpu: &[Vec3], gpu: &[Vec3], mask: Option<&[bool]>) -> Result<testkit::Comparison, CompareError> {
    compare("test", CpuOutput(cpu), GpuOutput(gpu), Tolerance::TWINS, mask)
}

#[test]
fn equal_results_pass() {
    let c = judge(&values(), &values(), None).unwrap();
    assert_eq!((c.compared, c.masked, c.breaches, c.max, c.p999), (N, 0, 0, 0.0, 0.0));
    assert!(c.worst.is_empty());
}

#[test]
fn one_perturbed_component_is_found_wherever_it_is() {
    let cpu = values();
    for index in [0, 1, N / 2, N - 1] {
        for axis in 0..3 {
            let mut gpu = cpu.clone();
            gpu[index][axis] += 2e-4 * cpu[index].length();
            let Err(CompareError::Breach(c)) = judge(&cpu, &gpu, None) else { panic!("passed") };
            assert_eq!((c.breaches, c.worst[0].index, c.p999), (1, index, 0.0));
            assert!(c.max > 1e-4 && c.max < 4e-4);
            // Just inside the tolerance it passes, and is still reported.
            gpu[index] = cpu[index] * (1.0 + 5e-5);
            let c = judge(&cpu, &gpu, None).unwrap();
            assert!(c.max > 2e-5 && c.worst[0].index == index);
        }
    }
}

#[test]
fn what_is_not_finite_never_passes() {
    for bad in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut poisoned = values();
        poisoned[7].y = bad;
        for (cpu, gpu) in [(&poisoned, &values()), (&values(), &poisoned), (&poisoned, &poisoned)] {
            let Err(CompareError::Breach(c)) = judge(cpu, gpu, None) else { panic!("{bad} passed") };
            assert_eq!((c.breaches, c.worst[0].index), (1, 7));
            assert!(c.max.is_nan());
        }
    }
}

#[test]
fn small_values_have_the_absolute_tolerance_only() {
    let judge =
        |cpu: f32, gpu: f32| compare("small", CpuOutput(&[cpu]), GpuOutput(&[gpu]), Tolerance::TWINS, None);
    assert!(judge(0.0, 0.9e-6).is_ok());
    assert!(judge(0.0, 1.1e-6).is_err());
    assert!(judge(1.0, 1.0 + 0.9e-4).is_ok());
    assert!(judge(1.0, 1.0 + 1.1e-4).is_err());
}

#[test]
fn lengths_and_emptiness_are_refused() {
    let all = values();
    assert!(matches!(judge(&all, &all[1..], None), Err(CompareError::Length { cpu: N, .. })));
    assert!(matches!(judge(&all, &all, Some(&[true])), Err(CompareError::Length { mask: Some(1), .. })));
    assert!(matches!(judge(&[], &[], None), Err(CompareError::Empty { .. })));
    assert!(matches!(judge(&all, &all, Some(&[false; N])), Err(CompareError::Empty { .. })));
}

#[test]
fn the_mask_is_counted_and_hides_nothing_else() {
    let cpu = values();
    let mut gpu = cpu.clone();
    gpu[3] = Vec3::ZERO;
    let mut mask = vec![true; N];
    mask[3] = false;
    let c = judge(&cpu, &gpu, Some(&mask)).unwrap();
    assert_eq!((c.compared, c.masked), (N - 1, 1));
    gpu[4] = Vec3::ZERO;
    assert!(judge(&cpu, &gpu, Some(&mask)).is_err());
}

#[test]
fn the_percentile_allows_one_in_a_thousand() {
    let cpu = vec![1.0_f32; 2000];
    let mut gpu = cpu.clone();
    gpu[5] = 2.0;
    gpu[6] = 2.0;
    let breach = |gpu: &[f32]| match compare("p", CpuOutput(&cpu), GpuOutput(gpu), Tolerance::TWINS, None) {
        Err(CompareError::Breach(c)) => c,
        other => panic!("{other:?}"),
    };
    assert_eq!(breach(&gpu).p999, 0.0);
    gpu[7] = 2.0;
    assert!(breach(&gpu).p999 > 0.9);
}

#[test]
fn integers_must_be_equal() {
    let cpu: Vec<u32> = (0..100).collect();
    let mut gpu = cpu.clone();
    let judge = |gpu: &[u32]| compare_exact("ids", CpuOutput(&cpu), GpuOutput(gpu), None);
    assert!(judge(&gpu).is_ok());
    gpu[99] ^= 1;
    let Err(CompareError::Breach(c)) = judge(&gpu) else { panic!("passed") };
    assert_eq!((c.breaches, c.worst[0].index), (1, 99));
    assert!(judge(&[]).is_err());
}

const SAMPLE: Module = Module {
    name: "sample",
    files: &[(
        "sample.wgsl",
        "struct S { a: vec3<f32>, b: u32, c: vec2<f32> }
         const LIMIT: u32 = 7u;
         @group(0) @binding(0) var<uniform> s: S;
         @compute @workgroup_size(8, 4) fn main() { let x = s.b + LIMIT; }",
    )],
    entry_points: &["main"],
};

#[test]
fn layouts_that_differ_are_refused() {
    let of = |fields: &[(&'static str, usize, usize)]| -> Vec<Field> {
        let field = |(name, offset, size): &(&'static str, usize, usize)| Field {
            name,
            offset: *offset,
            size: *size,
            number: Number::F32,
        };
        fields.iter().map(field).collect()
    };
    let right = [("a", 0, 12), ("b", 12, 4), ("c", 16, 8)];
    let right = of(&right);
    check_fields(&SAMPLE, "S", 32, &right).unwrap();
    // What only pads may be missing in the shader; what does not may not.
    let more = |name| Field { name, offset: 24, size: 8, number: Number::F32 };
    check_fields(&SAMPLE, "S", 32, &[&right[..], &[more("pad0")]].concat()).unwrap();
    assert!(check_fields(&SAMPLE, "S", 32, &[&right[..], &[more("more")]].concat()).is_err());
    let wrong_name = [("a", 0, 12), ("x", 12, 4), ("c", 16, 8)];
    let swapped = [("b", 12, 4), ("a", 0, 12), ("c", 16, 8)];
    let wrong_offset = [("a", 0, 12), ("b", 16, 4), ("c", 24, 8)];
    let wrong_size = [("a", 0, 16), ("b", 12, 4), ("c", 16, 8)];
    for fields in [wrong_name, swapped, wrong_offset, wrong_size] {
        assert!(check_fields(&SAMPLE, "S", 32, &of(&fields)).is_err(), "{fields:?}");
    }
    assert!(check_fields(&SAMPLE, "S", 32, &right[..2]).is_err());
    assert!(check_fields(&SAMPLE, "S", 24, &right).is_err());
    assert!(check_fields(&SAMPLE, "T", 32, &right).is_err());
    assert!(check_fields(&VIEW, "S", 32, &right).is_err());
}

#[test]
fn constants_and_workgroups_that_differ_are_refused() {
    check_constant(&SAMPLE, "LIMIT", 7_u32).unwrap();
    assert!(check_constant(&SAMPLE, "LIMIT", 8_u32).is_err());
    assert!(check_constant(&SAMPLE, "LIMIT", 7_i32).is_err());
    assert!(check_constant(&SAMPLE, "OTHER", 7_u32).is_err());
    check_workgroup_size(&SAMPLE, "main", [8, 4, 1]).unwrap();
    assert!(check_workgroup_size(&SAMPLE, "main", [8, 8, 1]).is_err());
    assert!(check_workgroup_size(&SAMPLE, "other", [8, 4, 1]).is_err());
}
