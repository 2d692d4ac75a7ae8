#![doc = include_str!("../README.md")]
#![cfg_attr(not(any(feature = "std", test)), no_std)]

#[cfg(not(any(feature = "std", feature = "libm", test)))]
compile_error!(
    "sh-math needs a source of floating-point functions: switch on its feature `std` (the default) or `libm`"
);

mod basis;
mod batch;
mod dering;
mod gradient;
mod lights;
mod minimum;
#[cfg(feature = "half")]
mod pack;
mod product;
mod product_table;
mod quadrature;
mod real;
mod rotation;
mod sh;
mod table;
pub mod twins;
mod zonal;

pub use basis::{basis, basis_by_recurrence, unit};
pub use batch::{BatchError, basis_batch};
pub use dering::Mean;
pub use glam;
pub use gradient::{basis_and_gradient, basis_and_gradient_by_recurrence};
pub use minimum::Minimum;
#[cfg(feature = "half")]
pub use pack::PackedSh;
pub use quadrature::{Quadrature, gauss_legendre};
pub use real::{Real, Value};
pub use rotation::Rotation;
pub use sh::{Sh, ShL1, ShL2, ShL3, ShL4, band};
pub use zonal::Zonal;
