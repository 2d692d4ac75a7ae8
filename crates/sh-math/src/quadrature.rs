//! Projection of functions by a rule that is exact to a chosen degree.

use core::f64::consts::{PI, TAU};

use crate::real::{Real, Value, float};
use crate::sh::Sh;

/// Point `k < n` of the `n`-point Gauss–Legendre rule on `[−1, 1]`: `(x, weight)`, exact for degree `2n − 1`.
#[must_use]
pub fn gauss_legendre(n: usize, k: usize) -> (f64, f64) {
    let nf = n as f64;
    // Tricomi's estimate is good to O(n⁻⁴); Newton's iteration squares the error, so four steps reach rounding even
    // from n = 1.
    let mut x = float::cos(PI * (k as f64 + 0.75) / (nf + 0.5));
    let mut slope = 1.0;
    for _ in 0..5 {
        let (mut below, mut p) = (1.0, x);
        for l in 2..=n {
            let lf = l as f64;
            (below, p) = (p, ((2.0 * lf - 1.0) * x * p - (lf - 1.0) * below) / lf);
        }
        slope = nf * (below - x * p) / (1.0 - x * x);
        x -= p / slope;
    }
    (x, 2.0 / ((1.0 - x * x) * slope * slope))
}

/// A rule of `∫ f dω` over the sphere that is exact for every spherical harmonic up to `l = degree`: Gauss–Legendre in
/// `z` times the trapezoid rule in `φ`, `(degree/2 + 1)·(degree + 1)` points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quadrature {
    degree: usize,
}

impl Quadrature {
    /// The rule that is exact up to `l = degree`. A product of two functions of `l ≤ a` and `l ≤ b` has the degree `a+b`.
    #[must_use]
    pub const fn new(degree: usize) -> Self {
        Self { degree }
    }

    /// Number of points.
    #[must_use]
    pub const fn points(&self) -> usize {
        (self.degree / 2 + 1) * (self.degree + 1)
    }

    /// Calls `f(direction, weight)` for each point; the weights sum to `4π`.
    pub fn for_each(&self, mut f: impl FnMut([f64; 3], f64)) {
        let rings = self.degree / 2 + 1;
        let turns = self.degree + 1;
        for ring in 0..rings {
            let (z, w) = gauss_legendre(rings, ring);
            let r = float::sqrt(1.0 - z * z);
            for turn in 0..turns {
                let phi = TAU * (turn as f64 + 0.5) / turns as f64;
                f([r * float::cos(phi), r * float::sin(phi), z], w * TAU / turns as f64);
            }
        }
    }
}

impl<const N: usize, T: Value> Sh<N, T> {
    /// Projects a function, `c_i = ∫ f Y_i dω`, by [`Quadrature`]. Exact up to rounding where `f` has no band above
    /// `degree − l`, `l` this vector's last band: `2l` for a function that this vector can hold. A function with a jump
    /// converges as `1/degree`; the lights with closed forms need none of this.
    ///
    /// ```
    /// use sh_math::Sh;
    /// let f = Sh::<4, f64>::project_fn(2, |[x, _, z]| 1.0 + 2.0 * x - z);
    /// assert!((f.evaluate([1.0, 0.0, 0.0]) - 3.0).abs() < 1e-12);
    /// ```
    #[must_use]
    pub fn project_fn(degree: usize, mut f: impl FnMut([T::Scalar; 3]) -> T) -> Self {
        let mut out = Self::default();
        Quadrature::new(degree).for_each(|d, w| {
            let d = d.map(T::Scalar::from_f64);
            out.project_add(d, f(d) * T::Scalar::from_f64(w));
        });
        out
    }

    /// Projects an equirectangular image of radiance, `width × height` texels row by row: each texel is constant and weighs its exact
    /// solid angle. `None` where there are not `width · height` texels, at least one.
    ///
    /// Row 0 is around +Y; the middle of a row looks along −Z and its right half towards +X: the direction at `(u, v)` of the unit square
    /// is `(sin φ sin θ, cos θ, −cos φ sin θ)` with `φ = 2π(u − ½)`, `θ = πv`. Texels of coarse images are divided until a row is no
    /// higher than 180°/256, over which a harmonic of band `l` is taken at its middle.
    ///
    /// ```
    /// use sh_math::ShL2;
    /// // The upper half of the sky is bright: the irradiance from above is π, from below 0.
    /// let sky: Vec<f32> = (0..32 * 16).map(|i| if i < 32 * 8 { 1.0 } else { 0.0 }).collect();
    /// let sky = ShL2::<f32>::project_equirect([32, 16], &sky).ok_or("512 texels")?;
    /// assert!((sky.irradiance([0.0, 1.0, 0.0]) - core::f32::consts::PI).abs() < 0.01);
    /// assert!(sky.irradiance([0.0, -1.0, 0.0]).abs() < 0.01);
    /// # Ok::<(), &str>(())
    /// ```
    #[must_use]
    pub fn project_equirect([width, height]: [usize; 2], texels: &[T]) -> Option<Self> {
        if texels.is_empty() || width.checked_mul(height) != Some(texels.len()) {
            return None;
        }
        // As many parts along both axes as rows or columns are too coarse.
        let parts = |texels: usize, finest: usize| finest.div_ceil(texels);
        let (across, down) = (parts(width, 512), parts(height, 256));
        let mut out = Self::default();
        for (row, texels) in texels.chunks(width).enumerate() {
            // Rows are summed by themselves, so that single precision holds large images.
            let mut sum = Self::default();
            for part in 0..down {
                let border = |i: usize| float::cos(PI * (row * down + i) as f64 / (height * down) as f64);
                let (top, bottom) = (border(part), border(part + 1));
                let theta = PI * ((row * down + part) as f64 + 0.5) / (height * down) as f64;
                let (sin, cos) = (float::sin(theta), float::cos(theta));
                let weight = (top - bottom) * TAU / (width * across) as f64;
                for (column, &texel) in texels.iter().enumerate() {
                    for part in 0..across {
                        let turn = ((column * across + part) as f64 + 0.5) / (width * across) as f64;
                        let phi = TAU * (turn - 0.5);
                        let d = [float::sin(phi) * sin, cos, -float::cos(phi) * sin];
                        sum.project_add(d.map(T::Scalar::from_f64), texel * T::Scalar::from_f64(weight));
                    }
                }
            }
            for (o, s) in out.0.iter_mut().zip(sum.0) {
                *o = *o + s;
            }
        }
        Some(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::basis::basis;

    fn directions(size: [usize; 2]) -> Vec<[f64; 3]> {
        (0..size[0] * size[1])
            .map(|i| {
                let phi = TAU * (((i % size[0]) as f64 + 0.5) / size[0] as f64 - 0.5);
                let theta = PI * ((i / size[0]) as f64 + 0.5) / size[1] as f64;
                [phi.sin() * theta.sin(), theta.cos(), -phi.cos() * theta.sin()]
            })
            .collect()
    }

    #[test]
    fn images_of_harmonics_project_to_themselves() {
        let size = [256, 128];
        let directions = directions(size);
        for i in 0..16 {
            let texels: Vec<f64> = directions.iter().map(|d| basis::<16, f64>(*d)[i]).collect();
            let sh = Sh::<16, f64>::project_equirect(size, &texels).unwrap();
            for (k, c) in sh.0.iter().enumerate() {
                let expected = f64::from(u8::from(k == i));
                // Texels are constant: a harmonic of band l varies by l·π/128 over one, whose square is lost; of that a twelfth.
                assert!((c - expected).abs() < 2e-3, "{i} {k}: {c}");
            }
        }
    }

    #[test]
    fn constants_are_exact_for_any_size_and_coarse_images_are_divided() {
        for size in [[1, 1], [2, 1], [7, 3], [64, 32], [600, 300]] {
            let sh = Sh::<9, f64>::project_equirect(size, &vec![0.5; size[0] * size[1]]).unwrap();
            let constant = Sh::<9, f64>::constant(0.5);
            // The midpoint rule over 256 rows: π²/24 · (l/256)² of the largest coefficient, and rounding.
            for (found, wanted) in sh.0.iter().zip(constant.0) {
                assert!((found - wanted).abs() < 2e-4, "{size:?} {found} {wanted}");
            }
        }
        assert!(Sh::<9, f32>::project_equirect([4, 2], &[1.0; 7]).is_none());
        assert!(Sh::<9, f32>::project_equirect([0, 0], &[]).is_none());
    }

    #[test]
    fn a_bright_texel_is_a_light_from_its_direction() {
        let size = [128, 64];
        let directions = directions(size);
        for at in [128 * 10 + 40, 64 * 128 / 2 + 17, 128 * 50 + 90] {
            let mut texels = vec![0.0_f64; size[0] * size[1]];
            texels[at] = 1000.0;
            let sh = Sh::<9, f64>::project_equirect(size, &texels).unwrap();
            let row = (at / 128) as f64;
            let border = |i: f64| (PI * i / 64.0).cos();
            let power = 1000.0 * (border(row) - border(row + 1.0)) * TAU / 128.0;
            for (c, y) in sh.0.iter().zip(basis::<9, f64>(directions[at])) {
                // The texel is 2.8° wide: harmonics up to l = 2 vary by less than 5 % over half of it, on average by its square.
                assert!((c - power * y).abs() < 3e-3 * power, "{at}: {c} for {}", power * y);
            }
            // Turned the other way round it would be elsewhere.
            let [x, y, z] = directions[at];
            let mirrored = basis::<9, f64>([-x, y, z]);
            assert!(
                sh.0.iter().zip(mirrored).any(|(c, m)| (c - power * m).abs() > 0.05 * power)
                    || x.abs() < 0.05
            );
        }
    }
}
