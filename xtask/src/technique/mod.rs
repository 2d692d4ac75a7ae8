//! The one way in which the harness sees techniques.

mod image_space_radiosity;
mod notes;
mod radiance_hints;
mod reference;
mod renderer;
mod rsm_gather;
mod settings;

use std::marker::PhantomData;
use std::time::Instant;

use indirect_core::settings::Settings;
use indirect_core::{Image, SceneProfile};
use indirect_gpu::wgpu::Limits;
use indirect_technique::cpu::Fit;
use indirect_technique::gpu::{GpuTechnique, Resources, Twin};
use serde::Serialize;
use serde_json::{Map, Value};

pub(crate) use reference::{Reference, ReferenceOptions, direct_light, notes as reference_notes};
pub(crate) use settings::Values;

use crate::failure::{Failure, Outcome};
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
trait Adapter: 'static {
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
        Transport { bounces: 1, occluded: false }
    }
}

type Options<A> = <<A as Adapter>::Technique as indirect_technique::Technique>::Options;

/// A curve of a sweep: `base`, and `key` at each of `numbers`.
fn curve(base: &[&str], key: &str, numbers: &[u32]) -> Vec<Vec<String>> {
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
    /// Every pass, on the GPU and on the CPU, for comparison; the stage has a GPU.
    fn twins(&self, stage: &Stage<'_>) -> Outcome<Vec<Twin>>;
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

/// A technique through its adapter.
struct Adapted<A>(PhantomData<A>);

impl<A: Adapter> Technique for Adapted<A> {
    fn name(&self) -> &'static str {
        <A::Technique as indirect_technique::Technique>::NAME
    }

    fn summary(&self) -> &'static str {
        A::SUMMARY
    }

    fn table(&self) -> String {
        settings::table::<A::Technique>()
    }

    fn has_key(&self, name: &str) -> bool {
        settings::keys::<A::Technique>().any(|k| k.name == name)
    }

    fn parse(&self, pairs: &[String]) -> Outcome<Values> {
        Values::parse::<A::Technique, _>(pairs)
    }

    fn config(&self, values: &Values, profile: &SceneProfile, seed: u32) -> Map<String, Value> {
        // The pairs were checked when they were parsed.
        let mut config = values.json::<A::Technique>(profile).unwrap_or_default();
        config.entry("seed").and_modify(|v| {
            if *v == Value::from(0) {
                *v = seed.into();
            }
        });
        config
    }

    fn sweep(&self, quick: bool) -> Vec<Vec<Vec<String>>> {
        A::sweep(quick)
    }

    fn notes(&self, profile: &SceneProfile) -> Notes {
        A::notes(profile)
    }

    fn transport(&self, values: &Values) -> Transport {
        let settings = values.settings::<A::Technique>(&SceneProfile::default());
        A::transport(&settings.map(|(options, _)| options).unwrap_or_default())
    }

    fn twins(&self, stage: &Stage<'_>) -> Outcome<Vec<Twin>> {
        let mut twins = Vec::new();
        for (prefix, pairs) in A::TWINS {
            let values = Values::parse::<A::Technique, _>(pairs)?;
            let found = renderer::Gpu::<A::Technique>::new(stage, &values, 1)?.twins(stage)?;
            twins.extend(found.into_iter().map(|t| Twin { buffer: format!("{prefix}{}", t.buffer), ..t }));
        }
        Ok(twins)
    }

    fn required_limits(&self, stage: &Stage<'_>, values: &Values) -> Outcome<Limits> {
        let setup = renderer::setup::<A::Technique>(stage, values, 0)?;
        let maps = rsm::views::views(stage.scene).len();
        Ok(Resources::<A::Technique>::required_limits(&setup, stage.size, maps))
    }

    fn prepare(
        &self,
        stage: &Stage<'_>,
        values: &Values,
        seed: u32,
        backend: Backend,
    ) -> Outcome<Box<dyn Renderer>> {
        Ok(match backend {
            Backend::Cpu => Box::new(renderer::Cpu::<A::Technique>::new(stage, values, seed)?),
            Backend::Gpu => Box::new(renderer::Gpu::<A::Technique>::new(stage, values, seed)?),
        })
    }

    fn prepare_mixed(
        &self,
        stage: &Stage<'_>,
        values: &Values,
        seed: u32,
        others: Backend,
        choices: &[(String, Backend)],
    ) -> Outcome<Box<dyn Renderer>> {
        Ok(Box::new(renderer::Mixed::<A::Technique>::new(stage, values, seed, others, choices)?))
    }
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

/// What a technique models of a scene.
#[derive(Debug, Clone, Default, Serialize)]
pub(crate) struct Notes {
    pub(crate) modelled: Vec<String>,
    pub(crate) skipped: Vec<String>,
    pub(crate) warnings: Vec<String>,
}

/// All real-time techniques.
pub(crate) fn real_time() -> Vec<Box<dyn Technique>> {
    vec![
        Box::new(Adapted::<rsm_gather::Gather>(PhantomData)),
        Box::new(Adapted::<radiance_hints::Hints>(PhantomData)),
        Box::new(Adapted::<image_space_radiosity::Radiosity>(PhantomData)),
    ]
}

/// Name of the path tracer, which is not a real-time technique but answers to the same command.
pub(crate) const REFERENCE: &str = "reference";

/// The real-time technique of that name.
pub(crate) fn find(name: &str) -> Outcome<Box<dyn Technique>> {
    real_time().into_iter().find(|t| t.name() == name).ok_or_else(|| unknown(name))
}

/// The real-time techniques of these names; all of them where there are no names.
pub(crate) fn find_all(names: &[String]) -> Outcome<Vec<Box<dyn Technique>>> {
    if names.iter().any(|n| n == REFERENCE) {
        return Err(Failure::Input(format!(
            "--technique {REFERENCE}: it is what the others are held against; use `render`"
        )));
    }
    if names.is_empty() { Ok(real_time()) } else { names.iter().map(|n| find(n)).collect() }
}

fn unknown(name: &str) -> Failure {
    let known: Vec<_> = std::iter::once(REFERENCE).chain(real_time().iter().map(|t| t.name())).collect();
    Failure::Input(format!("--technique {name}: unknown; there are: {}", known.join(", ")))
}

/// The text of `--list`.
pub(crate) fn list() -> String {
    let mut out = format!("{REFERENCE}\n    {}\n", reference::SUMMARY);
    out += "    options: --bounces N|inf, --unoccluded, --spp N, --seed N, --pixel-filter center|box\n";
    for t in real_time() {
        let backends = Backend::ALL.map(Backend::name);
        out += &format!("\n{}  (backends: {})\n    {}\n", t.name(), backends.join(", "), t.summary());
        out += &t.table();
    }
    out
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
