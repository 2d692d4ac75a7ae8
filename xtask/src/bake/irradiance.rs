//! Irradiance by the path tracer, and what files say of how it was made.

use glam::Vec3;
use indirect_accel::Accel;
use reference_pathtracer::Settings;
use serde::Serialize;

use crate::cli::Component;
use crate::failure::{Failure, Outcome};
use crate::progress;

/// What all files say of how they were made.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Made {
    /// Of the layout of this file.
    pub(super) version: u32,
    pub(super) scene: String,
    pub(super) technique: &'static str,
    pub(super) component: String,
    pub(super) bounces: String,
    pub(super) spp: u64,
    pub(super) seed: u32,
}

/// Irradiance at points, W/m², of the component that is asked for, with a bar on a terminal.
pub(super) fn irradiance(
    accel: &Accel<'_>,
    receivers: &[(Vec3, Vec3)],
    settings: &Settings,
    component: Component,
    message: &str,
) -> Outcome<(Vec<Vec3>, f64)> {
    let (points, normals): (Vec<_>, Vec<_>) = receivers.iter().copied().unzip();
    let bar = progress::bar(1000, message.to_owned());
    let tell = |share: f64| bar.set_position((1000.0 * share) as u64);
    let made = reference_pathtracer::irradiance_with(accel, &points, &normals, settings, &tell)
        .map_err(|e| Failure::Check(e.to_string()))?;
    bar.finish_and_clear();
    let [direct, indirect] = made.noise();
    Ok(match component {
        Component::Full => (made.full().pixels, direct.max(indirect)),
        Component::Direct => (made.direct.pixels, direct),
        Component::Indirect => (made.indirect.pixels, indirect),
    })
}
