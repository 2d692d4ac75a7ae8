//! Rotation of functions on the sphere.

use glam::DMat3;

use crate::real::{Real, Value, float};
use crate::sh::Sh;
use crate::table::Table;

/// A rotation (or reflection) of SH vectors with `N` coefficients: block-diagonal, one `(2l+1)²` block per band.
///
/// Built by the recursion of Ivanic & Ruedenberg 1996 (J. Phys. Chem. 100, 6342) with the correction of 1998 (J. Phys.
/// Chem. A 102, 9099), from a matrix that is first made orthogonal to f64's precision. Entries are f64, and so are the
/// sums when it is applied: rounded to f32, one rotation applied a thousand times would gain or lose 1.5e-5 of a
/// band's energy. Blocks are stored in an N×N matrix by columns; only they are read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rotation<const N: usize> {
    columns: [[f64; N]; N],
}

impl<const N: usize> Rotation<N> {
    /// The rotation that takes the direction `d` to `m·d`: `rotated.evaluate(m·d) = sh.evaluate(d)`.
    ///
    /// `m` must be orthogonal up to f32 rounding (a reflection is fine); of anything else the nearest orthogonal
    /// matrix, to second order, is taken.
    ///
    /// ```
    /// use glam::{Mat3, Vec3};
    /// use sh_math::{Rotation, Sh, Zonal};
    /// let lobe: Sh<9> = Zonal::clamped_cosine().toward(Vec3::X);
    /// let m = Mat3::from_rotation_y(1.0);
    /// let turned = Rotation::new(&m.as_dmat3()).apply(&lobe);
    /// assert!((turned.evaluate(m * Vec3::X) - lobe.evaluate(Vec3::X)).abs() < 1e-6);
    /// ```
    #[must_use]
    pub fn new(m: &DMat3) -> Self {
        Self { columns: rotation_blocks(&orthogonal(m.to_cols_array_2d())) }
    }

    /// The rotated function.
    #[must_use]
    #[inline]
    pub fn apply<T: Value>(&self, sh: &Sh<N, T>) -> Sh<N, T> {
        let mut out = *sh;
        for channel in 0..T::CHANNELS {
            let mut sums = [0.0; N];
            for l in 1..Table::<N>::BANDS {
                let band = l * l..(l + 1) * (l + 1);
                for j in band.clone() {
                    let c: f64 = sh.0[j].channel(channel).into();
                    for (sum, entry) in sums[band.clone()].iter_mut().zip(&self.columns[j][band.clone()]) {
                        *sum += c * entry;
                    }
                }
            }
            for (to, sum) in out.0.iter_mut().zip(sums).skip(1) {
                to.set_channel(channel, T::Scalar::from_f64(sum));
            }
        }
        out
    }

    /// The rotation back.
    #[must_use]
    pub fn inverse(&self) -> Self {
        Self { columns: core::array::from_fn(|i| core::array::from_fn(|j| self.columns[j][i])) }
    }

    /// The entry that takes coefficient `j` to coefficient `i`; both below `N`.
    #[must_use]
    pub fn entry(&self, i: usize, j: usize) -> f64 {
        self.columns[j][i]
    }
}

impl<const N: usize, T: Value> Sh<N, T> {
    /// The function turned by `m`; see [`Rotation::new`], which is worth keeping when several functions turn alike.
    #[must_use]
    pub fn rotate(&self, m: &<T::Scalar as Real>::Mat3) -> Self {
        Rotation::new(&T::Scalar::matrix(m)).apply(self)
    }
}

/// One Newton step toward the polar factor, `M (3 − MᵀM)/2`: squares the departure from orthogonality (f32's 1e-7
/// becomes 1e-14).
fn orthogonal(m: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let mut out = m;
    for (j, column) in out.iter_mut().enumerate() {
        for (i, value) in column.iter_mut().enumerate() {
            *value = 1.5 * m[j][i] - 0.5 * (0..3).map(|k| m[k][i] * dot(m[k], m[j])).sum::<f64>();
        }
    }
    out
}

fn rotation_blocks<const N: usize>(columns: &[[f64; 3]; 3]) -> [[f64; N]; N] {
    // out[column][row]
    let mut out = [[0.0; N]; N];
    out[0][0] = 1.0;
    // Band 1 is (y, z, x).
    const AXIS: [usize; 3] = [1, 2, 0];
    let r: [[f64; 3]; 3] = core::array::from_fn(|i| core::array::from_fn(|j| columns[AXIS[j]][AXIS[i]]));
    if N >= 4 {
        for (j, column) in out[1..4].iter_mut().enumerate() {
            for (i, row) in r.iter().enumerate() {
                column[1 + i] = row[j];
            }
        }
    }
    for l in 2..Table::<N>::BANDS as isize {
        for m in -l..=l {
            let [u, v, w] = row_factors(l, m);
            for n in -l..=l {
                // p(i, a) is the paper's P_i(l; a, n): band 1 times band l−1.
                let p = |i: isize, a: isize| {
                    let below = |b: isize| out[(l * (l - 1) + b) as usize][(l * (l - 1) + a) as usize];
                    let ri = r[(i + 1) as usize];
                    if n == l {
                        ri[2] * below(l - 1) - ri[0] * below(1 - l)
                    } else if n == -l {
                        ri[2] * below(1 - l) + ri[0] * below(l - 1)
                    } else {
                        ri[1] * below(n)
                    }
                };
                let mut sum = 0.0;
                if m.abs() < l {
                    sum += u * p(0, m);
                }
                let root2 = core::f64::consts::SQRT_2;
                sum += v * match m {
                    0 => p(1, 1) + p(-1, -1),
                    1 => p(1, 0) * root2,
                    -1 => p(-1, 0) * root2,
                    2.. => p(1, m - 1) - p(-1, 1 - m),
                    _ => p(1, m + 1) + p(-1, -m - 1),
                };
                if m != 0 && m.abs() < l - 1 {
                    sum += w * if m > 0 { p(1, m + 1) + p(-1, -m - 1) } else { p(1, m - 1) - p(-1, 1 - m) };
                }
                let d = if n.abs() == l { 2 * l * (2 * l - 1) } else { (l + n) * (l - n) };
                out[(l * (l + 1) + n) as usize][(l * (l + 1) + m) as usize] = sum / float::sqrt(d as f64);
            }
        }
    }
    out
}

/// The paper's `u, v, w` without the divisor that depends on the column.
fn row_factors(l: isize, m: isize) -> [f64; 3] {
    let a = m.abs();
    let root = |x: isize| float::sqrt(x as f64);
    let u = root((l + m) * (l - m));
    let v = if m == 0 { -0.5 * root(2 * (l - 1) * l) } else { 0.5 * root((l + a - 1) * (l + a)) };
    let w = if m == 0 { 0.0 } else { -0.5 * root((l - a - 1) * (l - a)) };
    [u, v, w]
}
