//! What the tests of the workspace share: the adapter they run on, the comparison of a GPU result with its CPU twin, and
//! the check that both agree on memory layout.
//!
//! * [`gpu`]: a device, or a visible skip, or a failure where `INDIRECT_REQUIRE_GPU=1`.
//! * [`compare`], [`compare_exact`]: two sides of different types, so that a side cannot be compared with itself by
//!   mistake.
//! * [`judge`]: the buffers of a whole frame.
//! * [`scenes`]: small scenes.
//! * [`own_renderer`]: a renderer of somebody else, into which techniques are plugged.
//! * [`resources`]: what the buffers of every technique can do.
//! * [`layout`]: `#[repr(C)]` structs, constants and workgroup sizes against naga's reflection.

mod adapter;
mod compare;
pub mod layout;
pub mod own_renderer;
pub mod resources;
pub mod scenes;
mod twins;

pub use adapter::{REQUIRE_GPU_VARIABLE, gpu};
pub use compare::{
    CompareError, Comparison, CpuOutput, Element, GpuOutput, Tolerance, Worst, compare, compare_exact,
};
pub use twins::{Deviation, deviation, judge, perturb};
