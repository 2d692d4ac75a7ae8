//! Closed-form projections against sums over directions, products against quadrature, packed storage against its bound.

use glam::{DVec3, Vec3};
use proptest::prelude::*;
use sh_math::{Quadrature, Sh, Zonal, basis};

fn vector() -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(-1.0_f64..1.0).prop_map(DVec3::from).prop_filter("too short", |v| v.length() > 0.1)
}

fn coefficients<const N: usize>() -> impl Strategy<Value = Sh<N, f64>> {
    prop::collection::vec(-1.0_f64..1.0, N).prop_map(|v| Sh(core::array::from_fn(|i| v[i])))
}

/// ∫ Y_i over a triangle seen from the origin: the solid angle's density `a·(b×c)/|p|³` over barycentric coordinates, by a
/// product Gauss rule on the collapsed square, exact to rounding for triangles away from the origin.
fn triangle_by_quadrature<const N: usize>(a: DVec3, b: DVec3, c: DVec3) -> [f64; N] {
    let n = 40;
    let mut out = [0.0; N];
    let volume = a.dot(b.cross(c));
    for i in 0..n {
        let (x, wx) = sh_math::gauss_legendre(n, i);
        let (u, wu) = (0.5 * (x + 1.0), 0.5 * wx);
        for j in 0..n {
            let (x, wv) = sh_math::gauss_legendre(n, j);
            let v = 0.5 * (x + 1.0) * (1.0 - u);
            let p = a * (1.0 - u - v) + b * u + c * v;
            let w = wu * 0.5 * wv * (1.0 - u) * volume / p.length().powi(3);
            for (o, y) in out.iter_mut().zip(basis::<N, f64>(p.normalize())) {
                *o += w * y;
            }
        }
    }
    out
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1024, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn products_match_quadrature(f in coefficients::<25>(), g in coefficients::<25>()) {
        // Exact to degree 12: product of three l ≤ 4.
        let expected = Sh::<25, f64>::project_fn(12, |d| f.evaluate(d) * g.evaluate(d));
        let product = f.product(&g);
        let low = f.resize::<9>().product(&g.resize::<9>());
        let (f9, g9) = (f.resize::<9>(), g.resize::<9>());
        let expected_low = Sh::<9, f64>::project_fn(6, |d| f9.evaluate(d) * g9.evaluate(d));
        for i in 0..25 {
            prop_assert!((product[i] - expected[i]).abs() < 1e-12 * 25.0);
            if i < 9 {
                prop_assert!((low[i] - expected_low[i]).abs() < 1e-12 * 9.0);
            }
        }
        let rgb = f.map(|c| c as f32).product(&g.map(|c| Vec3::new(c as f32, 0.0, -2.0 * c as f32)));
        for i in 0..25 {
            // Some 40 f32 terms of size below 1.
            prop_assert!((rgb[i].as_dvec3() - DVec3::new(1.0, 0.0, -2.0) * product[i]).length() < 1e-4);
        }
    }

    #[test]
    fn sphere_lights_are_caps(c in vector(), radius in 0.01_f64..3.0) {
        let light = Sh::<36, f64>::sphere_light(c, radius);
        // Solid angle of the cap, in closed form.
        let sin = (radius / c.length()).min(1.0);
        let solid_angle = if sin < 1.0 { std::f64::consts::TAU * sin * sin / (1.0 + (1.0 - sin * sin).sqrt()) } else { 4.0 * std::f64::consts::PI };
        prop_assert!((light.integral() - solid_angle).abs() < 1e-12 * solid_angle.max(1e-3));
        // Band by band against the kernel's own integral.
        let axis = c.normalize();
        let cos = if sin < 1.0 { (1.0 - sin * sin).sqrt() } else { -1.0 };
        let kernel = Zonal::<36, f64>::from_fn(40, cos, 1.0, |_| 1.0).toward(axis);
        for i in 0..36 {
            prop_assert!((light[i] - kernel[i]).abs() < 1e-12);
        }
    }

    #[test]
    fn a_polygon_with_the_origin_on_an_edge_is_0(a in vector(), b in vector(), t in 0.1_f64..10.0) {
        let polygon = [a, b, -t * a];
        prop_assert_eq!(Sh::<25, f64>::polygon_light(&polygon), Sh::default());
        // Products with powers of two are exact in f32 too; b, −t·a, a is the same polygon.
        let single = [b.as_vec3(), -4.0 * a.as_vec3(), a.as_vec3()];
        prop_assert_eq!(Sh::<9>::polygon_light(&single), Sh::default());
        // Not so a right angle or more.
        let wide = Sh::<9, f64>::polygon_light(&[DVec3::X, DVec3::new(-1.0, 1e-3 * t, 0.0), DVec3::Z]);
        prop_assert!((wide.integral() - (core::f64::consts::PI - (1e-3 * t).atan())).abs() < 1e-9);
    }

    #[test]
    fn small_caps_keep_their_digits(exponent in -12.0_f64..0.0) {
        let angle = 10.0_f64.powf(exponent);
        let cap = Zonal::<121, f64>::cap(angle);
        let h = 2.0 * (0.5 * angle).sin().powi(2);
        // ∫ P_l over 1 − t ∈ [0, h], by P_l(1 − u) = Σ_k (−1)^k C(l,k) C(l+k,k) (u/2)^k.
        for l in 0..11 {
            let (mut term, mut sum, mut size) = (1.0, 0.0, 0.0_f64);
            for k in 0..=l {
                sum += term / (k + 1) as f64;
                size = size.max(term.abs());
                term *= -0.5 * h * ((l - k) * (l + k + 1)) as f64 / ((k + 1) * (k + 1)) as f64;
            }
            let expected = core::f64::consts::TAU * h * sum;
            // Some 10 ulp of the recurrence; of the series where it alternates, above 0.2 rad, ten of its largest term.
            let tolerance = 1e-14 * core::f64::consts::TAU * h * size;
            prop_assert!((cap.factor(l) - expected).abs() <= tolerance, "A_{}: {} {}", l, cap.factor(l), expected);
            prop_assert!(angle > 0.1 || (cap.factor(l) / expected - 1.0).abs() < 1e-13);
        }
    }

    #[test]
    fn a_light_is_found_again(d in vector(), light in 0.01_f64..100.0, ambient in 0.0_f64..10.0) {
        let d = d.normalize();
        let field = Sh::<9, f64>::directional_light(d) * light + Sh::constant(ambient);
        let found = field.dominant_direction().map(DVec3::from);
        prop_assert!(found.is_some_and(|f| (f - d).length() < 1e-12), "{:?}", found);
        let (l, a) = field.directional_and_ambient(d);
        prop_assert!((l - light).abs() < 1e-12 * (light + ambient) && (a - ambient).abs() < 1e-12 * (light + ambient));
        prop_assert!(Sh::<9, f64>::constant(ambient).dominant_direction().is_none());
    }
}

proptest! {
    // 1600 points of quadrature each.
    #![proptest_config(ProptestConfig { cases: 1024, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn triangle_lights_match_quadrature(centre in vector(), e in vector(), f in vector()) {
        // Kept away from the origin and from slivers, where the quadrature (not the closed form) would fail.
        let centre = centre.normalize() * 1.5;
        let (a, b, c) = (centre + e, centre + f, centre - 0.5 * (e + f));
        let quadrature = triangle_by_quadrature::<49>(a, b, c);
        let exact = Sh::<49, f64>::polygon_light(&[a, b, c]);
        prop_assume!(a.dot(b.cross(c)).abs() > 1e-3 && centre.length() > 1.2 * e.length().max(f.length()));
        for i in 0..49 {
            prop_assert!((exact[i] - quadrature[i]).abs() < 1e-9, "{}: {} {}", i, exact[i], quadrature[i]);
        }
        let behind = Sh::<49, f64>::polygon_light(&[c, b, a]);
        prop_assert!((exact + behind).0.iter().all(|c| c.abs() < 1e-12));
        let single = Sh::<9>::polygon_light(&[a.as_vec3(), b.as_vec3(), c.as_vec3()]);
        for i in 0..9 {
            prop_assert!((f64::from(single[i]) - exact[i]).abs() < 2e-6);
        }
    }
}

#[test]
fn polygons_add_up_to_the_sphere() {
    // The six faces of a cube, each as a quadrilateral seen from inside, are the function 1; l = 10.
    let mut sum = Sh::<121, f64>::default();
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            let (n, u) = (DVec3::AXES[axis] * sign, DVec3::AXES[(axis + 1) % 3]);
            let v = n.cross(u);
            sum += Sh::polygon_light(&[n + u + v, n - u + v, n - u - v, n + u - v]);
        }
    }
    let one = Sh::<121, f64>::constant(1.0);
    assert!((sum - one).0.iter().all(|c| c.abs() < 1e-12), "{sum:?}");
    assert_eq!(Sh::<9, f64>::polygon_light::<DVec3>(&[]), Sh::default());
    assert_eq!(Sh::<9, f64>::polygon_light(&[DVec3::X, DVec3::ZERO, DVec3::Y]), Sh::default());
    assert_eq!(Sh::<9, f64>::polygon_light(&[DVec3::X, DVec3::Y]), Sh::default());
    assert_eq!(Sh::<9, f64>::polygon_light(&[DVec3::X, DVec3::Y, DVec3::Z * f64::NAN]), Sh::default());
    let mut points = 0;
    Quadrature::new(20).for_each(|_, _| points += 1);
    assert_eq!(points, Quadrature::new(20).points());
}

#[test]
fn sphere_lights_of_any_size() {
    let light = |centre: [f64; 3], radius| Sh::<9, f64>::sphere_light(centre, radius);
    for bad in [f64::NAN, f64::INFINITY] {
        assert_eq!(light([0.0, bad, 1.0], 0.5), Sh::default());
        assert_eq!(light([0.0, 2.0, 1.0], bad), Sh::default());
    }
    for radius in [0.0, -0.5] {
        assert_eq!(light([0.0, 2.0, 1.0], radius), Sh::default());
        assert_eq!(light([0.0; 3], radius), Sh::default());
    }
    let inside = light([0.0; 3], 1.0) - Sh::constant(1.0);
    assert!(inside.0.iter().all(|c| c.abs() < 1e-14), "{inside:?}");
    // Only the ratio counts.
    for scale in [1e-300, 1e300] {
        let difference = light([0.0, 2.0 * scale, scale], scale) - light([0.0, 2.0, 1.0], 1.0);
        assert!(difference.0.iter().all(|c| c.abs() < 1e-14), "{difference:?}");
    }
}

#[cfg(feature = "half")]
mod packed {
    use super::*;
    use sh_math::PackedSh;

    proptest! {
        #![proptest_config(ProptestConfig { cases: 4096, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn packing_stays_within_its_bound(sh in coefficients::<16>(), exponent in -35_i32..38, spread in 0_i32..12) {
            let scale = 10.0_f64.powi(exponent);
            let mut sh = sh.map(|c| (c * scale) as f32);
            sh[5] *= 0.1_f32.powi(spread);
            let again = PackedSh::new(&sh).unpack();
            let largest = sh.0.iter().fold(0.0_f32, |a, c| a.max(c.abs()));
            for i in 0..16 {
                let bound = f64::from(sh[i].abs()) / 2048.0 + f64::from(largest) * 2.0_f64.powi(-39);
                let error = (f64::from(again[i]) - f64::from(sh[i])).abs();
                prop_assert!(error <= bound, "{}: {} {} {}", i, sh[i], again[i], largest);
            }
        }
    }

    #[test]
    fn near_the_limit_of_half_floats() {
        // A sun of 1e6 over a sky: plain half floats would be infinite.
        let sun = Sh::<9>::directional_light(Vec3::Y) * 1e6;
        let again = PackedSh::new(&sun).unpack();
        for i in 0..9 {
            assert!((again[i] - sun[i]).abs() <= sun[i].abs() / 2048.0 + 1e6 * 2.0_f32.powi(-39));
        }
        assert!(sun.saturate_to_f16().0.iter().all(|c| c.abs() <= 65_504.0));
        let small = Sh::<9>::directional_light(Vec3::Y) * 0.5;
        for (a, b) in small.saturate_to_f16().0.iter().zip(small.0) {
            assert!((a - b).abs() <= b.abs() / 2048.0 + 2.0_f32.powi(-25));
        }
        assert_eq!(PackedSh::new(&Sh::<4>([f32::NAN, 1.0, f32::INFINITY, 0.0])).unpack(), Sh::default());
    }
}
