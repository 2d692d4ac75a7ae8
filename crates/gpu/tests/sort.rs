//! Scans, sorts and compactions on the GPU against their twins, bit for bit.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::sync::OnceLock;

use indirect_core::sort::{compact, exclusive_scan, low_bits, radix_sort_pairs};
use indirect_gpu::shaders::{Module, RADIX_SORT};
use indirect_gpu::wgpu::{Buffer, Limits};
use indirect_gpu::{
    Compact, Context, GpuError, Named, Pass, PassTimer, Pipelines, RadixSort, Scan, SortSizes, named,
    storage_buffer,
};
use proptest::prelude::*;
use testkit::{CpuOutput, GpuOutput, compare_exact};

/// Lengths about those of a thread's run, a workgroup and a block, and many blocks.
const LENGTHS: [usize; 11] = [0, 1, 2, 255, 256, 257, 1000, 2047, 2049, 65_537, 300_000];

/// SplitMix64 (Steele et al. 2014), its upper half.
fn random(seed: u64) -> impl Iterator<Item = u32> {
    (1_u64..).map(move |i| {
        let mut z = seed.wrapping_add(i).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z >> 32) as u32
    })
}

/// The kernels that the properties share.
fn pipelines(gpu: &Context) -> &'static Pipelines {
    static PIPELINES: OnceLock<Pipelines> = OnceLock::new();
    PIPELINES.get_or_init(|| Pipelines::new(&gpu.device))
}

fn buffer(gpu: &Context, data: &[u32]) -> Buffer {
    storage_buffer(&gpu.device, "test", data).unwrap()
}

fn submit(gpu: &Context, pass: &Pass, times: usize) {
    for _ in 0..times {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        pass.encode(&mut encoder, &mut PassTimer::off(), None);
        gpu.queue.submit([encoder.finish()]);
    }
}

fn equal(what: &str, cpu: &[u32], gpu: &[u32]) -> Result<(), String> {
    // An empty comparison is an error there: nothing must differ, so it is right here.
    if cpu.is_empty() && gpu.is_empty() {
        return Ok(());
    }
    let compared = compare_exact(what, CpuOutput(cpu), GpuOutput(gpu), None);
    compared.map(|_| ()).map_err(|e| e.to_string())
}

/// Scans on the GPU both ways: the sums and the sum of all.
fn scan(gpu: &Context, pipelines: &Pipelines, values: &[u32]) -> [(Vec<u32>, u32); 2] {
    let scan = Scan::new(&gpu.device, values.len() as u32).unwrap();
    let total = || gpu.read::<u32>(&scan.buffers.total).unwrap()[0];
    let (source, target) = (buffer(gpu, values), buffer(gpu, &vec![7; values.len()]));
    let read = |b: &Buffer| gpu.read::<u32>(b).unwrap()[..values.len()].to_vec();

    let mut pass = Pass::new("scan");
    scan.encode_into(pipelines, &mut pass, &[named("values", &source), named("scanned", &target)]).unwrap();
    submit(gpu, &pass, 1);
    assert_eq!(read(&source), values);
    let into = (read(&target), total());

    let mut pass = Pass::new("scan");
    scan.encode(pipelines, &mut pass, &[named("values", &source)]).unwrap();
    submit(gpu, &pass, 1);
    [into, (read(&source), total())]
}

fn check_scan(gpu: &Context, pipelines: &Pipelines, values: &[u32]) -> Result<(), String> {
    let mut sums = values.to_vec();
    let total = exclusive_scan(&mut sums);
    for (found, found_total) in scan(gpu, pipelines, values) {
        equal("sums", &sums, &found)?;
        equal("total", &[total], &[found_total])?;
    }
    Ok(())
}

#[test]
fn sums_are_those_of_the_twin() {
    let Some(gpu) = testkit::gpu() else { return };
    let pipelines = pipelines(gpu);
    for n in LENGTHS {
        // They wrap many times.
        let values: Vec<u32> = random(n as u64).take(n).collect();
        check_scan(gpu, pipelines, &values).unwrap();
        check_scan(gpu, pipelines, &vec![1; n]).unwrap();
    }
}

#[test]
fn more_blocks_than_one_workgroup_adds_at_once_are_scanned() {
    let Some(gpu) = testkit::gpu() else { return };
    let pipelines = pipelines(gpu);
    // 4 Mi values are the 2048 blocks of one tile.
    let n = (1 << 22) + 2049;
    let values: Vec<u32> = random(3).take(n).collect();
    check_scan(gpu, pipelines, &values).unwrap();
}

/// What a sort made of its buffers.
#[derive(Debug, PartialEq)]
struct Sorted {
    keys: Vec<u32>,
    payloads: Vec<u32>,
}

/// Sorts the first `count` of the pairs.
fn sort(
    gpu: &Context,
    pipelines: &Pipelines,
    keys: &[u32],
    payloads: &[u32],
    count: u32,
    bits: u32,
) -> Sorted {
    let sort = RadixSort::new(&gpu.device, keys.len() as u32, bits).unwrap();
    let buffers = [keys, payloads, &[count]].map(|data| buffer(gpu, data));
    let list = [named("keys", &buffers[0]), named("payloads", &buffers[1]), named("count", &buffers[2])];
    let mut pass = Pass::new("sort");
    sort.encode(pipelines, &mut pass, &list).unwrap();
    submit(gpu, &pass, 1);
    let read = |b: &Buffer| gpu.read::<u32>(b).unwrap()[..keys.len()].to_vec();
    Sorted { keys: read(&buffers[0]), payloads: read(&buffers[1]) }
}

/// Judges what a sort made of pairs: the twin's order of the first `count`, and the rest as it was.
fn judge(found: &Sorted, keys: &[u32], payloads: &[u32], count: usize, bits: u32) -> Result<(), String> {
    let (mut keys, mut payloads) = (keys.to_vec(), payloads.to_vec());
    let n = count.min(keys.len());
    radix_sort_pairs(&mut keys[..n], &mut payloads[..n], bits);
    equal("keys", &keys, &found.keys)?;
    equal("payloads", &payloads, &found.payloads)
}

/// Keys that sorts get wrong: random, equal, in order, against it, of two values, and with few of one digit in a block.
fn patterns(n: usize, bits: u32) -> [Vec<u32>; 6] {
    let step = (u64::from(low_bits(bits)) + 1) as f64 / n.max(1) as f64;
    let rising = |i: usize| (i as f64 * step) as u32;
    [
        random(u64::from(bits)).take(n).collect(),
        vec![low_bits(bits) / 3; n],
        (0..n).map(rising).collect(),
        (0..n).rev().map(rising).collect(),
        random(9).take(n).map(|r| if r & 1 == 0 { 0 } else { low_bits(bits) }).collect(),
        random(8).take(n).map(|r| if r % 1000 == 0 { r } else { 5 }).collect(),
    ]
}

#[test]
fn pairs_are_in_the_order_of_the_twin() {
    let Some(gpu) = testkit::gpu() else { return };
    let pipelines = pipelines(gpu);
    for n in LENGTHS {
        let payloads: Vec<u32> = random(77).take(n).collect();
        for bits in [0, 1, 4, 8, 13, 20, 32] {
            for (p, keys) in patterns(n, bits).iter().enumerate() {
                // The long ones once with an odd number of digits, once with an even one.
                if n == 300_000 && !(p == 0 || bits == 13 || bits == 20) {
                    continue;
                }
                let found = sort(gpu, pipelines, keys, &payloads, n as u32, bits);
                let judged = judge(&found, keys, &payloads, n, bits);
                assert_eq!(judged, Ok(()), "{n} pairs, {bits} bits, pattern {p}");
            }
        }
    }
}

#[test]
fn only_as_many_pairs_as_are_counted_are_moved() {
    let Some(gpu) = testkit::gpu() else { return };
    let pipelines = pipelines(gpu);
    let capacity = 5000;
    let keys: Vec<u32> = random(1).take(capacity).collect();
    let payloads: Vec<u32> = (0..capacity as u32).collect();
    for bits in [8, 13] {
        for count in [0, 1, 255, 2048, 2049, 4999, 5000, 5001, u32::MAX] {
            let found = sort(gpu, pipelines, &keys, &payloads, count, bits);
            judge(&found, &keys, &payloads, count as usize, bits).unwrap();
        }
    }
}

#[test]
fn the_same_pass_gives_the_same_bits_again() {
    let Some(gpu) = testkit::gpu() else { return };
    let pipelines = pipelines(gpu);
    let keys: Vec<u32> = random(4).take(70_000).map(|r| r % 300).collect();
    let payloads: Vec<u32> = (0..70_000).collect();
    let first = sort(gpu, pipelines, &keys, &payloads, 70_000, 9);
    assert_eq!(first, sort(gpu, pipelines, &keys, &payloads, 70_000, 9));
    // A sort encoded once and run again on what it sorted changes nothing: scratch that was used does not matter.
    let again = RadixSort::new(&gpu.device, 70_000, 9).unwrap();
    let buffers = [&keys[..], &payloads, &[70_000]].map(|data| buffer(gpu, data));
    let list = [named("keys", &buffers[0]), named("payloads", &buffers[1]), named("count", &buffers[2])];
    let mut pass = Pass::new("sort");
    again.encode(pipelines, &mut pass, &list).unwrap();
    submit(gpu, &pass, 3);
    let found = Sorted { keys: gpu.read(&buffers[0]).unwrap(), payloads: gpu.read(&buffers[1]).unwrap() };
    assert_eq!(first, found);
}

#[test]
fn an_unstable_order_is_refused() {
    let (keys, payloads) = ([3, 1, 2, 1, 3, 1], [0, 1, 2, 3, 4, 5]);
    let right = Sorted { keys: vec![1, 1, 1, 2, 3, 3], payloads: vec![1, 3, 5, 2, 0, 4] };
    judge(&right, &keys, &payloads, 6, 2).unwrap();
    // Sorted, but two equal keys have changed places.
    let unstable = Sorted { keys: vec![1, 1, 1, 2, 3, 3], payloads: vec![3, 1, 5, 2, 0, 4] };
    assert!(judge(&unstable, &keys, &payloads, 6, 2).is_err());
    // By a bit too many.
    assert!(judge(&right, &keys, &payloads, 6, 1).is_err());
    // The last pair is none of those counted.
    assert!(judge(&right, &keys, &payloads, 5, 2).is_err());
}

#[test]
fn a_shader_that_turns_equal_keys_around_is_refused() {
    let Some(gpu) = testkit::gpu() else { return };
    // The fault: of 32 threads the last counts as the first.
    let (from, to) = ("let bit = thread % 32u;", "let bit = 31u - thread % 32u;");
    let replaced = |(path, text): &(&'static str, &'static str)| -> (&'static str, &'static str) {
        (path, Box::leak(text.replace(from, to).into_boxed_str()))
    };
    let files: Vec<_> = RADIX_SORT.files.iter().map(replaced).collect();
    assert_ne!(files, RADIX_SORT.files);
    let faulty = Module { files: Box::leak(files.into_boxed_slice()), ..RADIX_SORT };
    let pipelines = Pipelines::new(&gpu.device);
    // The first kernel of a name is that which is kept.
    let _ = pipelines.kernel(&faulty, "sort_scatter");
    let keys: Vec<u32> = random(2).take(1000).map(|r| r % 100).collect();
    let payloads: Vec<u32> = (0..1000).collect();
    let found = sort(gpu, &pipelines, &keys, &payloads, 1000, 7);
    assert!(found.keys.is_sorted());
    assert!(judge(&found, &keys, &payloads, 1000, 7).is_err());
}

/// Several rounds of a compaction into one list: the destinations of each, and the count after all.
fn rounds(
    gpu: &Context,
    pipelines: &Pipelines,
    flags: &[Vec<u32>],
    first: [u32; 2],
    capacity: u32,
) -> (Vec<Vec<u32>>, [u32; 2]) {
    let length = flags[0].len();
    let compact = Compact::new(&gpu.device, length as u32, capacity).unwrap();
    let (round, count) = (buffer(gpu, &flags[0]), buffer(gpu, &first));
    let mut pass = Pass::new("compact");
    compact.encode(pipelines, &mut pass, &[named("flags", &round), named("count", &count)]).unwrap();
    let destinations = flags.iter().map(|flags| {
        gpu.queue.write_buffer(&round, 0, bytemuck::cast_slice(flags));
        submit(gpu, &pass, 1);
        gpu.read::<u32>(&compact.buffers.destinations).unwrap()[..length].to_vec()
    });
    let destinations = destinations.collect();
    (destinations, gpu.read::<u32>(&count).unwrap().try_into().unwrap())
}

#[test]
fn rounds_append_in_order_until_the_list_is_full() {
    let Some(gpu) = testkit::gpu() else { return };
    let pipelines = pipelines(gpu);
    for n in LENGTHS {
        let length = n as u32;
        // Half of four rounds are kept: room for all, for some and for none; and lists that begin with something, or beyond their
        // capacity, and have dropped so many that no more can be counted.
        for (capacity, first) in [
            (4 * length, [0, 0]),
            (length / 4 * 5, [3, 2]),
            (0, [0, 0]),
            (length / 2, [length, u32::MAX - 5]),
        ] {
            let round = |r: u64| random(r + 10).take(n).map(|bits| (bits & 1) * (1 + (bits >> 5))).collect();
            let flags: Vec<Vec<u32>> = (0..4).map(round).collect();
            let (found, count) = rounds(gpu, pipelines, &flags, first, capacity);
            let mut twin = first;
            for (flags, found) in flags.iter().zip(&found) {
                equal("destinations", &compact(flags, &mut twin, capacity), found).unwrap();
            }
            assert_eq!(twin, count, "{n} flags, room for {capacity}");
        }
    }
}

#[test]
fn what_is_kept_lies_in_the_list_once_and_in_order() {
    // The twin itself against what filters of the standard library say.
    let flags: Vec<u32> = random(6).take(1000).map(|r| r % 3 / 2).collect();
    let (capacity, mut count) = (250, [20, 0]);
    let destinations = compact(&flags, &mut count, capacity);
    let mut list = vec![u32::MAX; 250];
    for (i, at) in destinations.iter().enumerate().filter(|(_, at)| **at < capacity) {
        list[*at as usize] = i as u32;
    }
    let kept: Vec<u32> = (0..1000).filter(|i| flags[*i as usize] != 0).collect();
    assert_eq!(list[20..], kept[..230]);
    assert!(list[..20].iter().all(|i| *i == u32::MAX));
    assert_eq!(count, [capacity, kept.len() as u32 - 230]);
}

#[test]
fn what_is_missing_or_too_large_is_said() {
    let Some(gpu) = testkit::gpu() else { return };
    let pipelines = pipelines(gpu);
    let unbound = |found: Result<(), GpuError>, name: &str| match found {
        Err(GpuError::Unbound { name: found, .. }) => assert_eq!(found, name),
        other => panic!("{other:?}"),
    };
    let words = buffer(gpu, &[0; 16]);
    let all = |names: &[&'static str]| -> Vec<Named<'_>> { names.iter().map(|n| named(n, &words)).collect() };
    let mut pass = Pass::new("none");
    let sort = RadixSort::new(&gpu.device, 16, 8).unwrap();
    unbound(sort.encode(pipelines, &mut pass, &all(&["keys", "count"])), "payloads");
    unbound(sort.encode(pipelines, &mut pass, &all(&["keys", "payloads"])), "count");
    let compact = Compact::new(&gpu.device, 16, 16).unwrap();
    unbound(compact.encode(pipelines, &mut pass, &all(&["count"])), "flags");
    let scan = Scan::new(&gpu.device, 16).unwrap();
    unbound(scan.encode_into(pipelines, &mut pass, &all(&["values"])), "scanned");

    let limits = Limits::default();
    // WebGPU's default of 128 MiB is 2²⁵ values.
    Scan::plan(1 << 25).check(&limits).unwrap();
    RadixSort::plan(&SortSizes::new(1 << 25, 32)).check(&limits).unwrap();
    Compact::plan(1 << 25, 1 << 31).check(&limits).unwrap();
    assert!(Scan::plan(1 << 33).check(&limits).is_err());
    assert!(RadixSort::plan(&SortSizes::new((1 << 25) + 1, 32)).check(&limits).is_err());
    assert!(Compact::plan(1 << 20, u32::MAX.into()).check(&limits).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_pairs_are_sorted(
        pairs in prop::collection::vec((any::<u32>(), any::<u32>()), 0..600),
        count in 0_u32..700,
        bits in 0_u32..40,
        few in any::<bool>(),
    ) {
        let Some(gpu) = testkit::gpu() else { return Ok(()) };
        // Few keys repeat often.
        let keys: Vec<u32> = pairs.iter().map(|p| if few { p.0 % 7 } else { p.0 }).collect();
        let payloads: Vec<u32> = pairs.iter().map(|p| p.1).collect();
        let found = sort(gpu, pipelines(gpu), &keys, &payloads, count, bits);
        prop_assert_eq!(judge(&found, &keys, &payloads, count as usize, bits), Ok(()));
    }

    #[test]
    fn any_flags_are_compacted(
        flags in prop::collection::vec(0_u32..3, 1..600),
        first in 0_u32..700,
        capacity in 0_u32..700,
    ) {
        let Some(gpu) = testkit::gpu() else { return Ok(()) };
        let (found, count) =
            rounds(gpu, pipelines(gpu), &[flags.clone(), flags.clone()], [first, 0], capacity);
        let mut twin = [first, 0];
        for found in found {
            prop_assert_eq!(equal("destinations", &compact(&flags, &mut twin, capacity), &found), Ok(()));
        }
        prop_assert_eq!(twin, count);
    }
}
