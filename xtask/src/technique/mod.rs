//! The one way in which the harness sees techniques.

mod adapted;
mod diagram;
mod frames;
mod image_space_radiosity;
mod instant_radiosity;
#[cfg(test)]
mod limits;
mod model;
mod notes;
mod radiance_hints;
mod reference;
mod registry;
mod renderer;
mod rsm_gather;
mod settings;
mod sh_grid;

pub(crate) use frames::measure;
pub(crate) use model::{Backend, Bytes, Notes, Pass, Renderer, Technique, Transport};
pub(crate) use reference::{Reference, ReferenceOptions, direct_light, notes as reference_notes};
pub(crate) use registry::{REFERENCE, find, find_all, list, real_time};
pub(crate) use settings::Values;
