//! Derivatives with respect to direction.

use crate::basis::{Parts, basis, each_up_to_l4, parts, values};
use crate::real::{Real, Value};
use crate::sh::Sh;
use crate::table::Table;

/// The basis and its gradient on the sphere at the unit direction `d`: `(Y_i, ∇Y_i)`.
///
/// `∇Y_i` is tangent (perpendicular to `d`) and per radian: the derivative of `Y_i(v/|v|)` by `v` at `v = d`. Nothing is
/// divided, so the poles are no special case. Polynomials up to `l = 4`, [`basis_and_gradient_by_recurrence`] above.
#[must_use]
#[inline]
pub fn basis_and_gradient<const N: usize, S: Real>(d: impl Into<[S; 3]>) -> ([S; N], [[S; 3]; N]) {
    let d = d.into();
    if Table::<N>::BANDS <= 5 {
        let zero = S::default();
        let (mut y, mut gradient) = ([zero; N], [[zero; 3]; N]);
        unrolled(d, &mut y, &mut gradient);
        (y, gradient)
    } else {
        basis_and_gradient_by_recurrence(d)
    }
}

/// [`basis_and_gradient`] at every order from the derivatives of the solid harmonics `r^l Y_lm`, which are solid harmonics
/// of the band below, less their radial part `l·Y_lm·d`.
#[must_use]
pub fn basis_and_gradient_by_recurrence<const N: usize, S: Real>(
    d: impl Into<[S; 3]>,
) -> ([S; N], [[S; 3]; N]) {
    let d: [S; 3] = d.into();
    let y = basis::<N, S>(d);
    let zero = S::default();
    // `Table::LOWERING_F64`.
    let factors = S::lowering::<N>();
    let mut out = [[zero; 3]; N];
    for l in 1..Table::<N>::BANDS {
        let (centre, below) = (l * (l + 1), l * (l - 1));
        let lf = S::from_f64(l as f64);
        let radial = d.map(|axis| lf * axis);
        let tangent = |i: usize, solid: [S; 3]| -> [S; 3] {
            [solid[0] - y[i] * radial[0], solid[1] - y[i] * radial[1], solid[2] - y[i] * radial[2]]
        };
        // With the complex solid harmonics of band l−1, ∂z keeps m, ∂x ± i∂y takes it to m ± 1. (cos, sin) parts at m, 0
        // where m is out of the band.
        let part = |m: usize| if m < l { (y[below + m], y[below - m]) } else { (zero, zero) };
        let [z, _, up] = factors[centre / 2];
        let (mut down_c, mut down_s) = (y[below], zero);
        let (mut same_c, mut same_s) = part(1);
        out[centre] = tangent(centre, [zero - up * same_c, zero - up * same_s, z * down_c]);
        for m in 1..=l {
            let [z, down, up] = factors[centre / 2 + m];
            let (up_c, up_s) = part(m + 1);
            let cosine = [down * down_c - up * up_c, zero - down * down_s - up * up_s, z * same_c];
            let sine = [down * down_s - up * up_s, down * down_c + up * up_c, z * same_s];
            out[centre + m] = tangent(centre + m, cosine);
            out[centre - m] = tangent(centre - m, sine);
            (down_c, down_s, same_c, same_s) = (same_c, same_s, up_c, up_s);
        }
    }
    (y, out)
}

/// Up to `l = 4`. With `Y = P(z)·C_m(x, y)`, `∇Y = P·∇C_m + P'·C_m·e_z`. Both terms are made tangent by themselves, which
/// costs once per `m` where `Y` would cost once per coefficient: `∇C_m = m·(C_{m−1}, −S_{m−1}, 0)` has the radial part
/// `m·C_m` (Euler), `∇S_m = m·(S_{m−1}, C_{m−1}, 0)` has `m·S_m`, and `e_z` has `z`.
#[inline(always)]
fn unrolled<const N: usize, S: Real>([x, y, z]: [S; 3], out: &mut [S; N], gradient: &mut [[S; 3]; N]) {
    let parts = parts::<N, S>(x, y, z);
    values(&parts, out);
    let Parts { p, dp, c, s } = parts;
    let zero = S::default();
    // 1 − z² without the cancellation near the poles.
    let up = [zero - z * x, zero - z * y, x * x + y * y];
    let (mut tc, mut ts) = ([[zero; 3]; 5], [[zero; 3]; 5]);
    macro_rules! turn {
        ($m:literal) => {
            let m = S::from_f64(f64::from($m));
            tc[$m] =
                [m * (c[$m - 1] - c[$m] * x), m * (zero - s[$m - 1] - c[$m] * y), m * (zero - c[$m] * z)];
            ts[$m] = [m * (s[$m - 1] - s[$m] * x), m * (c[$m - 1] - s[$m] * y), m * (zero - s[$m] * z)];
        };
    }
    turn!(1);
    turn!(2);
    turn!(3);
    turn!(4);
    let sum = |p: S, t: [S; 3], q: S| [p * t[0] + q * up[0], p * t[1] + q * up[1], p * t[2] + q * up[2]];
    gradient[0] = [zero; 3];
    macro_rules! zonal {
        ($l:literal) => {
            gradient[$l * ($l + 1)] = up.map(|up| dp[$l * ($l + 1) / 2] * up)
        };
    }
    macro_rules! pair {
        ($l:literal, $m:literal) => {
            let (p, dp) = (p[$l * ($l + 1) / 2 + $m], dp[$l * ($l + 1) / 2 + $m]);
            if $l == $m {
                gradient[$l * ($l + 1) + $m] = tc[$m].map(|t| p * t);
                gradient[$l * ($l + 1) - $m] = ts[$m].map(|t| p * t);
            } else {
                gradient[$l * ($l + 1) + $m] = sum(p, tc[$m], dp * c[$m]);
                gradient[$l * ($l + 1) - $m] = sum(p, ts[$m], dp * s[$m]);
            }
        };
    }
    each_up_to_l4!(N, zonal, pair);
}

impl<const N: usize, T: Value> Sh<N, T> {
    /// The gradient on the sphere at the unit direction `d`, per radian: the change of the value along x, y and z; it
    /// has no part along `d`.
    #[must_use]
    pub fn gradient(&self, d: impl Into<[T::Scalar; 3]>) -> [T; 3] {
        let d = d.into();
        if Table::<N>::BANDS <= 5 {
            return self.gradient_unrolled(d);
        }
        let (_, gradient) = basis_and_gradient_by_recurrence::<N, T::Scalar>(d);
        let mut sum = [T::default(); 3];
        for (&c, g) in self.0.iter().zip(&gradient) {
            for (sum, &g) in sum.iter_mut().zip(g) {
                *sum = *sum + c * g;
            }
        }
        sum
    }

    /// Up to `l = 4`: the terms of `∇Y = P·∇C_m + P'·C_m·e_z` are summed for each `m`, then over `m`, and made tangent
    /// once.
    #[inline(always)]
    fn gradient_unrolled(&self, [x, y, z]: [T::Scalar; 3]) -> [T; 3] {
        let Parts { p, dp, c, s } = parts::<N, T::Scalar>(x, y, z);
        let zero = T::default();
        // Σ_l f_lm P_lm of the cosines and sines, and all of ∂z.
        let (mut pc, mut ps, mut along_z) = ([zero; 5], [zero; 5], zero);
        macro_rules! zonal {
            ($l:literal) => {
                along_z = along_z + self.0[$l * ($l + 1)] * dp[$l * ($l + 1) / 2]
            };
        }
        macro_rules! pair {
            ($l:literal, $m:literal) => {
                let (cosine, sine) = (self.0[$l * ($l + 1) + $m], self.0[$l * ($l + 1) - $m]);
                pc[$m] = pc[$m] + cosine * p[$l * ($l + 1) / 2 + $m];
                ps[$m] = ps[$m] + sine * p[$l * ($l + 1) / 2 + $m];
                if $l != $m {
                    along_z = along_z + (cosine * c[$m] + sine * s[$m]) * dp[$l * ($l + 1) / 2 + $m];
                }
            };
        }
        each_up_to_l4!(N, zonal, pair);
        let (mut along_x, mut along_y) = (zero, zero);
        for m in 1..Table::<N>::BANDS {
            let (c, s) = (c[m - 1] * T::Scalar::from_f64(m as f64), s[m - 1] * T::Scalar::from_f64(m as f64));
            along_x = along_x + (pc[m] * c + ps[m] * s);
            along_y = along_y + (ps[m] * c - pc[m] * s);
        }
        let radial = along_x * x + along_y * y + along_z * z;
        [along_x - radial * x, along_y - radial * y, along_z - radial * z]
    }
}
