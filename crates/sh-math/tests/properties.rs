//! Properties of the basis, of convolution, rotation and gradients, over thousands of random cases.

use std::sync::LazyLock;

use glam::{DMat3, DQuat, DVec3, Mat3, Vec3};
use proptest::prelude::*;
use sh_math::{
    BatchError, Quadrature, Rotation, Sh, Zonal, band, basis, basis_and_gradient,
    basis_and_gradient_by_recurrence, basis_batch, basis_by_recurrence, gauss_legendre, unit,
};

const EPS: f32 = f32::EPSILON;

static RULE: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| (0..450).map(|k| gauss_legendre(450, k)).collect());

fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

/// Unit vectors, the axes and their neighbourhood included.
fn direction() -> impl Strategy<Value = DVec3> {
    let sphere = (-1.0_f64..=1.0, 0.0..core::f64::consts::TAU).prop_map(|(z, phi)| {
        let r = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(r * phi.cos(), r * phi.sin(), z)
    });
    let near_axis =
        (0_usize..3, any::<bool>(), prop::array::uniform3(-1e-4_f64..1e-4)).prop_map(|(axis, sign, d)| {
            let mut v = DVec3::from(d);
            v[axis] = if sign { 1.0 } else { -1.0 };
            v.normalize()
        });
    let axis = (0_usize..3, any::<bool>())
        .prop_map(|(axis, sign)| DVec3::AXES[axis] * if sign { 1.0 } else { -1.0 });
    prop_oneof![8 => sphere, 2 => near_axis, 1 => axis]
}

fn rotation() -> impl Strategy<Value = DQuat> {
    prop::array::uniform4(-1.0_f64..1.0)
        .prop_filter("not a quaternion", |q| q.iter().map(|x| x * x).sum::<f64>() > 1e-2)
        .prop_map(|q| DQuat::from_array(q).normalize())
}

fn coefficients<const N: usize>() -> impl Strategy<Value = Sh<N, f64>> {
    prop::collection::vec(-1.0_f64..1.0, N).prop_map(|v| Sh(core::array::from_fn(|i| v[i])))
}

fn narrow<const N: usize>(sh: &Sh<N, f64>) -> Sh<N> {
    sh.map(|c| c as f32)
}

/// `max |Y_lm|` over `m` and the sphere: the addition theorem's `√((2l+1)/4π)`.
fn bound(i: usize) -> f64 {
    ((2 * band(i) + 1) as f64 / (4.0 * core::f64::consts::PI)).sqrt()
}

#[test]
fn orthonormal_to_l_10() {
    // Errata: the real basis (temporal coherence thesis, eq. 2.5) is orthonormal, checked by exact quadrature.
    let mut gram = vec![[0.0; 121]; 121];
    Quadrature::new(20).for_each(|d, w| {
        let y = basis::<121, f64>(d);
        for (i, row) in gram.iter_mut().enumerate() {
            for (j, g) in row.iter_mut().enumerate() {
                *g += w * y[i] * y[j];
            }
        }
    });
    for (i, row) in gram.iter().enumerate() {
        for (j, g) in row.iter().enumerate() {
            let delta = if i == j { 1.0 } else { 0.0 };
            // 231 terms below 12.6·2.7 / 231 each: rounding far below 1e-12.
            assert!((g - delta).abs() < 1e-12, "⟨{i}, {j}⟩ = {g}");
        }
    }
}

#[test]
fn unit_function_is_only_y00() {
    // Errata: SH-grid §3.4.1 prints θ over 0…2π. Over the sphere, θ in 0…π, the function 1 has one coefficient, √(4π);
    // over the printed range sinθ is odd about π and the integral of Y00 vanishes.
    let one = Sh::<25, f64>::project_fn(4, |_| 1.0);
    assert!((one[0] - (4.0 * core::f64::consts::PI).sqrt()).abs() < 1e-13);
    assert!(one.0[1..].iter().all(|c| c.abs() < 1e-13), "{one:?}");
    let n = 1000;
    let printed = |end: f64| {
        (0..n).map(|k| (end * (f64::from(k) + 0.5) / f64::from(n)).sin() * end / f64::from(n)).sum::<f64>()
    };
    // ∫ sinθ dθ: 2 on 0…π (midpoint rule, O(n⁻²)), 0 on 0…2π.
    assert!((printed(core::f64::consts::PI) - 2.0).abs() < 1e-5);
    assert!(printed(core::f64::consts::TAU).abs() < 1e-12);
}

#[test]
fn clamped_cosine_factors() {
    // Errata §0, and the same by quadrature of the kernel over its support.
    use core::f64::consts::PI;
    let a = Zonal::<121, f64>::clamped_cosine();
    for (l, expected) in [PI, 2.0 * PI / 3.0, PI / 4.0, 0.0, -PI / 24.0].into_iter().enumerate() {
        assert!((a.factor(l) - expected).abs() < 1e-15, "A_{l} = {}", a.factor(l));
    }
    let quadrature = Zonal::<121, f64>::from_fn(6, 0.0, 1.0, |t| t);
    let cap = Zonal::<121, f64>::hemisphere();
    let cap_quadrature = Zonal::<121, f64>::from_fn(6, 0.0, 1.0, |_| 1.0);
    for l in 0..11 {
        assert!((a.factor(l) - quadrature.factor(l)).abs() < 1e-14);
        assert!((cap.factor(l) - cap_quadrature.factor(l)).abs() < 1e-14);
    }
}

/// Irradiance and hemisphere integral of a field against a sum over directions.
#[test]
fn closed_forms_match_sampling() {
    // Errata: SH-grid §4.2 samples 32 directions; the closed form is their limit. An SH field times a clamped cosine has
    // a kink at the horizon: the product rule converges as n⁻², 1.5e-5 of the field's size at degree 400 with room to spare.
    let f = Sh::<25, f64>(core::array::from_fn(|i| ((i * 7 + 3) % 11) as f64 / 11.0 - 0.4));
    for n in [DVec3::Z, DVec3::new(0.3, -0.5, 0.2).normalize()] {
        let (mut e, mut h) = (0.0, 0.0);
        Quadrature::new(600).for_each(|d, w| {
            let cos = n.dot(DVec3::from(d));
            if cos > 0.0 {
                e += w * cos * f.evaluate(d);
                h += w * f.evaluate(d);
            }
        });
        assert!((f.irradiance(n) - e).abs() < 1e-4, "{} {e}", f.irradiance(n));
        // The hemisphere jumps at the horizon: n⁻¹ only.
        assert!((f.hemisphere_integral(n) - h).abs() < 3e-2, "{} {h}", f.hemisphere_integral(n));
        assert!((f.convolve(&Zonal::clamped_cosine()).evaluate(n) - f.irradiance(n)).abs() < 1e-14);
        assert!((f.convolve(&Zonal::hemisphere()).evaluate(n) - f.hemisphere_integral(n)).abs() < 1e-14);
    }
}

proptest! {
    // A thousand rotations each.
    #![proptest_config(cases(256))]

    #[test]
    fn rotation_keeps_energy_over_a_thousand_compositions(
        sh in coefficients::<25>(), turns in prop::collection::vec(rotation(), 1000), angle in 1e-4_f32..1.0
    ) {
        // Different rotations, the same one again and again, and small ones: f32 coefficients, f32 matrices.
        let start = narrow(&sh);
        let axis = (turns[1] * DVec3::Z).as_vec3().normalize();
        let steps: [&dyn Fn(usize) -> Mat3; 3] = [
            &|k| Mat3::from_quat(turns[k].as_quat()),
            &|_| Mat3::from_quat(turns[0].as_quat()),
            &|_| Mat3::from_axis_angle(axis, angle),
        ];
        for step in steps {
            let mut sh = start;
            for k in 0..1000 {
                sh = sh.rotate(&step(k));
            }
            for l in 0..5 {
                let ratio = f64::from(sh.band_energy(l)) / f64::from(start.band_energy(l));
                prop_assert!((ratio - 1.0).abs() < 1e-5, "band {}: {}", l, ratio);
            }
        }
    }
}

proptest! {
    #![proptest_config(cases(4096))]

    #[test]
    fn uniform_field_gives_pi_l(n in direction(), radiance in prop::array::uniform3(0.0_f32..3e4)) {
        let radiance = Vec3::from(radiance);
        let e = Sh::<25, Vec3>::constant(radiance).irradiance(n.as_vec3());
        let expected = radiance * core::f32::consts::PI;
        // Three roundings.
        prop_assert!((e - expected).abs().cmple(expected * 3.0 * EPS).all(), "{}", e);
    }

    #[test]
    fn unrolled_is_the_recurrence_to_4_ulp(d in direction()) {
        let f = d.as_vec3();
        let (a, b) = (basis::<25, f32>(f), basis_by_recurrence::<25, f32>(f));
        let (c, e) = (basis::<25, f64>(d), basis_by_recurrence::<25, f64>(d));
        for i in 0..25 {
            // An ulp of the band's bound.
            let ulp = bound(i) * f64::from(EPS);
            prop_assert!(f64::from((a[i] - b[i]).abs()) <= 4.0 * ulp, "{}: {} {}", i, a[i], b[i]);
            prop_assert!((c[i] - e[i]).abs() <= 4.0 * bound(i) * f64::EPSILON, "{}: {} {}", i, c[i], e[i]);
        }
    }

    #[test]
    fn unrolled_gradient_is_the_recurrence(d in direction(), sh in coefficients::<25>()) {
        fn case<const N: usize>(d: DVec3, sh: &Sh<25, f64>) -> Result<(), TestCaseError> {
            let f = d.as_vec3();
            let ((y, a), (_, b)) = (basis_and_gradient::<N, f32>(f), basis_and_gradient_by_recurrence::<N, f32>(f));
            let ((wide_y, c), (_, e)) = (basis_and_gradient::<N, f64>(d), basis_and_gradient_by_recurrence::<N, f64>(d));
            prop_assert_eq!(y, basis::<N, f32>(f));
            prop_assert_eq!(wide_y, basis::<N, f64>(d));
            for i in 0..N {
                // An ulp of the band's bound: the addition theorem's Σ_m |∇Y_lm|² = l(l+1)(2l+1)/4π.
                let l = band(i) as f64;
                // 4 of rounding as for the values, and one for each of the l factors of a direction whose length is off by an
                // ulp, as the two forms leave the sphere in different ways.
                let tolerance = (4.0 + l) * bound(i) * (l * (l + 1.0)).sqrt();
                for axis in 0..3 {
                    let (single, double) = (a[i][axis] - b[i][axis], c[i][axis] - e[i][axis]);
                    prop_assert!(f64::from(single.abs()) <= tolerance * f64::from(EPS), "{}: {:?} {:?}", i, a[i], b[i]);
                    prop_assert!(double.abs() <= tolerance * f64::EPSILON, "{}: {:?} {:?}", i, c[i], e[i]);
                }
            }
            // Summed before it is made tangent; a sum of up to 25 terms within 8 ulp of at most 3.8 each.
            let sh = sh.resize::<N>();
            let (sum, rgb) = (DVec3::from(sh.gradient(d)), sh.map(|c| DVec3::new(c, 0.0, -2.0 * c)).gradient(d));
            let expected: DVec3 = sh.0.iter().zip(c).map(|(&f, g)| f * DVec3::from(g)).sum();
            prop_assert!((sum - expected).length() < 25.0 * 8.0 * 3.8 * f64::EPSILON, "{} {}", sum, expected);
            prop_assert!(sum.dot(d).abs() < 1e-14);
            for axis in 0..3 {
                prop_assert!((rgb[axis] - DVec3::new(1.0, 0.0, -2.0) * sum[axis]).length() < 1e-14);
            }
            Ok(())
        }
        case::<4>(d, &sh)?;
        case::<9>(d, &sh)?;
        case::<16>(d, &sh)?;
        case::<25>(d, &sh)?;
    }

    #[test]
    fn addition_theorem_to_l_10(d in direction(), e in direction()) {
        // Σ_m Y_lm(d) Y_lm(e) = (2l+1)/4π · P_l(d·e): the basis against a formula that shares nothing with it.
        let (a, b) = (basis::<121, f64>(d), basis::<121, f64>(e));
        let t = d.dot(e);
        let (mut below, mut p) = (0.0, 1.0);
        for l in 0..11 {
            let sum: f64 = (l * l..(l + 1) * (l + 1)).map(|i| a[i] * b[i]).sum();
            prop_assert!((sum - bound(l * l).powi(2) * p).abs() < 1e-13, "l {}", l);
            let lf = l as f64;
            (below, p) = (p, ((2.0 * lf + 1.0) * t * p - lf * below) / (lf + 1.0));
        }
    }

    #[test]
    fn rotation_commutes_with_evaluation(sh in coefficients::<121>(), q in rotation(), d in direction()) {
        let m = DMat3::from_quat(q);
        let turned = sh.rotate(&m).evaluate(m * d);
        // 121 terms of size below 1.3, l = 10 recursions of a few ulp each.
        prop_assert!((turned - sh.evaluate(d)).abs() < 1e-12);
        let (low, m) = (narrow::<25>(&sh.resize()), Mat3::from_quat(q.as_quat()));
        let turned = low.rotate(&m).evaluate((m * d.as_vec3()).normalize());
        // m·d is off by 1e-7 rad, times the slope: at most Σ l·bound·√(2l+1) ≈ 45 for these coefficients.
        prop_assert!((turned - low.evaluate(d.as_vec3())).abs() < 1e-5);
    }

    #[test]
    fn rotation_composes_and_inverts(sh in coefficients::<25>(), p in rotation(), q in rotation()) {
        let (p, q) = (DMat3::from_quat(p), DMat3::from_quat(q));
        let (a, b) = (sh.rotate(&p).rotate(&q), sh.rotate(&(q * p)));
        let back = Rotation::new(&p).inverse().apply(&sh.rotate(&p));
        for i in 0..25 {
            prop_assert!((a[i] - b[i]).abs() < 1e-13 && (back[i] - sh[i]).abs() < 1e-13);
        }
        // A reflection is a turn of determinant −1.
        let mirror = DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0)) * p;
        let d = DVec3::new(0.48, 0.6, 0.64);
        prop_assert!((sh.rotate(&mirror).evaluate(mirror * d) - sh.evaluate(d)).abs() < 1e-13);
    }

    #[test]
    fn zonal_fast_path_is_the_rotation(q in rotation(), exponent in 0.0_f64..50.0) {
        let m = DMat3::from_quat(q);
        let kernel = Zonal::<36, f64>::phong(exponent);
        let (fast, slow) = (kernel.toward(m * DVec3::Z), kernel.toward(DVec3::Z).rotate(&m));
        for i in 0..36 {
            prop_assert!((fast[i] - slow[i]).abs() < 1e-13 * 7.0);
        }
    }

    #[test]
    fn convolution_theorem(f in coefficients::<16>(), n in direction(), exponent in 1_u32..8) {
        // ∫ f(ω) (n·ω)^k dω by exact quadrature, against the factors: a polynomial, so the rule is exact.
        let mut sum = 0.0;
        Quadrature::new(3 + exponent as usize).for_each(|d, w| {
            sum += w * f.evaluate(d) * n.dot(DVec3::from(d)).powi(exponent as i32);
        });
        let kernel = Zonal::<16, f64>::from_fn(8, -1.0, 1.0, |t| t.powi(exponent as i32));
        prop_assert!((f.convolve(&kernel).evaluate(n) - sum).abs() < 1e-13 * 10.0);
    }

    #[test]
    fn phong_factors_match_quadrature(exponent in prop_oneof![0.0_f64..100.0, (0_u32..100).prop_map(f64::from)]) {
        let lobe = Zonal::<121, f64>::phong(exponent);
        // ∫₀¹ tⁿ P_l(t) dt with t = s⁸: 8 s^(8n+7) P_l(s⁸), a polynomial of degree 887 at most where n is whole, exact with
        // 450 points; else short of one at s = 0 alone, beyond its 7th derivative, which leaves the rule about points⁻¹⁶.
        let mut sum = [0.0; 11];
        for (x, w) in RULE.iter() {
            let s = 0.5 * (x + 1.0);
            let t = s.powi(8);
            let weighted = 0.5 * w * 8.0 * s.powf(8.0 * exponent + 7.0) * core::f64::consts::TAU;
            let (mut below, mut p) = (0.0, 1.0);
            for (l, sum) in sum.iter_mut().enumerate() {
                *sum += weighted * p;
                let lf = l as f64;
                (below, p) = (p, ((2.0 * lf + 1.0) * t * p - lf * below) / (lf + 1.0));
            }
        }
        for (l, sum) in sum.into_iter().enumerate() {
            // Rounding of 450 terms, in units of the greatest factor, that of band 0.
            prop_assert!((lobe.factor(l) - sum).abs() < 1e-12 * lobe.factor(0), "A_{}: {} {}", l, lobe.factor(l), sum);
        }
    }

    #[test]
    fn gradient_is_the_derivative(d in direction(), e in direction(), sh in coefficients::<49>()) {
        let (y, g) = basis_and_gradient::<49, f64>(d);
        prop_assert_eq!(y, basis::<49, f64>(d));
        let (_, low) = basis_and_gradient::<25, f64>(d);
        let h = 1e-5;
        for (axis, step) in DVec3::AXES.into_iter().enumerate() {
            let at = |h: f64| basis::<49, f64>((d + step * h).normalize());
            let (a, b) = (at(h), at(-h));
            for ((a, b), g) in a.iter().zip(b).zip(g) {
                // Central difference: h²·l³ of truncation, ε/h of rounding.
                prop_assert!(((a - b) / (2.0 * h) - g[axis]).abs() < 3e-7);
            }
            for ((a, b), g) in a.iter().zip(b).zip(low) {
                prop_assert!(((a - b) / (2.0 * h) - g[axis]).abs() < 3e-7);
            }
        }
        // Tangent.
        let g = DVec3::from(sh.gradient(d));
        prop_assert!(g.dot(d).abs() < 1e-12);
        let along = sh.evaluate((d + e * h).normalize()) - sh.evaluate((d - e * h).normalize());
        prop_assert!((along / (2.0 * h) - g.dot(e)).abs() < 1e-6);
    }

    #[test]
    fn projection_inverts_evaluation(sh in coefficients::<25>()) {
        let again = Sh::<25, f64>::project_fn(8, |d| sh.evaluate(d));
        for i in 0..25 {
            prop_assert!((again[i] - sh[i]).abs() < 1e-13);
        }
        // ∫ f g is the dot product.
        let mut sum = 0.0;
        Quadrature::new(8).for_each(|d, w| sum += w * sh.evaluate(d) * again.evaluate(d));
        prop_assert!((sh.dot(&again) - sum).abs() < 1e-12);
    }

    #[test]
    fn batches_equal_single_calls(n in 0_usize..40, seed in 0_u32..1000) {
        let d: Vec<[f32; 3]> = (0..n as u32)
            .map(|k| Vec3::new(((k + seed) % 7) as f32 - 3.1, ((k * 5 + seed) % 11) as f32 - 5.2, 1.0 + k as f32 * 0.1))
            .map(|v| v.normalize().to_array())
            .collect();
        let mut rows = vec![[0.0; 25]; n];
        prop_assert_eq!(basis_batch::<25, f32>(&d, &mut rows), Ok(()));
        let sh = Sh::<25>(core::array::from_fn(|i| (i as f32).sin()));
        let mut values = vec![0.0; n];
        prop_assert_eq!(sh.evaluate_batch(&d, &mut values), Ok(()));
        let (mut batch, mut single) = (Sh::<25>::default(), Sh::<25>::default());
        prop_assert_eq!(batch.project_batch(&d, &values), Ok(()));
        for k in 0..n {
            prop_assert_eq!(rows[k], basis::<25, f32>(d[k]));
            prop_assert_eq!(values[k], sh.evaluate(d[k]));
            single.project_add(d[k], values[k]);
        }
        prop_assert_eq!(batch, single);
        rows.push([0.0; 25]);
        prop_assert_eq!(basis_batch(&d, &mut rows), Err(BatchError::Length { expected: n, found: n + 1 }));
    }

    #[test]
    fn unit_takes_any_finite_length(d in direction(), exponent in -300_i32..300) {
        let long = unit::<f64>(d * 10.0_f64.powi(exponent));
        let error = long.map(|u| (DVec3::from(u) - d).length());
        prop_assert!(error.is_some_and(|e| e < 1e-15), "{:?}", error);
        let long = unit::<f32>((d * 10.0_f64.powi(exponent / 9)).as_vec3());
        let error = long.map(|u| (Vec3::from(u).as_dvec3() - d).length());
        prop_assert!(error.is_some_and(|e| e < 2e-7), "{:?}", error);
        let longest = unit::<f64>(d * (0.99 * f64::MAX));
        prop_assert!(longest.is_some_and(|u| (DVec3::from(u) - d).length() < 1e-15), "{:?}", longest);
        let two = unit::<f64>([1e308, 1e308, 0.0]).map(DVec3::from);
        prop_assert!(two.is_some_and(|u| (u - DVec3::new(1.0, 1.0, 0.0).normalize()).length() < 1e-15), "{:?}", two);
        prop_assert!(unit::<f64>([f64::INFINITY, f64::NEG_INFINITY, 0.0]).is_none());
        prop_assert!(unit::<f32>(Vec3::ZERO).is_none() && unit::<f32>(Vec3::new(0.0, f32::NAN, 1.0)).is_none());
        prop_assert!(unit::<f32>(Vec3::new(0.0, f32::INFINITY, 1.0)).is_none());
    }

    #[test]
    fn a_length_off_by_epsilon_costs_l_squared_epsilon(d in direction(), e in -1e-3_f64..1e-3) {
        let (a, b) = (basis::<121, f64>(d), basis::<121, f64>(d * (1.0 + e)));
        for i in 0..121 {
            let l = band(i) as f64;
            prop_assert!((a[i] - b[i]).abs() <= (1.05 * l * l * e.abs()) * bound(i) + 1e-14, "{}", i);
        }
    }
}
