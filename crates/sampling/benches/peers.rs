//! Sequences and warps beside their peers, in one run.
//!
//! One iteration draws 4096 samples; divide by that for the time of one.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec2;
use indirect_sampling::{
    discrete::{AliasTable, RowCdf},
    halton::{Halton, Scrambling},
    mapping,
    radical::radical_inverse,
    rng::{pcg_hash, philox4x32, unit_f32},
    sobol,
    warp::{Empty, Pyramid, Sample},
};

const SAMPLES: u32 = 4096;

fn sequences(c: &mut Criterion) {
    let mut group = c.benchmark_group("sobol_2d");
    group.throughput(Throughput::Elements(SAMPLES.into()));
    group.bench_function("ours, index by index", |b| {
        b.iter(|| (0..SAMPLES).map(|i| sobol::sample_2d(i, black_box(7))).sum::<Vec2>());
    });
    group.bench_function("ours, seed by seed", |b| {
        b.iter(|| (0..SAMPLES).map(|s| sobol::sample_2d(black_box(7), s)).sum::<Vec2>());
    });
    group.bench_function("sobol_burley, index by index", |b| {
        let at = |i, d| sobol_burley::sample(i, d, black_box(7));
        b.iter(|| (0..SAMPLES).map(|i| Vec2::new(at(i, 0), at(i, 1))).sum::<Vec2>());
    });
    group.bench_function("sobol_burley 4-D, index by index", |b| {
        b.iter(|| {
            (0..SAMPLES)
                .map(|i| sobol_burley::sample_4d(i, 0, black_box(7)))
                .fold([0.0; 4], |s, p| [0, 1, 2, 3].map(|k| s[k] + p[k]))
        });
    });
    group.finish();

    for (base, dimension) in [(2_u8, 0), (3, 1), (59, 16)] {
        let mut group = c.benchmark_group(format!("halton base {base}"));
        group.throughput(Throughput::Elements(SAMPLES.into()));
        let plain = Halton::dimension(dimension, Scrambling::None);
        let owen = Halton::dimension(dimension, Scrambling::Owen(1));
        group.bench_function("ours, iterator", |b| {
            b.iter(|| plain.iter(0, 1).take(SAMPLES as usize).sum::<f32>())
        });
        group.bench_function("ours, iterator, Owen", |b| {
            b.iter(|| owen.iter(0, 1).take(SAMPLES as usize).sum::<f32>())
        });
        group.bench_function("ours, any index", |b| {
            b.iter(|| (0..SAMPLES).map(|i| plain.sample(i.into())).sum::<f32>())
        });
        group.bench_function("ours, any index, Owen", |b| {
            b.iter(|| (0..SAMPLES).map(|i| owen.sample(i.into())).sum::<f32>())
        });
        group.bench_function("ours, exact fraction of any index", |b| {
            b.iter(|| {
                (0..SAMPLES).map(|i| radical_inverse(black_box(base).into(), i.into()).to_f32()).sum::<f32>()
            });
        });
        group.bench_function("halton, iterator", |b| {
            b.iter(|| halton::Sequence::new(base).take(SAMPLES as usize).sum::<f64>())
        });
        group.bench_function("halton, any index", |b| {
            b.iter(|| (0..SAMPLES as usize).map(|i| halton::number(black_box(base), i)).sum::<f64>())
        });
        group.finish();
    }
}

fn warps(c: &mut Criterion) {
    let points: Vec<Vec2> = (0..SAMPLES).map(|i| sobol::sample_2d(i, 3)).collect();
    for side in [64_u32, 512] {
        let image: Vec<f32> = (0..side * side).map(|i| unit_f32(pcg_hash(i))).collect();
        let size = [side; 2];
        let (Ok(pyramid), Ok(alias), Ok(cdf)) =
            (Pyramid::build(size, &image), AliasTable::build(size, &image), RowCdf::build(size, &image))
        else {
            return;
        };
        let Ok(warp) = pyramid.warp(Empty::Error) else { return };
        let mut group = c.benchmark_group(format!("warp {side}²"));
        group.throughput(Throughput::Elements(SAMPLES.into()));
        group.bench_function("hierarchical", |b| {
            b.iter(|| points.iter().map(|u| warp.sample(*u).pdf).sum::<f32>())
        });
        let mut samples = vec![Sample::default(); points.len()];
        group.bench_function("hierarchical, in batches", |b| {
            b.iter(|| {
                warp.sample_batch(&points, &mut samples).map(|()| samples.iter().map(|s| s.pdf).sum::<f32>())
            })
        });
        group.bench_function("alias table", |b| {
            b.iter(|| points.iter().map(|u| alias.sample(*u).pdf).sum::<f32>())
        });
        group
            .bench_function("row CDF", |b| b.iter(|| points.iter().map(|u| cdf.sample(*u).pdf).sum::<f32>()));
        group.finish();
        let mut group = c.benchmark_group(format!("build {side}²"));
        group.bench_function("pyramid", |b| b.iter(|| Pyramid::build(size, black_box(&image))));
        group.bench_function("alias table", |b| b.iter(|| AliasTable::build(size, black_box(&image))));
        group.bench_function("row CDF", |b| b.iter(|| RowCdf::build(size, black_box(&image))));
        group.finish();
    }
}

fn others(c: &mut Criterion) {
    let points: Vec<Vec2> = (0..SAMPLES).map(|i| sobol::sample_2d(i, 3)).collect();
    let mut group = c.benchmark_group("others");
    group.throughput(Throughput::Elements(SAMPLES.into()));
    group.bench_function("pcg_hash", |b| b.iter(|| (0..SAMPLES).fold(0, |s, i| s ^ pcg_hash(black_box(i)))));
    group.bench_function("philox4x32", |b| {
        b.iter(|| (0..SAMPLES).fold(0, |s, i| s ^ philox4x32([i, 0, 0, 0], [1, 2])[0]))
    });
    group.bench_function("hemisphere_cosine", |b| {
        b.iter(|| points.iter().map(|u| mapping::hemisphere_cosine(*u)).sum::<glam::Vec3>());
    });
    group.bench_function("triangle_uniform", |b| {
        b.iter(|| points.iter().map(|u| mapping::triangle_uniform(*u)).sum::<Vec2>())
    });
    group.bench_function("phong_lobe", |b| {
        b.iter(|| points.iter().map(|u| mapping::phong_lobe(*u, 20.0)).sum::<glam::Vec3>())
    });
    group.finish();
}

criterion_group!(benches, sequences, warps, others);
criterion_main!(benches);
