//! Products of functions.

use crate::product_table::TRIPLE_PRODUCTS;
use crate::real::{Real, Value};
use crate::sh::Sh;

impl<const N: usize, S: Real> Sh<N, S> {
    /// `f·g` of two functions of `l ≤ 4`, without the bands above this vector's last: `h_k = Σ_ij f_i g_j ∫ Y_i Y_j Y_k`.
    ///
    /// `self` has one channel (a visibility, a weight), `g` any number. Sparse: 4 coefficients use 4 of 20 triple products
    /// `i ≤ j ≤ k`, 9 use 25 of 165, 25 use 238 of 2925. What the product has above the last band is lost, so a product of
    /// three depends on the order.
    ///
    /// ```
    /// use sh_math::Sh;
    /// let (x, y) = (Sh::<9>([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]), Sh::<9>::constant(2.0));
    /// assert!((x.product(&y)[3] - 2.0).abs() < 1e-6);
    /// ```
    #[must_use]
    pub fn product<T: Value<Scalar = S>>(&self, g: &Sh<N, T>) -> Sh<N, T> {
        const { assert!(N <= 25, "triple products are tabulated for l ≤ 4") };
        let f = self;
        let mut out = Sh::default();
        for &(i, j, k, weight) in TRIPLE_PRODUCTS {
            let (i, j, k) = (usize::from(i), usize::from(j), usize::from(k));
            if k >= N {
                break;
            }
            let w = S::from_f64(weight);
            // Each distinct permutation of (i, j, k) once.
            let mut add = |a: usize, b: usize, to: usize| out.0[to] = out.0[to] + g.0[b] * (w * f.0[a]);
            add(i, j, k);
            if i != j {
                add(j, i, k);
            }
            if j != k {
                add(i, k, j);
                if i != k {
                    add(k, i, j);
                }
            }
            if i != j {
                add(j, k, i);
                if j != k {
                    add(k, j, i);
                }
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Quadrature, basis};

    #[test]
    fn table_is_the_quadrature() {
        let mut tensor = vec![[[0.0; 25]; 25]; 25];
        Quadrature::new(12).for_each(|d, w| {
            let y = basis::<25, f64>(d);
            for i in 0..25 {
                for j in i..25 {
                    for k in j..25 {
                        tensor[k][j][i] += w * y[i] * y[j] * y[k];
                    }
                }
            }
        });
        for &(i, j, k, value) in TRIPLE_PRODUCTS {
            let found = core::mem::take(&mut tensor[usize::from(k)][usize::from(j)][usize::from(i)]);
            assert!((found - value).abs() < 1e-14, "({i}, {j}, {k})");
        }
        assert!(tensor.iter().flatten().flatten().all(|v: &f64| v.abs() < 1e-14), "an entry is missing");
        assert!(TRIPLE_PRODUCTS.is_sorted_by_key(|t| t.2), "prefixes must serve smaller N");
        for (n, used) in [(4, 4), (9, 25), (16, 77), (25, 238)] {
            assert_eq!(TRIPLE_PRODUCTS.iter().filter(|t| usize::from(t.2) < n).count(), used);
        }
    }
}
