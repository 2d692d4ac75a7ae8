//! Cost per direction or per vector. `xtask/peers/sphericart_eval.py` runs `sphericart` on the same directions.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{DMat3, DQuat, Vec3, Vec3A, Vec4};
use sh_math::{
    Mean, Quadrature, Rotation, Sh, Value, Zonal, basis, basis_and_gradient, basis_batch, basis_by_recurrence,
};

/// Few enough for the first-level cache at `l ≤ 4`, as many as the peer's batch.
const DIRECTIONS: usize = 1024;

fn directions() -> Vec<[f32; 3]> {
    let golden = core::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
    (0..DIRECTIONS)
        .map(|i| {
            let z = 1.0 - (2 * i + 1) as f32 / DIRECTIONS as f32;
            let (r, phi) = ((1.0 - z * z).sqrt(), golden * i as f32);
            [r * phi.cos(), r * phi.sin(), z]
        })
        .collect()
}

fn evaluation<const N: usize>(c: &mut Criterion) {
    let l = Sh::<N>::BANDS - 1;
    let directions = directions();
    let mut group = c.benchmark_group(format!("basis, l <= {l}"));
    group.throughput(Throughput::Elements(DIRECTIONS as u64));
    let mut rows = vec![[0.0_f32; N]; DIRECTIONS];
    group.bench_function("f32", |b| b.iter(|| basis_batch(black_box(&directions), &mut rows)));
    let wide: Vec<[f64; 3]> = directions.iter().map(|d| d.map(f64::from)).collect();
    let mut wide_rows = vec![[0.0_f64; N]; DIRECTIONS];
    group.bench_function("f64", |b| b.iter(|| basis_batch(black_box(&wide), &mut wide_rows)));
    group.bench_function("recurrence", |b| {
        b.iter(|| {
            for (row, d) in rows.iter_mut().zip(black_box(&directions)) {
                *row = basis_by_recurrence::<N, f32>(*d);
            }
        });
    });
    group.bench_function("with gradient", |b| {
        b.iter(|| {
            for d in black_box(&directions) {
                black_box(basis_and_gradient::<N, f32>(*d));
            }
        });
    });
    group.finish();
}

/// Which layout of RGB coefficients evaluates fastest?
fn layouts(c: &mut Criterion) {
    let directions = directions();
    let mut group = c.benchmark_group("irradiance, RGB, l <= 2");
    group.throughput(Throughput::Elements(DIRECTIONS as u64));
    fn interleaved<T: Value<Scalar = f32> + 'static>(directions: &[[f32; 3]], one: T) -> impl FnMut() + '_ {
        let sh: Sh<9, T> = Sh(core::array::from_fn(|i| one * (1.0 + i as f32)));
        move || {
            for d in black_box(directions) {
                black_box(black_box(&sh).irradiance(*d));
            }
        }
    }
    group.bench_function("Vec3", |b| b.iter(interleaved(&directions, Vec3::ONE)));
    group.bench_function("Vec3A", |b| b.iter(interleaved(&directions, Vec3A::ONE)));
    group.bench_function("Vec4", |b| b.iter(interleaved(&directions, Vec4::ONE)));
    let planes = [1.0, 2.0, 3.0].map(|s| Sh::<9>(core::array::from_fn(|i| s * (1.0 + i as f32))));
    group.bench_function("three planes", |b| {
        b.iter(|| {
            for d in black_box(&directions) {
                let lobe = Zonal::clamped_cosine().toward(*d);
                black_box(black_box(&planes).each_ref().map(|p| p.dot(&lobe)));
            }
        });
    });
    group.finish();
}

/// The rotation matrix as its definition has it, `∫ Y_i(Rω) Y_j(ω)`, by exact quadrature: the baseline.
fn naive_rotation<const N: usize>(m: &DMat3) -> Vec<[f64; N]> {
    let mut rows = vec![[0.0; N]; N];
    Quadrature::new(2 * (Sh::<N>::BANDS - 1)).for_each(|d, w| {
        let (from, to) = (basis::<N, f64>(d), basis::<N, f64>(*m * glam::DVec3::from(d)));
        for (row, to) in rows.iter_mut().zip(to) {
            for (entry, from) in row.iter_mut().zip(from) {
                *entry += w * to * from;
            }
        }
    });
    rows
}

fn rotation<const N: usize>(c: &mut Criterion) {
    let mut group = c.benchmark_group(format!("rotation, l <= {}", Sh::<N>::BANDS - 1));
    let m = DMat3::from_quat(DQuat::from_xyzw(0.1, 0.2, 0.3, 0.9).normalize());
    let sh = Sh::<N>(core::array::from_fn(|i| i as f32));
    let rgb = sh.map(Vec3::splat);
    let rotation = Rotation::<N>::new(&m);
    group.bench_function("build", |b| b.iter(|| Rotation::<N>::new(black_box(&m))));
    group.bench_function("naive build", |b| b.iter(|| naive_rotation::<N>(black_box(&m))));
    group.bench_function("apply", |b| b.iter(|| black_box(&rotation).apply(black_box(&sh))));
    group.bench_function("apply, RGB", |b| b.iter(|| black_box(&rotation).apply(black_box(&rgb))));
    group.bench_function("zonal lobe", |b| {
        b.iter(|| Zonal::<N, f32>::clamped_cosine().toward(black_box(Vec3::Y)));
    });
    group.finish();
}

fn operations<const N: usize>(c: &mut Criterion) {
    let mut group = c.benchmark_group(format!("operations, l <= {}", Sh::<N>::BANDS - 1));
    let (f, g) = (Sh::<N>(core::array::from_fn(|i| 1.0 / (1.0 + i as f32))), Sh::<N>::constant(2.0));
    group.bench_function("product", |b| b.iter(|| black_box(&f).product(black_box(&g))));
    let quad = [[1.0_f32, -1.0, 2.0], [1.0, 1.0, 2.0], [-1.0, 1.0, 2.0], [-1.0, -1.0, 2.0]];
    group.bench_function("quadrilateral light", |b| b.iter(|| Sh::<N>::polygon_light(black_box(&quad))));
    let light =
        (Sh::<N>::directional_light(Vec3::Y) * 3.0 + Sh::directional_light(Vec3::Z) + Sh::constant(0.05))
            .convolve(&Zonal::clamped_cosine());
    group.sample_size(20);
    group.bench_function("non-negative, two lights", |b| {
        b.iter(|| black_box(&light).non_negative(Mean::Keep))
    });
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .warm_up_time(std::time::Duration::from_millis(300))
        .measurement_time(std::time::Duration::from_millis(700));
    targets = evaluation::<4>, evaluation::<9>, evaluation::<16>, evaluation::<25>, evaluation::<121>, layouts,
        rotation::<9>, rotation::<25>, operations::<9>, operations::<25>
}
criterion_main!(benches);
