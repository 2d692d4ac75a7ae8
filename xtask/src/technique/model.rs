//! What a technique is to the harness, and what it says of itself.

use indirect_core::{Image, SceneProfile};
use indirect_gpu::wgpu::Limits;
use indirect_technique::cpu::Fit;
use indirect_technique::gpu::{GpuTechnique, Twin};
use serde::Serialize;
use serde_json::{Map, Value};

use super::settings::Values;
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
    /// All of them: techniques run on both.
    pub(crate) const ALL: [Self; 2] = [Self::Cpu, Self::Gpu];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Cpu => "cpu",
            Self::Gpu => "gpu",
        }
    }
}

/// What the harness knows of a technique beside its crate.
pub(super) trait Adapter: 'static {
    /// The crate's.
    type Technique: Fit + GpuTechnique;
    /// One line: the idea and its limits.
    const SUMMARY: &'static str;
    /// Settings with which twins are compared, on top of the defaults: a prefix for names, and `KEY=VALUE` pairs.
    const TWINS: &'static [(&'static str, &'static [&'static str])];
    /// The settings that a sweep visits, as `KEY=VALUE` pairs on top of the defaults; each inner list is one curve.
    fn sweep(quick: bool) -> Vec<Vec<Vec<String>>>;
    /// What it models in a scene of this kind, what it leaves out and why, and what the user should know.
    fn notes(profile: &SceneProfile) -> Notes;
    /// What settings model of the light's way: the reference that the image approaches as its sampling gets finer.
    fn transport(_options: &Options<Self>) -> Transport {
        Transport { bounces: 1, occluded: false, emitters: false }
    }
    /// Frames after which the image of something still no longer improves: 1 where nothing is kept from frame to frame.
    fn settles(_options: &Options<Self>) -> usize {
        1
    }
}

pub(super) type Options<A> = <<A as Adapter>::Technique as indirect_technique::Technique>::Options;

/// A curve of a sweep: `base`, and `key` at each of `numbers`.
pub(super) fn curve(base: &[&str], key: &str, numbers: &[u32]) -> Vec<Vec<String>> {
    let of = |n: &u32| base.iter().map(|s| (*s).to_owned()).chain([format!("{key}={n}")]).collect();
    numbers.iter().map(of).collect()
}

/// A way to compute indirect light.
pub(crate) trait Technique {
    /// The name on the command line.
    fn name(&self) -> &'static str;
    /// See [`Adapter::SUMMARY`].
    fn summary(&self) -> &'static str;
    /// The table of its settings, as text.
    fn table(&self) -> String;
    /// Whether it has a setting of that name.
    fn has_key(&self, name: &str) -> bool;
    /// Checks `KEY=VALUE` pairs.
    fn parse(&self, pairs: &[String]) -> Outcome<Values>;
    /// All settings for JSON.
    fn config(&self, values: &Values, profile: &SceneProfile, seed: u32) -> Map<String, Value>;
    /// See [`Adapter::sweep`].
    fn sweep(&self, quick: bool) -> Vec<Vec<Vec<String>>>;
    /// See [`Adapter::notes`].
    fn notes(&self, profile: &SceneProfile) -> Notes;
    /// See [`Adapter::transport`].
    fn transport(&self, values: &Values) -> Transport;
    /// See [`Adapter::settles`].
    fn settles(&self, values: &Values) -> usize;
    /// Every pass, on the GPU and on the CPU, for comparison; the stage has a GPU.
    fn twins(&self, stage: &Stage<'_>) -> Outcome<Vec<Twin>>;
    /// Passes and buffers of the defaults as a mermaid graph; the stage has a GPU.
    fn diagram(&self, stage: &Stage<'_>) -> Outcome<String>;
    /// The limits that a device must have for these values.
    fn required_limits(&self, stage: &Stage<'_>, values: &Values) -> Outcome<Limits>;
    /// Allocates, compiles and uploads what frames need.
    fn prepare(
        &self,
        stage: &Stage<'_>,
        values: &Values,
        seed: u32,
        backend: Backend,
    ) -> Outcome<Box<dyn Renderer>>;
    /// The same with some passes on a backend of their own; the stage has a GPU.
    fn prepare_mixed(
        &self,
        stage: &Stage<'_>,
        values: &Values,
        seed: u32,
        others: Backend,
        choices: &[(String, Backend)],
    ) -> Outcome<Box<dyn Renderer>>;
}

/// What is modelled of the light's way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub(crate) struct Transport {
    /// Indirect bounces, at least 1; [`Self::ALL`] for all of them.
    pub(crate) bounces: u32,
    /// Whether something may stand in the way of the first bounce; later ones are always blocked.
    pub(crate) occluded: bool,
    /// Whether emissive surfaces light what is indirect.
    pub(crate) emitters: bool,
}

impl Transport {
    /// However many bounces there are.
    pub(crate) const ALL: u32 = u32::MAX;
}

impl std::fmt::Display for Transport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.bounces == Self::ALL {
            return write!(f, "all bounces{}", if self.occluded { "" } else { ", the first unoccluded" });
        }
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

/// What a technique models of a scene.
#[derive(Debug, Clone, Default, Serialize)]
pub(crate) struct Notes {
    pub(crate) modelled: Vec<String>,
    pub(crate) skipped: Vec<String>,
    pub(crate) warnings: Vec<String>,
}
