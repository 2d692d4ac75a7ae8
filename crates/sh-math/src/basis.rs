//! The basis functions at a direction.

use crate::real::Real;
use crate::table::Table;

/// The unit vector of `v`, or `None` where `v` is zero or not finite. Any finite length is fine, subnormal and
/// near-overflow included.
#[must_use]
pub fn unit<S: Real>(v: impl Into<[S; 3]>) -> Option<[S; 3]> {
    let v: [f64; 3] = v.into().map(Into::into);
    let largest = v.iter().fold(0.0_f64, |a, &x| a.max(x.abs()));
    // NaN fails the sum, which max ignores.
    if !(largest > 0.0 && (v[0] + v[1] + v[2]).is_finite()) {
        return None;
    }
    let v = v.map(|x| x / largest);
    let length = crate::real::float::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    Some(v.map(|x| S::from_f64(x / length)))
}

/// All `N = (l+1)²` basis functions `Y_i(d)` at the unit direction `d`; sr^(-1/2).
///
/// Polynomials up to `l = 4`, [`basis_by_recurrence`] above. A direction of length `1 + ε` gives each band an error of
/// at most about `l²·ε` of its bound `√((2l+1)/4π)`; use [`unit()`] first where the length is unknown.
///
/// ```
/// let y = sh_math::basis::<4, f32>([0.0, 0.0, 1.0]);
/// assert!((y[2] - 0.488_602_5).abs() < 1e-6 && y[1] == 0.0 && y[3] == 0.0);
/// ```
#[must_use]
#[inline]
pub fn basis<const N: usize, S: Real>(d: impl Into<[S; 3]>) -> [S; N] {
    let mut out = [S::default(); N];
    let [x, y, z] = d.into();
    if Table::<N>::BANDS <= 5 {
        unrolled(x, y, z, &mut out);
    } else {
        recurrence(x, y, z, &mut out);
    }
    out
}

/// [`basis`] by a Legendre recurrence at every order: no trigonometric function, no division.
///
/// The associated Legendre functions, scaled to 1 at the pole, run up in `l` (the stable direction) in the form "value
/// plus a share of the last difference", which loses less to rounding than the usual normalised three-term form (5
/// against 10 ulp at `l = 6`); `sin^m θ·{cos, sin}(mφ)` is `{Re, Im}(x + iy)^m`. The factors stay inside f32's range up
/// to `l ≈ 150`.
#[must_use]
pub fn basis_by_recurrence<const N: usize, S: Real>(d: impl Into<[S; 3]>) -> [S; N] {
    let mut out = [S::default(); N];
    let [x, y, z] = d.into();
    recurrence(x, y, z, &mut out);
    out
}

#[inline(always)]
fn recurrence<const N: usize, S: Real>(x: S, y: S, z: S, out: &mut [S; N]) {
    let bands = Table::<N>::BANDS;
    let table = S::recurrence::<N>();
    let (mut re, mut im) = (S::from_f64(1.0), S::default());
    for m in 0..bands {
        if m > 0 {
            (re, im) = (x * re - y * im, x * im + y * re);
        }
        let (mut before, mut g) = (S::default(), S::from_f64(1.0));
        for l in m..bands {
            let [beta, k] = table[l * (l + 1) / 2 + m];
            if l > m {
                let zg = z * g;
                (before, g) = (g, zg + beta * (zg - before));
            }
            let p = k * g;
            let centre = l * (l + 1);
            out[centre + m] = p * re;
            if m > 0 {
                out[centre - m] = p * im;
            }
        }
    }
}

/// `Y_i` up to `l = 4` as nested polynomials in `z` times `{Re, Im}(x + iy)^m`.
#[inline(always)]
fn unrolled<const N: usize, S: Real>(x: S, y: S, z: S, out: &mut [S; N]) {
    let k = |value: f64| S::from_f64(value);
    out[0] = k(0.282_094_791_773_878_14);
    if N < 4 {
        return;
    }
    let k1 = k(0.488_602_511_902_919_9);
    out[1] = k1 * y;
    out[2] = k1 * z;
    out[3] = k1 * x;
    if N < 9 {
        return;
    }
    let z2 = z * z;
    let (c2, s2) = (x * x - y * y, k(2.0) * x * y);
    let k22 = k(0.546_274_215_296_039_6);
    let p21 = k(1.092_548_430_592_079_2) * z;
    out[4] = k22 * s2;
    out[5] = p21 * y;
    // Legendre's P_2; P_3 and P_4 follow.
    let g2 = k(1.5) * z2 - k(0.5);
    out[6] = k(0.630_783_130_505_040_1) * g2;
    out[7] = p21 * x;
    out[8] = k22 * c2;
    if N < 16 {
        return;
    }
    let (c3, s3) = (x * c2 - y * s2, x * s2 + y * c2);
    let k33 = k(0.590_043_589_926_643_5);
    let p32 = k(1.445_305_721_320_277) * z;
    let p31 = k(2.285_228_997_322_328_8) * z2 - k(0.457_045_799_464_465_8);
    out[9] = k33 * s3;
    out[10] = p32 * s2;
    out[11] = p31 * y;
    let g3 = (k(2.5) * z2 - k(1.5)) * z;
    out[12] = k(0.746_352_665_180_230_8) * g3;
    out[13] = p31 * x;
    out[14] = p32 * c2;
    out[15] = k33 * c3;
    if N < 25 {
        return;
    }
    let (c4, s4) = (x * c3 - y * s3, x * s3 + y * c3);
    let k44 = k(0.625_835_735_449_176_1);
    let p43 = k(1.770_130_769_779_930_4) * z;
    let p42 = k(3.311_611_435_151_460_3) * z2 - k(0.473_087_347_878_780_04);
    let p41 = (k(4.683_325_804_901_025) * z2 - k(2.007_139_630_671_868)) * z;
    out[16] = k44 * s4;
    out[17] = p43 * s3;
    out[18] = p42 * s2;
    out[19] = p41 * y;
    let zg3 = z * g3;
    out[20] = k(0.846_284_375_321_634_5) * (zg3 + k(0.75) * (zg3 - g2));
    out[21] = p41 * x;
    out[22] = p42 * c2;
    out[23] = p43 * c3;
    out[24] = k44 * c4;
}
