//! What a report holds: the content of report.json.

use indirect_core::Image;
use indirect_metrics::{BelowFloor, Comparison, Measures};
use serde::Serialize;
use serde_json::{Map, Value};

use crate::technique::{Backend, Bytes, Notes, Pass, Transport};
use testkit::Deviation;

/// A whole report.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    pub(crate) machine: Machine,
    pub(crate) quick: bool,
    pub(crate) scenes: Vec<SceneReport>,
    /// Error of the gather with every texel as a light, against the matched reference, by resolution.
    pub(crate) consistency: Option<Consistency>,
    /// What was left out, and why.
    pub(crate) left_out: Vec<String>,
}

#[derive(Debug, Serialize)]
pub(crate) struct Machine {
    pub(crate) date: String,
    pub(crate) version: &'static str,
    pub(crate) system: String,
    pub(crate) processor: String,
    pub(crate) threads: usize,
    pub(crate) adapter: Option<String>,
}

/// One scene.
#[derive(Debug, Serialize)]
pub(crate) struct SceneReport {
    pub(crate) name: String,
    pub(crate) file: String,
    pub(crate) camera: String,
    pub(crate) size: [u32; 2],
    pub(crate) triangles: usize,
    pub(crate) directional_lights: usize,
    pub(crate) point_lights: usize,
    pub(crate) spot_lights: usize,
    pub(crate) emissive_triangles: usize,
    pub(crate) load_ms: f64,
    /// Time to build the ray structure.
    pub(crate) accel_ms: f64,
    pub(crate) accel_bytes: u64,
    /// Largest resident memory of the process up to the end of this scene, where the system tells.
    pub(crate) peak_bytes: Option<u64>,
    /// Wall time that the report spent on this scene.
    pub(crate) seconds: f64,
    pub(crate) warnings: Vec<String>,
    pub(crate) truth: Truth,
    pub(crate) runs: Vec<Run>,
    /// Indices of the runs that no other run beats in both time and error, fastest first.
    pub(crate) front: Vec<usize>,
    pub(crate) techniques: Vec<TechniqueReport>,
}

/// The reference.
#[derive(Debug, Serialize)]
pub(crate) struct Truth {
    pub(crate) spp: u64,
    /// Standard error of the indirect image, relative to its mean.
    pub(crate) noise: f64,
    pub(crate) mean_indirect: [f32; 3],
    /// Share of the whole image's luminance that is indirect.
    pub(crate) indirect_share: f64,
    /// Linear values are multiplied by this wherever they are shown.
    pub(crate) exposure: f32,
    #[serde(skip)]
    pub(crate) images: TruthImages,
}

#[derive(Debug)]
pub(crate) struct TruthImages {
    pub(crate) full: Image,
    pub(crate) indirect: Image,
    pub(crate) surface: Vec<bool>,
    pub(crate) standard_error: Image,
    pub(crate) relative_mean_error: Option<f64>,
    pub(crate) variance: Image,
}

/// One point of a curve: a technique with one setting.
#[derive(Debug, Serialize)]
pub(crate) struct Run {
    pub(crate) technique: String,
    pub(crate) backend: Backend,
    /// Runs of the same technique, backend and number form one curve.
    pub(crate) curve: usize,
    pub(crate) config: Map<String, Value>,
    /// What tells it from the other runs of its technique.
    pub(crate) label: String,
    pub(crate) prepare_ms: f64,
    pub(crate) frame_ms: f64,
    pub(crate) frames: usize,
    pub(crate) passes: Vec<Pass>,
    pub(crate) bytes: Bytes,
    /// `None` where the reference is black and relative errors mean nothing.
    pub(crate) error: Option<Comparison>,
    pub(crate) below_floor: Option<BelowFloor>,
    /// Against the path tracer with only what the settings model; `None` for the path tracer itself, and as `error`.
    pub(crate) matched: Option<Matched>,
    #[serde(skip)]
    pub(crate) indirect: Image,
}

/// A run against the reference that models no more than it does.
#[derive(Debug, Serialize)]
pub(crate) struct Matched {
    pub(crate) transport: Transport,
    pub(crate) error: Comparison,
}

impl Run {
    pub(crate) fn rel_rmse(&self) -> f64 {
        self.error.as_ref().map_or(f64::INFINITY, |e| e.luminance.rel_rmse)
    }
}

/// What is known of a technique in a scene beyond its runs.
#[derive(Debug, Serialize)]
pub(crate) struct TechniqueReport {
    pub(crate) technique: String,
    pub(crate) notes: Notes,
    pub(crate) split: Option<Split>,
    /// GPU against CPU, per pass; `None` without a GPU.
    pub(crate) twins: Option<Vec<Deviation>>,
}

/// The error of one run taken apart: the parts' biases add up to the whole.
#[derive(Debug, Serialize)]
pub(crate) struct Split {
    /// Settings of the run.
    pub(crate) label: String,
    pub(crate) parts: Vec<Part>,
    pub(crate) whole: Part,
}

#[derive(Debug, Serialize)]
pub(crate) struct Part {
    pub(crate) name: &'static str,
    pub(crate) explanation: String,
    pub(crate) measures: Measures,
    /// What the noise of both images alone would give as `measures.rel_rmse`.
    pub(crate) noise: f64,
}

impl Part {
    /// RMS difference without the share of noise, which adds in squares; and whether noise is the larger share, so that the
    /// difference is at most that.
    pub(crate) fn own(&self) -> (f64, bool) {
        let (rms, noise) = (self.measures.rel_rmse, self.noise);
        let own = (rms * rms - noise * noise).max(0.0).sqrt();
        if own < noise { (noise, true) } else { (own, false) }
    }
}

/// The consistency curve.
#[derive(Debug, Serialize)]
pub(crate) struct Consistency {
    pub(crate) scene: &'static str,
    pub(crate) points: Vec<ConsistencyPoint>,
    /// Of the reference, away from the corner.
    pub(crate) noise_floor: f64,
}

#[derive(Debug, Serialize)]
pub(crate) struct ConsistencyPoint {
    pub(crate) resolution: u32,
    pub(crate) vpls: usize,
    /// Over all pixels.
    pub(crate) rel_rmse: f64,
    /// Over the pixels at least a tenth of the scene away from the corner.
    pub(crate) rel_rmse_away: f64,
}
