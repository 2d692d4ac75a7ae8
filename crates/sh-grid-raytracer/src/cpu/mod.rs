//! Frames on the CPU.

mod field;
mod gather;
mod interpolate;
mod lookup;
mod radiance;
mod store;
mod technique;
mod traverse;
mod whitted;

pub use field::{Cells, FieldSettings, MOST_COEFFICIENTS, Sight, field};
pub use gather::{Looks, gather, gather_final, gather_samples, obscure};
pub use interpolate::{FULL_SIDE, Field, Local};
pub use lookup::{Look, Lookup};
pub use radiance::{RUN, levels, radiance, runs, sort};
pub use store::Store;
pub(crate) use store::gets_away;
pub use technique::{Fit, Frame, indirect};
pub use traverse::{VoxelHit, first_voxel};
pub use whitted::{MIRROR, Whitted};
