//! The float functions that `core` lacks, from `std` or `libm`, and the polynomials shared with the WGSL twin.

#[cfg(all(feature = "std", not(feature = "libm")))]
mod backend {
    #[inline]
    pub(crate) fn sqrt(x: f32) -> f32 {
        x.sqrt()
    }
    #[inline]
    pub(crate) fn sqrt64(x: f64) -> f64 {
        x.sqrt()
    }
    #[inline]
    pub(crate) fn sin_cos(x: f32) -> (f32, f32) {
        x.sin_cos()
    }
    #[inline]
    pub(crate) fn cos64(x: f64) -> f64 {
        x.cos()
    }
    #[inline]
    pub(crate) fn atan2(y: f32, x: f32) -> f32 {
        y.atan2(x)
    }
    #[inline]
    pub(crate) fn exp_m1(x: f32) -> f32 {
        x.exp_m1()
    }
    #[inline]
    pub(crate) fn ln_1p(x: f32) -> f32 {
        x.ln_1p()
    }
    #[inline]
    pub(crate) fn powf(x: f32, y: f32) -> f32 {
        x.powf(y)
    }
}

#[cfg(not(all(feature = "std", not(feature = "libm"))))]
mod backend {
    pub(crate) use libm::{
        atan2f as atan2, cos as cos64, expm1f as exp_m1, log1pf as ln_1p, powf, sincosf as sin_cos,
        sqrt as sqrt64, sqrtf as sqrt,
    };
}

pub(crate) use backend::*;

/// `(sin, cos)` of `π/4·t` for `t` in `[−1, 1]`, to 2 ulp: Chebyshev fits of `sin(π/4·t)/t` and `cos(π/4·t)` in `t²`.
#[inline]
pub(crate) fn sin_cos_eighth(t: f32) -> (f32, f32) {
    let t2 = t * t;
    (
        t * (SIN[0] + t2 * (SIN[1] + t2 * (SIN[2] + t2 * SIN[3]))),
        COS[0] + t2 * (COS[1] + t2 * (COS[2] + t2 * (COS[3] + t2 * COS[4]))),
    )
}

const SIN: [f32; 4] = [core::f32::consts::FRAC_PI_4, -0.080_745_436, 0.002_490_006_9, -3.595_429e-5];
const COS: [f32; 5] = [1.0, -0.308_425_13, 0.015_854_325, -3.259_386e-4, 3.529_797_1e-6];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sin_cos_to_two_ulp() {
        for i in -(1 << 16)..=1 << 16 {
            let t = i as f32 / 65536.0;
            let (s, c) = sin_cos_eighth(t);
            let (sin, cos) = (f64::from(t) * core::f64::consts::FRAC_PI_4).sin_cos();
            // An ulp of the result is at most 2^-23 times it.
            assert!((f64::from(s) - sin).abs() <= 2.0 * sin.abs() * f64::from(f32::EPSILON), "sin {t}");
            assert!((f64::from(c) - cos).abs() <= 2.0 * cos * f64::from(f32::EPSILON), "cos {t}");
        }
    }
}
