#![allow(clippy::print_stdout, reason = "it prints the table")]
//! Prints `src/product_table.rs`: `cargo run --release -p sh-math --example product_table > crates/sh-math/src/product_table.rs`.

use sh_math::{Quadrature, basis};

/// `∫ Y_i Y_j Y_k dω` for `i, j, k < 25` by a rule that is exact to degree 12.
fn triple_products() -> Vec<[[f64; 25]; 25]> {
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
    tensor
}

fn main() {
    println!(
        "// Made by `examples/product_table.rs`; a test holds every entry, zeros included, against quadrature.\n"
    );
    println!(
        "/// `(i, j, k, ∫ Y_i Y_j Y_k dω)` for `i ≤ j ≤ k < 25` where the integral is not 0, sorted by `k`."
    );
    println!("pub(crate) const TRIPLE_PRODUCTS: &[(u8, u8, u8, f64)] = &[");
    for (k, plane) in triple_products().iter().enumerate() {
        for (j, row) in plane.iter().enumerate() {
            for (i, value) in row.iter().enumerate() {
                if value.abs() > 1e-12 {
                    println!("    ({i}, {j}, {k}, {value:?}),");
                }
            }
        }
    }
    println!("];");
}
