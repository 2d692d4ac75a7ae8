//! The path tracer behind the harness: the truth, and the baseline curve of the charts.

use std::path::PathBuf;
use std::time::Instant;

use indirect_core::{Image, SceneProfile};
use reference_pathtracer::{
    Bounces, Components, Estimate, PixelFilter, Samples, Settings, render_cached, render_with,
};
use serde_json::{Map, Value, json};

use super::model::Notes;
use crate::failure::{self, Failure, Outcome};
use crate::stage::Stage;
use crate::{progress, warn};

pub(crate) const SUMMARY: &str =
    "unbiased path tracing on the CPU: the truth that techniques are measured against";

/// What the command line asks of the reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ReferenceOptions {
    pub(crate) components: Components,
    pub(crate) bounces: Bounces,
    pub(crate) unoccluded: bool,
    pub(crate) spp: u32,
    /// Stop early at this noise.
    pub(crate) noise_target: Option<f64>,
    pub(crate) seed: u32,
    pub(crate) pixel_filter: PixelFilter,
}

impl ReferenceOptions {
    fn settings(&self) -> Settings {
        Settings {
            components: self.components,
            bounces: self.bounces,
            unoccluded: self.unoccluded,
            samples: Samples::count(self.spp),
            noise_target: self.noise_target,
            seed: self.seed,
            pixel_filter: self.pixel_filter,
            ..Settings::default()
        }
    }

    /// For JSON.
    pub(crate) fn config(&self) -> Map<String, Value> {
        let bounces = match self.bounces {
            Bounces::Count(n) => json!(n),
            Bounces::Infinite => json!("inf"),
        };
        let filter = match self.pixel_filter {
            PixelFilter::Center => "center",
            PixelFilter::Box => "box",
        };
        let pairs = [
            ("bounces", bounces),
            ("pixel_filter", json!(filter)),
            ("seed", json!(self.seed)),
            ("spp", json!(self.spp)),
            ("unoccluded", json!(self.unoccluded)),
        ];
        pairs.into_iter().map(|(k, v)| (k.to_owned(), v)).collect()
    }
}

/// An estimate and the time it took.
#[derive(Debug)]
pub(crate) struct Reference {
    pub(crate) estimate: Estimate,
    pub(crate) ms: f64,
}

impl Reference {
    /// Renders; nothing is stored, so that the time is that of the work.
    pub(crate) fn render(stage: &Stage<'_>, options: &ReferenceOptions, what: &str) -> Outcome<Self> {
        let bar = progress::bar(1000, what);
        let start = Instant::now();
        let estimate = render_with(&stage.accel, &stage.view, stage.size, &options.settings(), &|done| {
            bar.set_position((done * 1000.0) as u64);
        })
        .map_err(|e| Failure::Input(format!("{}: {e}", stage.file)))?;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        bar.finish_and_clear();
        Ok(Self { estimate, ms })
    }

    /// Renders, or finds the result of an earlier run under `target/`. Where that cannot be written nothing is kept.
    pub(crate) fn cached(stage: &Stage<'_>, options: &ReferenceOptions, what: &str) -> Outcome<Estimate> {
        if let Err(f) = failure::will_write(&cache().join("probe")) {
            warn(format!("references are not kept: {}", f.line()));
            return Ok(Self::render(stage, options, what)?.estimate);
        }
        let bar = progress::bar(1000, what);
        let settings = options.settings();
        let estimate = render_cached(&cache(), &stage.accel, &stage.view, stage.size, &settings, &|done| {
            bar.set_position((done * 1000.0) as u64);
        })
        .map_err(|e| Failure::Input(format!("{}: {e}", stage.file)))?;
        bar.finish_and_clear();
        Ok(estimate)
    }
}

/// The direct light of a technique's image: the reference's through pixel centres, exact for punctual lights and with
/// `spp` samples for emissive triangles.
pub(crate) fn direct_light(stage: &Stage<'_>, spp: u32, seed: u32) -> Outcome<Image> {
    let options = ReferenceOptions {
        components: Components::Direct,
        bounces: Bounces::Count(0),
        unoccluded: false,
        spp: if stage.profile.emissive_triangles > 0 { spp } else { 1 },
        noise_target: None,
        seed,
        pixel_filter: PixelFilter::Center,
    };
    Ok(Reference::cached(stage, &options, "direct light")?.direct)
}

/// What the path tracer models.
pub(crate) fn notes(profile: &SceneProfile) -> Notes {
    let mut notes = Notes::default();
    let kinds = [
        (profile.directional_lights, "directional lights"),
        (profile.spot_lights, "spot lights"),
        (profile.point_lights, "point lights"),
        (profile.emissive_triangles, "emissive triangles"),
    ];
    notes.modelled.extend(kinds.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}")));
    if profile.glossy_triangles > 0 {
        let n = profile.glossy_triangles;
        notes.skipped.push(format!("gloss of {n} triangles: all surfaces reflect diffusely"));
    }
    notes
}

/// Where references are kept between runs.
fn cache() -> PathBuf {
    crate::target().join("references")
}
