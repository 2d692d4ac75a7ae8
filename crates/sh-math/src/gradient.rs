//! Derivatives with respect to direction.

use crate::basis::basis;
use crate::real::{Real, Value};
use crate::sh::Sh;
use crate::table::Table;

/// The basis and its gradient on the sphere at the unit direction `d`: `(Y_i, ∇Y_i)`.
///
/// `∇Y_i` is tangent (perpendicular to `d`) and per radian: the derivative of `Y_i(v/|v|)` by `v` at `v = d`. It comes
/// from the derivatives of the solid harmonics `r^l Y_lm`, which are solid harmonics of the band below, less their
/// radial part `l·Y_lm·d`; nothing is divided, so the poles are no special case. Factors in `Table::LOWERING_F64`.
#[must_use]
pub fn basis_and_gradient<const N: usize, S: Real>(d: impl Into<[S; 3]>) -> ([S; N], [[S; 3]; N]) {
    let d: [S; 3] = d.into();
    let y = basis::<N, S>(d);
    let zero = S::default();
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

impl<const N: usize, T: Value> Sh<N, T> {
    /// The gradient on the sphere at the unit direction `d`, per radian: the change of the value along x, y and z; it
    /// has no part along `d`.
    #[must_use]
    pub fn gradient(&self, d: impl Into<[T::Scalar; 3]>) -> [T; 3] {
        let (_, gradient) = basis_and_gradient::<N, T::Scalar>(d);
        let mut sum = [T::default(); 3];
        for (&c, g) in self.0.iter().zip(&gradient) {
            for (sum, &g) in sum.iter_mut().zip(g) {
                *sum = *sum + c * g;
            }
        }
        sum
    }
}
