//! What measures: speed and error of techniques on a scene, the consistency of the gather, and the numbers that come of it.

mod consistency;
mod data;
mod effort;
mod models;
mod scene;
mod split;
mod sweep;
mod truth;

pub(crate) use consistency::measure as consistency;
pub(crate) use data::{
    Consistency, ConsistencyPoint, Machine, Part, Report, Run, SceneReport, TechniqueReport,
};
pub(crate) use effort::Effort;
pub(crate) use scene::scene;
