//! The basis functions at a direction.

use crate::real::Real;
use crate::table::Table;

/// The unit vector of `v`, or `None` where `v` is zero or not finite. Any finite length is fine, subnormal and
/// near-overflow included.
#[must_use]
pub fn unit<S: Real>(v: impl Into<[S; 3]>) -> Option<[S; 3]> {
    let v: [f64; 3] = v.into().map(Into::into);
    let largest = v.iter().fold(0.0_f64, |a, &x| a.max(x.abs()));
    // max ignores NaN.
    if !(largest > 0.0 && v.iter().all(|x| x.is_finite())) {
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

/// What `Y_lm = P_lm(z)·{C_m, S_m}(x, y)` is made of up to `l = 4`: `P` and its derivative at `l(l+1)/2 + m`, and
/// `C_m + i·S_m = (x + iy)^m`. What `N` does not reach is 0.
pub(crate) struct Parts<S> {
    pub(crate) p: [S; 15],
    pub(crate) dp: [S; 15],
    pub(crate) c: [S; 5],
    pub(crate) s: [S; 5],
}

/// [`Parts`] at a direction, as nested polynomials. Always inlined, so that what a caller does not read costs nothing.
#[inline(always)]
pub(crate) fn parts<const N: usize, S: Real>(x: S, y: S, z: S) -> Parts<S> {
    let k = |value: f64| S::from_f64(value);
    let zero = S::default();
    let (mut p, mut dp, mut c, mut s) = ([zero; 15], [zero; 15], [zero; 5], [zero; 5]);
    p[0] = k(0.282_094_791_773_878_14);
    c[0] = k(1.0);
    if N >= 4 {
        let k1 = k(0.488_602_511_902_919_9);
        (p[1], dp[1]) = (k1 * z, k1);
        p[2] = k1;
        (c[1], s[1]) = (x, y);
    }
    let z2 = z * z;
    // Legendre's P_2; P_3 follows.
    let g2 = k(1.5) * z2 - k(0.5);
    if N >= 9 {
        (p[3], dp[3]) = (k(0.630_783_130_505_040_1) * g2, k(3.0 * 0.630_783_130_505_040_1) * z);
        let k21 = k(1.092_548_430_592_079_2);
        (p[4], dp[4]) = (k21 * z, k21);
        p[5] = k(0.546_274_215_296_039_6);
        (c[2], s[2]) = (x * x - y * y, k(2.0) * x * y);
    }
    let g3 = (k(2.5) * z2 - k(1.5)) * z;
    if N >= 16 {
        const K30: f64 = 0.746_352_665_180_230_8;
        (p[6], dp[6]) = (k(K30) * g3, k(7.5 * K30) * z2 - k(1.5 * K30));
        const K31: f64 = 2.285_228_997_322_328_8;
        (p[7], dp[7]) = (k(K31) * z2 - k(0.457_045_799_464_465_8), k(2.0 * K31) * z);
        let k32 = k(1.445_305_721_320_277);
        (p[8], dp[8]) = (k32 * z, k32);
        p[9] = k(0.590_043_589_926_643_5);
        (c[3], s[3]) = (x * c[2] - y * s[2], x * s[2] + y * c[2]);
    }
    if N >= 25 {
        const K40: f64 = 0.846_284_375_321_634_5;
        let zg3 = z * g3;
        p[10] = k(K40) * (zg3 + k(0.75) * (zg3 - g2));
        dp[10] = (k(17.5 * K40) * z2 - k(7.5 * K40)) * z;
        const K41: f64 = 4.683_325_804_901_025;
        const L41: f64 = 2.007_139_630_671_868;
        (p[11], dp[11]) = ((k(K41) * z2 - k(L41)) * z, k(3.0 * K41) * z2 - k(L41));
        const K42: f64 = 3.311_611_435_151_460_3;
        (p[12], dp[12]) = (k(K42) * z2 - k(0.473_087_347_878_780_04), k(2.0 * K42) * z);
        let k43 = k(1.770_130_769_779_930_4);
        (p[13], dp[13]) = (k43 * z, k43);
        p[14] = k(0.625_835_735_449_176_1);
        (c[4], s[4]) = (x * c[3] - y * s[3], x * s[3] + y * c[3]);
    }
    Parts { p, dp, c, s }
}

/// Calls `zonal!(l)` and `pair!(l, m)`, `m > 0`, for all coefficients of `N` up to `l = 4` but the first. Straight-line
/// code: the compiler gives up on these loops before the arrays of [`Parts`] are registers.
macro_rules! each_up_to_l4 {
    ($n:ident, $zonal:ident, $pair:ident) => {
        if $n >= 4 {
            $zonal!(1);
            $pair!(1, 1);
        }
        if $n >= 9 {
            $zonal!(2);
            $pair!(2, 1);
            $pair!(2, 2);
        }
        if $n >= 16 {
            $zonal!(3);
            $pair!(3, 1);
            $pair!(3, 2);
            $pair!(3, 3);
        }
        if $n >= 25 {
            $zonal!(4);
            $pair!(4, 1);
            $pair!(4, 2);
            $pair!(4, 3);
            $pair!(4, 4);
        }
    };
}
pub(crate) use each_up_to_l4;

/// `Y_i` up to `l = 4` from its [`Parts`].
#[inline(always)]
fn unrolled<const N: usize, S: Real>(x: S, y: S, z: S, out: &mut [S; N]) {
    values(&parts::<N, S>(x, y, z), out);
}

/// `Y_i = P·{C, S}`.
#[inline(always)]
pub(crate) fn values<const N: usize, S: Real>(Parts { p, c, s, .. }: &Parts<S>, out: &mut [S; N]) {
    out[0] = p[0];
    macro_rules! zonal {
        ($l:literal) => {
            out[$l * ($l + 1)] = p[$l * ($l + 1) / 2]
        };
    }
    macro_rules! pair {
        ($l:literal, $m:literal) => {
            out[$l * ($l + 1) + $m] = p[$l * ($l + 1) / 2 + $m] * c[$m];
            out[$l * ($l + 1) - $m] = p[$l * ($l + 1) / 2 + $m] * s[$m];
        };
    }
    each_up_to_l4!(N, zonal, pair);
}
