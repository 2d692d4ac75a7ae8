//! The command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

/// Renders scenes with real-time techniques, holds them against a path-traced truth and their CPU twins, and reports.
///
/// SCENE is a path to a .gltf or .glb file, or the name of a fixture (see `fixtures --list`).
#[derive(Debug, Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", version, arg_required_else_help = true)]
pub(crate) struct Cli {
    /// Print the techniques with their keys, defaults and ranges.
    #[arg(long)]
    pub(crate) list: bool,
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Write one self-contained page: speed against error of every technique on every scene.
    Report(ReportArgs),
    /// Render one image as EXR.
    Render(RenderArgs),
    /// Bake light that does not move: probes for Bevy and three.js, light maps.
    Bake(BakeArgs),
    /// Compare GPU and CPU pass by pass; fails on a deviation beyond the tolerance.
    Validate(ValidateArgs),
    /// Measure speed against error over the parameter ranges and write JSON.
    Sweep(SweepArgs),
    /// Measure how indirect light changes from frame to frame while lights and objects move.
    Temporal(TemporalArgs),
    /// Run everything that CI runs.
    Test(TestArgs),
    /// Regenerate the fixture scenes, or check that they are up to date.
    Fixtures(FixturesArgs),
    /// Say which adapters and tools there are, what is missing and how to get it.
    Doctor,
    /// Measure the accuracy of the formulas and write docs/accuracy.md.
    Accuracy,
    /// Measure rays and paths beside Embree and Mitsuba, set up as Python packages where that can be.
    BenchPeers(BenchPeersArgs),
    /// Fail on a dependency edge that docs/architecture.md does not draw, or on files that use each other in a circle.
    CheckLayers,
    /// Draw the buffers and passes of every technique into docs/passes.md.
    Diagrams(DiagramsArgs),
    /// Count lines of code per technique: what computes, and what only connects it.
    Loc,
    /// Build the live page for browsers with WebGPU into target/web.
    Web(WebArgs),
}

#[derive(Debug, Args)]
pub(crate) struct ReportArgs {
    /// Scenes; none: a quick report on the fixture `cornell_spot`.
    #[arg(value_name = "SCENE")]
    pub(crate) scenes: Vec<String>,
    /// Smaller pictures, fewer settings and a noisier reference: a minute or two per scene.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Where index.html, report.json and report.csv go.
    #[arg(long, value_name = "DIR", default_value = "report")]
    pub(crate) out: PathBuf,
    /// Leave the GPU out.
    #[arg(long)]
    pub(crate) cpu_only: bool,
}

/// Where the passes of a technique run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum BackendArg {
    Cpu,
    Gpu,
}

/// Reads `PASS=cpu` or `PASS=gpu`.
fn pass_backend(text: &str) -> Result<(String, BackendArg), String> {
    let (pass, backend) = text.split_once('=').ok_or("must be PASS=cpu or PASS=gpu")?;
    Ok((pass.to_owned(), BackendArg::from_str(backend, true)?))
}

/// Which light an image holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Component {
    /// Direct and indirect light and what surfaces emit.
    Full,
    /// Light that was reflected once, and what surfaces emit.
    Direct,
    /// Light that was reflected more than once.
    Indirect,
}

/// Where in a pixel the reference looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PixelFilterArg {
    /// At its centre, as all techniques do.
    Center,
    /// All over it.
    Box,
}

#[derive(Debug, Args)]
pub(crate) struct RenderArgs {
    /// Path to a .gltf or .glb file, or the name of a fixture.
    #[arg(value_name = "SCENE", required_unless_present = "list")]
    pub(crate) scene: Option<String>,
    /// Print the techniques with their keys, defaults and ranges.
    #[arg(long)]
    pub(crate) list: bool,
    /// Technique; `--list` prints them.
    #[arg(long, value_name = "NAME", required_unless_present = "list")]
    pub(crate) technique: Option<String>,
    /// Where the passes run. Default: the GPU where there is one.
    #[arg(long)]
    pub(crate) backend: Option<BackendArg>,
    /// Where one pass runs, to find the one that spoils an image; may be repeated. Every pass then runs on both backends, and
    /// goes on with the results of its own: those that are not named follow `--backend`.
    #[arg(long = "set-backend", value_name = "PASS=cpu|gpu", value_parser = pass_backend)]
    pub(crate) set_backend: Vec<(String, BackendArg)>,
    /// Which light the image holds.
    #[arg(long, default_value = "full")]
    pub(crate) component: Component,
    /// Indirect bounces of the reference: a number, or `inf`; 1 = light, surface, visible surface.
    #[arg(long, value_name = "N|inf")]
    pub(crate) bounces: Option<String>,
    /// Turn visibility off on the first indirect bounce (reference only).
    #[arg(long)]
    pub(crate) unoccluded: bool,
    /// Samples per pixel of the reference.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) spp: Option<u32>,
    /// Seed of the reference and of techniques that draw samples.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u32,
    /// Where in a pixel the reference looks.
    #[arg(long, default_value = "center")]
    pub(crate) pixel_filter: PixelFilterArg,
    /// Width and height in pixels. Default: 256 wide, height from the camera.
    #[arg(long, value_name = "WxH", allow_hyphen_values = true)]
    pub(crate) size: Option<String>,
    /// Camera of the scene, by name or number. Default: the first.
    #[arg(long, value_name = "NAME|N")]
    pub(crate) camera: Option<String>,
    /// A parameter of the technique; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// The image: OpenEXR, linear, float32 channels R G B.
    #[arg(long, value_name = "FILE.exr", required_unless_present = "list")]
    pub(crate) out: Option<PathBuf>,
    /// The image for looking: PNG, tone mapped (Reinhard et al. 2002).
    #[arg(long, value_name = "FILE.png")]
    pub(crate) picture: Option<PathBuf>,
    /// Timings, memory and what was modelled, as JSON.
    #[arg(long, value_name = "FILE.json")]
    pub(crate) stats: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct WebArgs {
    /// Serve it on this machine until interrupted.
    #[arg(long)]
    pub(crate) serve: bool,
    /// Port of the server; 0: any that is free.
    #[arg(long, value_name = "N", default_value_t = 8080)]
    pub(crate) port: u16,
}

/// What baked light is written as.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum BakeFormat {
    /// The 3D texture of Bevy's irradiance volume, KTX2, and where to place it.
    Bevy,
    /// Spherical harmonics up to l = 2 as three.js's light probes, JSON and binary.
    Three,
    /// An image over the second set of texture coordinates, OpenEXR.
    Lightmap,
}

/// Reads `X,Y,Z`.
fn probe_counts(text: &str) -> Result<[u32; 3], String> {
    let counts: Vec<u32> =
        text.split(',').map_while(|n| n.trim().parse().ok().filter(|n| (1..=4096).contains(n))).collect();
    counts.try_into().map_err(|_| "must be X,Y,Z, each from 1 to 4096".to_owned())
}

#[derive(Debug, Args)]
pub(crate) struct BakeArgs {
    /// Path to a .gltf or .glb file, or the name of a fixture.
    #[arg(value_name = "SCENE")]
    pub(crate) scene: String,
    /// What to write; may be repeated.
    #[arg(long, value_name = "FORMAT", default_values = ["bevy", "three"], value_delimiter = ',')]
    pub(crate) format: Vec<BakeFormat>,
    /// What computes the light.
    #[arg(long, value_name = "NAME", default_value = "reference")]
    pub(crate) technique: String,
    /// Which light: what lights and emitters send, what arrives after being reflected, or both.
    #[arg(long, default_value = "indirect")]
    pub(crate) component: Component,
    /// Reflections that are followed: a number, or `inf`.
    #[arg(long, value_name = "N|inf")]
    pub(crate) bounces: Option<String>,
    /// Probes along each axis of the scene's bounds. Default: 12 along the longest.
    #[arg(long, value_name = "X,Y,Z", value_parser = probe_counts)]
    pub(crate) probes: Option<[u32; 3]>,
    /// Metres from probe to probe, instead.
    #[arg(long, value_name = "METRES", allow_hyphen_values = true)]
    pub(crate) spacing: Option<f32>,
    /// Texels along each side of a light map.
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=8192))]
    pub(crate) size: u32,
    /// Samples per irradiance: 51 of them make a probe, one a texel of a light map.
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub(crate) spp: u32,
    /// Seed of the samples.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u32,
    /// Points at which what was baked is held against the path tracer; 0 leaves it out.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(0..=100_000))]
    pub(crate) check: u32,
    /// Folder for the files.
    #[arg(long, value_name = "DIR", default_value = "bake")]
    pub(crate) out: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct ValidateArgs {
    /// Scenes; none: every stored fixture.
    #[arg(value_name = "SCENE")]
    pub(crate) scenes: Vec<String>,
    /// Only these techniques; may be repeated.
    #[arg(long = "technique", value_name = "NAME")]
    pub(crate) techniques: Vec<String>,
    /// The deviations of every pass, as JSON.
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
    /// Adds 1 % to one element of the GPU's result of this pass, to show that the check can fail.
    #[arg(long, value_name = "PASS", hide = true)]
    pub(crate) perturb: Option<String>,
}

#[derive(Debug, Args)]
pub(crate) struct SweepArgs {
    /// Path to a .gltf or .glb file, or the name of a fixture.
    #[arg(value_name = "SCENE")]
    pub(crate) scene: String,
    /// Only these techniques; may be repeated.
    #[arg(long = "technique", value_name = "NAME")]
    pub(crate) techniques: Vec<String>,
    /// The measurements.
    #[arg(long, value_name = "FILE")]
    pub(crate) json: PathBuf,
    /// Smaller pictures and fewer settings.
    #[arg(long)]
    pub(crate) quick: bool,
}

/// What moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Moving {
    /// All punctual lights, by 4 % of the scene's diagonal; distant ones tilt by 6°.
    Light,
    /// The largest part of the mesh that hangs together and is smaller than half of the scene.
    Object,
}

impl Moving {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Light => "light",
            Self::Object => "object",
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct TemporalArgs {
    /// Path to a .gltf or .glb file, or the name of a fixture.
    #[arg(value_name = "SCENE")]
    pub(crate) scene: String,
    /// A technique with its settings; may be repeated. None: every technique as it is.
    #[arg(long = "run", value_name = "NAME KEY=VALUE …")]
    pub(crate) runs: Vec<String>,
    /// Frames of one turn.
    #[arg(long, value_name = "N", default_value_t = 40, value_parser = clap::value_parser!(u32).range(2..))]
    pub(crate) frames: u32,
    /// What moves, on a level circle; may be repeated.
    #[arg(long = "move", value_name = "WHAT", default_value = "light", value_delimiter = ',')]
    pub(crate) moving: Vec<Moving>,
    /// Width of the pictures; their height follows from the camera.
    #[arg(long, value_name = "PIXELS", default_value_t = 96, value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(crate) width: u32,
    /// Camera of the scene, by name or number. Default: the first.
    #[arg(long, value_name = "NAME|N")]
    pub(crate) camera: Option<String>,
    /// Leave the GPU out.
    #[arg(long)]
    pub(crate) cpu_only: bool,
    /// The measurements.
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct TestArgs {
    /// Only the steps whose name contains this; may be repeated.
    #[arg(long, value_name = "NAME")]
    pub(crate) only: Vec<String>,
    /// Print the steps and stop.
    #[arg(long)]
    pub(crate) list: bool,
}

#[derive(Debug, Args)]
pub(crate) struct BenchPeersArgs {
    /// Fixtures whose paths are compared; none: an area light, a spot on one wall and a large mesh under the sun. Rays are
    /// compared where no fixture is named.
    #[arg(value_name = "FIXTURE", value_parser = indirect_scene::fixtures::NAMES)]
    pub(crate) scenes: Vec<String>,
}

#[derive(Debug, Args)]
pub(crate) struct DiagramsArgs {
    /// Compare with the stored page instead of writing it; fails where they differ.
    #[arg(long)]
    pub(crate) check: bool,
}

#[derive(Debug, Args)]
pub(crate) struct FixturesArgs {
    /// Compare with the stored files instead of writing them; fails where they differ.
    #[arg(long)]
    pub(crate) check: bool,
    /// Print the names of the fixtures and stop.
    #[arg(long)]
    pub(crate) list: bool,
}
