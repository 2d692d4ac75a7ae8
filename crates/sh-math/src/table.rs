//! Constants of each basis size, made at compile time.

use core::f64::consts::{FRAC_1_PI, TAU};

/// √x for x ≥ 0 in a constant: Newton's iteration from a guess that halves the exponent.
const fn sqrt(x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    let mut y = f64::from_bits((x.to_bits() >> 1) + 0x1FF8_0000_0000_0000);
    // The guess is good to 1 bit in 16; the error squares each time: 2^-4, -9, -19, -39, -79.
    let mut i = 0;
    while i < 5 {
        y = 0.5 * (y + x / y);
        i += 1;
    }
    y
}

/// Constants of the basis with `N` coefficients.
pub(crate) struct Table<const N: usize>;

impl<const N: usize> Table<N> {
    /// Number of bands, `√N`; a compile error where `N` is not a square.
    pub(crate) const BANDS: usize = {
        let bands = N.isqrt();
        assert!(bands * bands == N && N > 0, "an SH vector has 1, 4, 9, 16, 25, … (l+1)² coefficients");
        bands
    };

    /// At `l(l+1)/2 + m`, `m ≥ 0`: `[β, K]`. With `G` the associated Legendre function without its `sin^m θ`, scaled to 1
    /// at the pole, `G(m,m) = 1` and `G(l,m) = z·G(l−1,m) + β·(z·G(l−1,m) − G(l−2,m))`, `β = (l−m−1)/(l+m)`; then
    /// `K·G(l,m)·sin^m θ·{cos, sin}(mφ)` is orthonormal, `K² = (2 if m > 0)·(2l+1)/4π·(l+m)!/(l−m)!/(2^m m!)²`.
    pub(crate) const F64: [[f64; 2]; N] = {
        let mut out = [[0.0; 2]; N];
        // K²(m,m) 4π/(2m+1) without the 2: (2m)!/(2^m m!)².
        let mut sectoral = 1.0;
        let mut m = 0;
        while m < Self::BANDS {
            let mf = m as f64;
            if m > 0 {
                sectoral *= (2.0 * mf - 1.0) / (2.0 * mf);
            }
            let mut k2 = if m > 0 { 2.0 * sectoral } else { sectoral };
            let mut l = m;
            while l < Self::BANDS {
                let lf = l as f64;
                let mut beta = 0.0;
                if l > m {
                    k2 *= (lf + mf) / (lf - mf);
                    beta = (lf - mf - 1.0) / (lf + mf);
                }
                out[l * (l + 1) / 2 + m] = [beta, sqrt((2.0 * lf + 1.0) * FRAC_1_PI * 0.25 * k2)];
                l += 1;
            }
            m += 1;
        }
        out
    };

    /// [`Self::F64`], rounded.
    pub(crate) const F32: [[f32; 2]; N] = {
        let mut out = [[0.0; 2]; N];
        let mut i = 0;
        while i < N {
            out[i] = [Self::F64[i][0] as f32, Self::F64[i][1] as f32];
            i += 1;
        }
        out
    };

    /// At `l(l+1)/2 + m`, `m ≥ 0`: what `∂z`, and `∂x, ∂y` by way of `m − 1` and of `m + 1`, take from band `l − 1`:
    /// `s·√((l+m)(l−m))`, `s/2·√((l+m)(l+m−1))`, `s/2·√((l−m)(l−m−1))`, `s² = (2l+1)/(2l−1)`, with the `√2` between `m = 0`
    /// and the rest of a real basis: `∂(m=0)` reads both `m = ±1` halves at once, `∂(m=1)` reads `m = 0`.
    pub(crate) const LOWERING_F64: [[f64; 3]; N] = {
        let mut out = [[0.0; 3]; N];
        let mut l = 1;
        while l < Self::BANDS {
            let s2 = (2 * l + 1) as f64 / (2 * l - 1) as f64;
            let mut m = 0;
            while m <= l {
                let z = sqrt(s2 * ((l + m) * (l - m)) as f64);
                let down = if m == 0 { 0.0 } else { ((l + m) * (l + m - 1)) as f64 };
                let up = if m == l { 0.0 } else { ((l - m) * (l - m - 1)) as f64 };
                let down = sqrt(s2 * down * if m == 1 { 0.5 } else { 0.25 });
                let up = sqrt(s2 * up * if m == 0 { 0.5 } else { 0.25 });
                out[l * (l + 1) / 2 + m] = [z, down, up];
                m += 1;
            }
            l += 1;
        }
        out
    };

    /// [`Self::LOWERING_F64`], rounded.
    pub(crate) const LOWERING_F32: [[f32; 3]; N] = {
        let mut out = [[0.0; 3]; N];
        let mut i = 0;
        while i < N {
            let [z, down, up] = Self::LOWERING_F64[i];
            out[i] = [z as f32, down as f32, up as f32];
            i += 1;
        }
        out
    };

    /// `A_l` of the clamped cosine for each coefficient: `2π ∫₀¹ t P_l dt`.
    pub(crate) const COSINE: [f64; N] = {
        let mut out = [0.0; N];
        let mut integral = [0.5, 1.0 / 3.0];
        let mut i = 0;
        while i < N {
            let l = i.isqrt();
            if i == l * l && l >= 2 {
                integral[l % 2] *= (3.0 - l as f64) / (l as f64 + 2.0);
            }
            out[i] = TAU * integral[l % 2];
            i += 1;
        }
        out
    };

    /// `A_l` of the hemisphere for each coefficient: `2π ∫₀¹ P_l dt = 2π (P_{l−1}(0) − P_{l+1}(0))/(2l+1)`, which is
    /// `2π`, 0 for the other even `l`, and `2π P_{l−1}(0)/(l+1)` for odd ones.
    pub(crate) const HEMISPHERE: [f64; N] = {
        let mut out = [0.0; N];
        // P_{l−1}(0) of the odd l reached.
        let mut legendre = 1.0;
        let mut i = 0;
        while i < N {
            let l = i.isqrt();
            let lf = l as f64;
            if i == l * l && l % 2 == 1 && l >= 3 {
                legendre *= -(lf - 2.0) / (lf - 1.0);
            }
            out[i] = if l == 0 {
                TAU
            } else if l % 2 == 1 {
                TAU * legendre / (lf + 1.0)
            } else {
                0.0
            };
            i += 1;
        }
        out
    };
}

#[cfg(test)]
mod tests {
    #[test]
    fn constant_square_root_is_right_to_an_ulp() {
        for i in 1..2000 {
            let x = f64::from(i) / 7.0;
            assert!((super::sqrt(x) - x.sqrt()).abs() <= f64::EPSILON * x.sqrt());
        }
    }
}
