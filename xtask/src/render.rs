//! `render`: one image as EXR, and what it took as JSON.

use indirect_core::Image;
use indirect_scene::{exr, png};
use reference_pathtracer::{Bounces, Components, PixelFilter};
use serde::Serialize;
use serde_json::{Map, Value};

use crate::cli::{BackendArg, Component, PixelFilterArg, RenderArgs};
use crate::failure::{self, Failure, Outcome};
use crate::stage::{Source, Stage, parse_size};
use crate::technique::{
    self, Backend, Bytes, Notes, Pass, REFERENCE, Reference, ReferenceOptions, Values, direct_light,
};
use crate::{gpu, say, warn};

/// Samples per pixel of the reference where none are asked for.
const DEFAULT_SPP: u32 = 64;
/// What the log-average luminance of a picture becomes.
const MIDDLE_GREY: f32 = 0.18;
/// Width where no size is asked for.
const DEFAULT_WIDTH: u32 = 256;

/// The file of `--stats`; other tools read it.
#[derive(Debug, Serialize)]
struct Stats {
    technique: String,
    backend: &'static str,
    adapter: Option<String>,
    scene: SceneStats,
    size: [u32; 2],
    config: Map<String, Value>,
    prepare_ms: f64,
    frame_ms: f64,
    frames: usize,
    passes: Vec<Pass>,
    bytes: Bytes,
    mean_radiance: [f32; 3],
    non_finite: usize,
    modelled: Vec<String>,
    skipped: Vec<String>,
    warnings: Vec<String>,
}

#[derive(Debug, Serialize)]
struct SceneStats {
    file: String,
    triangles: usize,
    lights: usize,
}

/// What a render gives, whoever made it.
struct Rendered {
    image: Image,
    backend: Backend,
    adapter: Option<String>,
    config: Map<String, Value>,
    prepare_ms: f64,
    frame_ms: f64,
    frames: usize,
    passes: Vec<Pass>,
    bytes: Bytes,
    notes: Notes,
}

pub(crate) fn run(args: &RenderArgs) -> Outcome {
    if args.list {
        say(technique::list());
        return Ok(());
    }
    let (Some(scene), Some(name), Some(out)) = (&args.scene, &args.technique, &args.out) else {
        // clap requires all three without --list.
        return Err(Failure::Input("render needs SCENE, --technique and --out".into()));
    };
    // Everything that can be refused is refused before the work begins.
    let chosen = (name != REFERENCE).then(|| technique::find(name)).transpose()?;
    let size = args.size.as_deref().map(parse_size).transpose()?;
    let options = reference_options(args)?;
    let values = match &chosen {
        Some(t) => t.parse(&with_bounces(args, t.as_ref()))?,
        None => Values::none(REFERENCE, &args.set)?,
    };
    if out.extension().is_none_or(|e| !e.eq_ignore_ascii_case("exr")) {
        return Err(Failure::file(out, "--out must end in .exr"));
    }
    if chosen.is_none() && (args.backend == Some(BackendArg::Gpu) || !args.set_backend.is_empty()) {
        return Err(Failure::Input("--backend gpu, --set-backend: the reference runs on the CPU".into()));
    }
    failure::writable(out)?;
    args.stats.as_deref().map(failure::writable).transpose()?;
    let source = Source::load(scene)?;
    source.warnings.iter().for_each(|w| warn(format!("{}: {w}", source.file)));
    let camera = source.camera(args.camera.as_deref())?;
    let size = size.unwrap_or_else(|| Source::size(camera, DEFAULT_WIDTH));
    let mut on_cpu = None;
    let mut rendered = match &chosen {
        None => {
            let stage = Stage::new(&source, camera, size, None);
            render_reference(&stage, &options, args.component)?
        }
        Some(technique) => {
            let backend = args.backend.map(backend);
            let mut stage = Stage::new(&source, camera, size, None);
            if backend != Some(Backend::Cpu) || !args.set_backend.is_empty() {
                let limits = technique.required_limits(&stage, &values)?;
                match gpu::open(&source.scene, &limits) {
                    Ok(gpu) => stage.gpu = Some(gpu),
                    Err(f) if backend.is_some() || !args.set_backend.is_empty() => return Err(f),
                    Err(f) => on_cpu = Some(format!("{}; the CPU renders", f.line())),
                }
            }
            render_technique(technique.as_ref(), &values, &stage, args, &options)?
        }
    };
    rendered.notes.warnings.extend(on_cpu);
    let non_finite = rendered.image.non_finite();
    if non_finite > 0 {
        // Counted in the stats and never written.
        rendered.notes.warnings.push(format!("{non_finite} values were not finite and are written as 0"));
        for p in &mut rendered.image.pixels {
            *p = glam::Vec3::from(p.to_array().map(|v| if v.is_finite() { v } else { 0.0 }));
        }
    }
    rendered.notes.warnings.iter().for_each(warn);
    exr::write_rgb(out, &rendered.image).map_err(|e| Failure::Input(e.to_string()))?;
    if let Some(path) = &args.picture {
        let picture = png::reinhard(&rendered.image, MIDDLE_GREY);
        png::write_srgb(path, &picture, 1.0).map_err(|e| Failure::Input(e.to_string()))?;
    }
    let Some(path) = &args.stats else { return Ok(()) };
    let mut warnings = source.warnings.clone();
    warnings.extend(rendered.notes.warnings);
    let stats = Stats {
        technique: name.clone(),
        backend: rendered.backend.name(),
        adapter: rendered.adapter,
        scene: SceneStats {
            file: source.file.clone(),
            triangles: source.scene.mesh.triangles.len(),
            lights: source.scene.lights.len(),
        },
        size,
        config: rendered.config,
        prepare_ms: rendered.prepare_ms,
        frame_ms: rendered.frame_ms,
        frames: rendered.frames,
        passes: rendered.passes,
        bytes: rendered.bytes,
        mean_radiance: rendered.image.mean().to_array(),
        non_finite,
        modelled: rendered.notes.modelled,
        skipped: rendered.notes.skipped,
        warnings,
    };
    failure::write_json(path, &stats)
}

const fn backend(arg: BackendArg) -> Backend {
    match arg {
        BackendArg::Cpu => Backend::Cpu,
        BackendArg::Gpu => Backend::Gpu,
    }
}

fn reference_options(args: &RenderArgs) -> Outcome<ReferenceOptions> {
    let bounces = match args.bounces.as_deref() {
        None | Some("inf") => Bounces::Infinite,
        Some(n) => Bounces::Count(
            n.parse()
                .map_err(|_| Failure::Input(format!("--bounces {n}: must be a whole number or `inf`")))?,
        ),
    };
    Ok(ReferenceOptions {
        components: match args.component {
            Component::Full => Components::Both,
            Component::Direct => Components::Direct,
            Component::Indirect => Components::Indirect,
        },
        bounces,
        unoccluded: args.unoccluded,
        spp: args.spp.unwrap_or(DEFAULT_SPP),
        noise_target: None,
        seed: args.seed,
        pixel_filter: match args.pixel_filter {
            PixelFilterArg::Center => PixelFilter::Center,
            PixelFilterArg::Box => PixelFilter::Box,
        },
    })
}

fn render_reference(
    stage: &Stage<'_>,
    options: &ReferenceOptions,
    component: Component,
) -> Outcome<Rendered> {
    let made = Reference::render(stage, options, REFERENCE)?;
    let pixels = made.estimate.surface.len() as u64;
    Ok(Rendered {
        image: match component {
            Component::Full => made.estimate.full(),
            Component::Direct => made.estimate.direct,
            Component::Indirect => made.estimate.indirect,
        },
        backend: Backend::Cpu,
        adapter: None,
        config: options.config(),
        prepare_ms: stage.accel_ms,
        frame_ms: made.ms,
        frames: 1,
        passes: vec![Pass { name: "paths".into(), ms: made.ms }],
        // Moments of two components of a pixel, and four images.
        bytes: Bytes { cpu: stage.accel.bytes() as u64 + pixels * (2 * 7 * 8 + 4 * 12 + 1), gpu: 0 },
        notes: technique::reference_notes(&stage.profile),
    })
}

fn render_technique(
    technique: &dyn technique::Technique,
    values: &Values,
    stage: &Stage<'_>,
    args: &RenderArgs,
    options: &ReferenceOptions,
) -> Outcome<Rendered> {
    let asked = args.backend.map(backend);
    let backend = asked.unwrap_or(if stage.gpu.is_some() { Backend::Gpu } else { Backend::Cpu });
    let mut notes = technique.notes(&stage.profile);
    notes.warnings.extend(ignored(args, technique, values));
    let start = std::time::Instant::now();
    let mut renderer = if args.set_backend.is_empty() {
        technique.prepare(stage, values, args.seed, backend)?
    } else {
        let choices: Vec<_> = args.set_backend.iter().map(|(p, b)| (p.clone(), self::backend(*b))).collect();
        notes.warnings.push("every pass runs on both backends: the times are not those of a frame".into());
        technique.prepare_mixed(stage, values, args.seed, backend, &choices)?
    };
    let prepare_ms = start.elapsed().as_secs_f64() * 1e3 + stage.accel_ms;
    let measured = technique::measure(renderer.as_mut(), stage, (3, technique.settles(values)), 1.0)?;
    let direct = || direct_light(stage, options.spp, options.seed);
    let image = match args.component {
        Component::Indirect => measured.indirect,
        Component::Direct => direct()?,
        Component::Full => direct()?.sum(&measured.indirect),
    };
    Ok(Rendered {
        image,
        backend,
        adapter: stage.gpu.as_ref().map(|g| g.device.context.describe()),
        config: technique.config(values, &stage.profile, args.seed),
        prepare_ms,
        frame_ms: measured.frame_ms,
        frames: measured.frames,
        passes: measured.passes,
        bytes: renderer.bytes(),
        notes,
    })
}

/// The pairs of `--set`, after `--bounces` for a technique that has such a key: the more special one wins.
fn with_bounces(args: &RenderArgs, technique: &dyn technique::Technique) -> Vec<String> {
    let bounces = args.bounces.as_deref().filter(|b| technique.has_key("bounces") && *b != "inf");
    bounces.map(|b| format!("bounces={b}")).into_iter().chain(args.set.iter().cloned()).collect()
}

/// Options that a technique cannot follow.
fn ignored(args: &RenderArgs, technique: &dyn technique::Technique, values: &Values) -> Vec<String> {
    let name = technique.name();
    let models = technique.transport(values).bounces;
    let mut said = Vec::new();
    let all = models == technique::Transport::ALL;
    if let Some(asked) =
        args.bounces.as_deref().filter(|b| if all { *b != "inf" } else { b.parse() != Ok(models) })
    {
        let models = match models {
            1 => "1 bounce".to_owned(),
            _ if all => "all bounces".to_owned(),
            n => format!("{n} bounces"),
        };
        said.push(format!("--bounces {asked}: {name} models {models}"));
    }
    let reference =
        [("--unoccluded", args.unoccluded), ("--pixel-filter box", args.pixel_filter == PixelFilterArg::Box)];
    let given = reference.into_iter().filter(|(_, given)| *given);
    said.extend(
        given.map(|(option, _)| format!("{option} is an option of the reference: {name} ignores it")),
    );
    said
}
