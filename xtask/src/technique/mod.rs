//! The one way in which the harness sees techniques.

mod image_space_radiosity;
mod params;
mod radiance_hints;
mod reference;
mod registry;
mod rsm_gather;
mod shared;

use std::time::Instant;

use indirect_core::{Image, SceneProfile};
use serde::Serialize;
use serde_json::{Map, Value};

pub(crate) use params::{Param, Values};
pub(crate) use reference::{Reference, ReferenceOptions, direct_light, notes as reference_notes};
pub(crate) use registry::{REFERENCE, find, find_all, list, real_time};

use crate::failure::Outcome;
use crate::stage::Stage;

/// Where the passes of a technique run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Backend {
    Cpu,
    Gpu,
}

impl Backend {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Cpu => "cpu",
            Self::Gpu => "gpu",
        }
    }
}

/// A way to compute indirect light.
pub(crate) trait Technique {
    /// The name on the command line.
    fn name(&self) -> &'static str;
    /// One line: the idea and its limits.
    fn summary(&self) -> &'static str;
    /// What `--set` changes.
    fn params(&self) -> &'static [Param];
    /// Where it can run.
    fn backends(&self) -> &'static [Backend];
    /// The settings that a sweep visits, as `KEY=VALUE` pairs on top of the defaults; each inner list is one curve.
    fn sweep(&self, quick: bool) -> Vec<Vec<Vec<String>>>;
    /// What it models in a scene of this kind, what it leaves out and why, and what the user should know.
    fn notes(&self, profile: &SceneProfile) -> Notes;
    /// Every pass, on the GPU and on the CPU, for comparison; the stage has a GPU.
    fn twins(&self, stage: &Stage<'_>) -> Outcome<Vec<Twin>>;
    /// What settings model of the light's way: the reference that the image approaches as its sampling gets finer.
    fn transport(&self, _values: &Values) -> Transport {
        Transport { bounces: 1, occluded: false }
    }
    /// Bytes of the largest GPU buffer that these values need; beyond 128 MiB the device is asked for it.
    fn largest_buffer(&self, profile: &SceneProfile, size: [u32; 2], values: &Values) -> u64;
    /// Allocates, compiles and uploads what frames need.
    fn prepare(
        &self,
        stage: &Stage<'_>,
        values: &Values,
        seed: u32,
        backend: Backend,
    ) -> Outcome<Box<dyn Renderer>>;
}

/// What is modelled of the light's way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub(crate) struct Transport {
    /// Indirect bounces, at least 1.
    pub(crate) bounces: u32,
    /// Whether something may stand in the way of the first bounce; later ones are always blocked.
    pub(crate) occluded: bool,
}

impl std::fmt::Display for Transport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let s = if self.bounces == 1 { "" } else { "s" };
        write!(f, "{} bounce{s}{}", self.bounces, if self.occluded { "" } else { ", the first unoccluded" })
    }
}

/// A technique made ready for one scene, image size and set of values.
///
/// What a frame is given may have moved since the last one: lights, camera and vertices, but not their numbers, nor the image's
/// size, nor the device.
pub(crate) trait Renderer {
    /// Renders a frame as if lights and camera had moved, and returns its wall time in milliseconds, without read-back.
    fn frame(&mut self, stage: &Stage<'_>) -> Outcome<f64>;
    /// The indirect light of the last frame, W/(sr·m²).
    fn image(&mut self) -> Outcome<Image>;
    /// Time of every pass of a frame like the last.
    fn passes(&mut self, stage: &Stage<'_>) -> Outcome<Vec<Pass>>;
    /// Memory that it holds.
    fn bytes(&self) -> Bytes;
}

/// A pass and its time.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Pass {
    pub(crate) name: String,
    pub(crate) ms: f64,
}

/// Memory of a technique, without the scene itself.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub(crate) struct Bytes {
    pub(crate) cpu: u64,
    pub(crate) gpu: u64,
}

/// Contents of a buffer.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Data {
    /// Numbers that agree up to rounding, so many to an element.
    Floats(Vec<f32>, usize),
    /// Numbers that agree exactly.
    Ints(Vec<u32>),
}

impl Data {
    pub(crate) fn is_empty(&self) -> bool {
        match self {
            Self::Floats(values, _) => values.is_empty(),
            Self::Ints(values) => values.is_empty(),
        }
    }
}

/// One buffer of a pass from both backends, made from the same input.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Twin {
    pub(crate) pass: String,
    pub(crate) buffer: String,
    pub(crate) cpu: Data,
    pub(crate) gpu: Data,
    /// Per element, whether the backends see the same triangle there; `None` where that is no question.
    pub(crate) same_triangle: Option<Vec<bool>>,
}

impl Twin {
    /// Adds 1 % to the largest number of the GPU (1 where all are 0), or 1 to the first whole one: what a comparison must
    /// notice.
    pub(crate) fn perturb(&mut self) {
        let mask = self.same_triangle.as_deref();
        match &mut self.gpu {
            Data::Ints(values) => values.iter_mut().take(1).for_each(|v| *v = v.wrapping_add(1)),
            Data::Floats(values, components) => {
                let seen = |i: usize| mask.is_none_or(|m| m[i / *components]);
                let largest = (0..values.len())
                    .filter(|i| seen(*i))
                    .max_by(|a, b| values[*a].abs().total_cmp(&values[*b].abs()));
                if let Some(i) = largest {
                    values[i] = if values[i] == 0.0 { 1.0 } else { 1.01 * values[i] };
                }
            }
        }
    }
}

/// What a technique models of a scene.
#[derive(Debug, Clone, Default, Serialize)]
pub(crate) struct Notes {
    pub(crate) modelled: Vec<String>,
    pub(crate) skipped: Vec<String>,
    pub(crate) warnings: Vec<String>,
}

/// Frames of one renderer, measured.
#[derive(Debug)]
pub(crate) struct Measured {
    pub(crate) indirect: Image,
    /// Median.
    pub(crate) frame_ms: f64,
    pub(crate) frames: usize,
    pub(crate) passes: Vec<Pass>,
}

/// Renders a frame to warm up, then frames until the time is spent: at least `least`, at most 15.
pub(crate) fn measure(
    renderer: &mut dyn Renderer,
    stage: &Stage<'_>,
    least: usize,
    seconds: f64,
) -> Outcome<Measured> {
    const MOST: usize = 15;
    // The first frame on a GPU may wait a second for its shaders: only one that takes much longer counts as a frame.
    const LONG_MS: f64 = 4e3;
    let start = Instant::now();
    let first = renderer.frame(stage)?;
    let mut times = if first > LONG_MS.max(seconds * 1e3) { vec![first] } else { Vec::new() };
    while times.len() < least || (times.len() < MOST && start.elapsed().as_secs_f64() < seconds) {
        times.push(renderer.frame(stage)?);
    }
    times.sort_by(f64::total_cmp);
    Ok(Measured {
        frame_ms: times[(times.len() - 1) / 2],
        frames: times.len(),
        indirect: renderer.image()?,
        passes: renderer.passes(stage)?,
    })
}

/// A configuration for JSON: the values and the seed.
pub(crate) fn config(values: &Values, seed: u32) -> Map<String, Value> {
    let mut config = values.json();
    config.insert("seed".into(), seed.into());
    config
}
