//! Measures one scene: the truth, every technique through its sweep, the path tracer at the same times, the split of the
//! error and the twins.

use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::Instant;

use glam::Vec3;
use indirect_core::{Image, Scene, math::luminance};
use indirect_gpu::wgpu::Limits;
use indirect_metrics::{Reference as MetricsReference, compare, difference, exposure};
use reference_pathtracer::{Bounces, Components, Estimate, PixelFilter};

use super::data::{Matched, Part, Run, SceneReport, Split, TechniqueReport, Truth, TruthImages};
use crate::failure::{Failure, Outcome};
use crate::progress;
use crate::stage::{Source, Stage};
use crate::technique::{
    self, Backend, Bytes, Pass, REFERENCE, Reference, ReferenceOptions, Technique, Transport,
};
use crate::validate;

/// How much work a scene is worth.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Effort {
    pub(crate) quick: bool,
}

impl Effort {
    /// Image width.
    pub(crate) const fn width(self) -> u32 {
        if self.quick { 192 } else { 320 }
    }

    /// Most samples per pixel of a reference.
    const fn most_spp(self) -> u32 {
        if self.quick { 1024 } else { 8192 }
    }

    /// A reference may stop at this noise: a tenth of the error of a good technique.
    const fn noise_target(self) -> f64 {
        if self.quick { 0.01 } else { 0.003 }
    }

    /// Time for one reference.
    const fn reference_seconds(self) -> f64 {
        if self.quick { 12.0 } else { 120.0 }
    }

    /// A curve of the path tracer ends with the first run that takes longer.
    const fn baseline_ms(self) -> f64 {
        if self.quick { 3e3 } else { 2e4 }
    }

    const fn baseline_spp(self) -> &'static [u32] {
        if self.quick { &[1, 2, 4, 8, 16, 32, 64] } else { &[1, 2, 4, 8, 16, 32, 64, 128, 256] }
    }

    /// Time for the frames of one setting.
    const fn seconds(self) -> f64 {
        if self.quick { 0.4 } else { 1.5 }
    }
}

/// Seed of the truth; the runs that are measured against it use others.
const TRUTH_SEED: u32 = 0x5eed;

/// Measures one scene.
pub(crate) fn scene(
    source: &Source,
    techniques: &[Box<dyn Technique>],
    effort: Effort,
    with_gpu: bool,
) -> Outcome<SceneReport> {
    let start = Instant::now();
    let camera = source.camera(None)?;
    let size = Source::size(camera, effort.width());
    let mut warnings = source.warnings.clone();
    let mut stage = Stage::new(source, camera, size, None);
    if with_gpu {
        let mut limits = Limits::default();
        for technique in techniques {
            for pairs in technique.sweep(effort.quick).iter().flatten() {
                let needed = technique.required_limits(&stage, &technique.parse(pairs)?)?;
                limits = crate::gpu::larger(&limits, &needed);
            }
        }
        // A scene that does not fit the adapter is still measured on the CPU.
        let gpu = crate::gpu::open(&source.scene, &limits);
        stage.gpu = gpu.map_err(|f| warnings.push(format!("the GPU is left out: {}", f.line()))).ok();
    }
    let truth = truth(&stage, effort)?;
    let mut models = Models { source, stage: &stage, truth: &truth, effort, made: BTreeMap::new() };
    let mut runs = baseline(&stage, &truth, effort)?;
    let mut reports = Vec::new();
    for technique in techniques {
        let first = runs.len();
        runs.extend(sweep(&mut models, technique.as_ref())?);
        let twins =
            stage.gpu.is_some().then(|| validate::stage(&stage, technique.as_ref(), None)).transpose()?;
        reports.push(TechniqueReport {
            technique: technique.name().to_owned(),
            notes: technique.notes(&stage.profile),
            split: split(&mut models, technique.as_ref(), &runs[first..])?,
            twins,
        });
    }
    let profile = stage.profile;
    Ok(SceneReport {
        name: source.title().to_owned(),
        file: source.file.clone(),
        camera: camera.name.clone(),
        size,
        triangles: profile.triangles,
        directional_lights: profile.directional_lights,
        point_lights: profile.point_lights,
        spot_lights: profile.spot_lights,
        emissive_triangles: profile.emissive_triangles,
        load_ms: source.load_ms,
        accel_ms: stage.accel_ms,
        accel_bytes: stage.accel.bytes() as u64,
        peak_bytes: peak_bytes(),
        seconds: start.elapsed().as_secs_f64(),
        warnings,
        front: front(&runs),
        truth,
        runs,
        techniques: reports,
    })
}

/// A reference with as many samples as fit into the time for one, measured by a trial; a power of two, so that another run on
/// the same machine asks for the same and finds it stored.
fn affordable(stage: &Stage<'_>, options: ReferenceOptions, effort: Effort, what: &str) -> Outcome<Estimate> {
    // Eight batches of four: the light paths that a batch shares are made once for each, as in the real run.
    const TRIAL: u32 = 32;
    const LEAST: u32 = 32;
    let trial =
        Reference::render(stage, &ReferenceOptions { spp: TRIAL, noise_target: None, ..options }, what)?;
    let affordable = effort.reference_seconds() * 1e3 / (trial.ms / f64::from(TRIAL)).max(1e-6);
    let spp = (affordable as u32).clamp(LEAST, effort.most_spp());
    Reference::cached(stage, &ReferenceOptions { spp: 1 << spp.ilog2(), ..options }, what)
}

fn truth(stage: &Stage<'_>, effort: Effort) -> Outcome<Truth> {
    let options = ReferenceOptions {
        components: Components::Both,
        bounces: Bounces::Infinite,
        unoccluded: false,
        spp: 0,
        noise_target: Some(effort.noise_target()),
        seed: TRUTH_SEED,
        pixel_filter: PixelFilter::Center,
    };
    let estimate = affordable(stage, options, effort, "path-traced truth")?;
    let noise = estimate.noise()[1];
    let full = estimate.full();
    let brightness = |i: &Image| f64::from(luminance(i.mean()));
    let share = brightness(&estimate.indirect) / brightness(&full);
    Ok(Truth {
        spp: estimate.spp,
        noise,
        mean_indirect: estimate.indirect.mean().to_array(),
        indirect_share: if share.is_finite() { share } else { 0.0 },
        exposure: exposure(&estimate.indirect, &estimate.surface),
        images: TruthImages {
            full,
            standard_error: deviation(&estimate.indirect_variance),
            relative_mean_error: relative_mean_error(&estimate),
            variance: estimate.indirect_variance,
            indirect: estimate.indirect,
            surface: estimate.surface,
        },
    })
}

impl Truth {
    pub(crate) fn reference(&self) -> MetricsReference<'_> {
        MetricsReference {
            image: &self.images.indirect,
            surface: &self.images.surface,
            standard_error: Some(&self.images.standard_error),
            relative_mean_error: self.images.relative_mean_error,
        }
    }

    /// Mean over the surface of a variance in the luminance, relative to the squared mean of the truth. The channels' errors
    /// are taken to rise and fall together, as those of grey noise do.
    fn mean_square_noise(&self, variance: &Image) -> f64 {
        let seen = |i: &Image| -> Vec<f64> {
            let pixels = i.pixels.iter().zip(&self.images.surface).filter(|(_, s)| **s);
            pixels.map(|(p, _)| f64::from(luminance(*p))).collect()
        };
        let (noise, truth) = (seen(&deviation(variance)), seen(&self.images.indirect));
        let n = truth.len().max(1) as f64;
        let mean = truth.iter().sum::<f64>() / n;
        if mean > 0.0 { noise.iter().map(|d| d * d).sum::<f64>() / n / (mean * mean) } else { 0.0 }
    }

    /// Fills in the errors of a run.
    fn judge(&self, mut run: Run, file: &str) -> Outcome<Run> {
        use indirect_metrics::MetricsError;
        match compare(&run.indirect, &self.reference()) {
            Ok(error) => {
                run.below_floor = Some(error.luminance.below_floor(&error.noise_floor));
                run.error = Some(error);
                Ok(run)
            }
            Err(MetricsError::BlackReference | MetricsError::NoSurface) => Ok(run),
            Err(e) => Err(Failure::Check(format!("{file}: {}: {e}", run.technique))),
        }
    }
}

/// The path tracer at rising sample counts.
fn baseline(stage: &Stage<'_>, truth: &Truth, effort: Effort) -> Outcome<Vec<Run>> {
    let render = |spp: u32| {
        let options = ReferenceOptions {
            components: Components::Indirect,
            bounces: Bounces::Infinite,
            unoccluded: false,
            spp,
            noise_target: None,
            seed: TRUTH_SEED + spp,
            pixel_filter: PixelFilter::Center,
        };
        Ok((options, Reference::render(stage, &options, "path tracer")?))
    };
    // The first run warms up caches and threads.
    render(1)?;
    let run = |spp: u32| {
        let (options, made) = render(spp)?;
        let run = Run {
            technique: REFERENCE.into(),
            backend: Backend::Cpu,
            curve: 0,
            config: options.config(),
            label: format!("spp={spp}"),
            prepare_ms: stage.accel_ms,
            frame_ms: made.ms,
            frames: 1,
            passes: vec![Pass { name: "paths".into(), ms: made.ms }],
            bytes: Bytes { cpu: stage.accel.bytes() as u64, gpu: 0 },
            error: None,
            below_floor: None,
            matched: None,
            indirect: made.estimate.indirect,
        };
        truth.judge(run, &stage.file)
    };
    let mut runs = Vec::new();
    for spp in effort.baseline_spp() {
        runs.push(run(*spp)?);
        if runs.last().is_some_and(|r| r.frame_ms > effort.baseline_ms()) {
            break;
        }
    }
    Ok(runs)
}

/// A technique through its sweep, on every backend there is.
fn sweep(models: &mut Models<'_>, technique: &dyn Technique) -> Outcome<Vec<Run>> {
    let Models { stage, truth, effort, .. } = *models;
    let backends: Vec<_> =
        Backend::ALL.into_iter().filter(|b| *b == Backend::Cpu || stage.gpu.is_some()).collect();
    let curves = technique.sweep(effort.quick);
    let steps = curves.iter().map(Vec::len).sum::<usize>() * backends.len();
    let bar = progress::bar(steps as u64, format!("{} sweep", technique.name()));
    let mut runs = Vec::new();
    for &backend in &backends {
        for (curve, settings) in curves.iter().enumerate() {
            for pairs in settings {
                let values = technique.parse(pairs)?;
                let start = Instant::now();
                let mut renderer = technique.prepare(stage, &values, 0, backend)?;
                let prepare_ms = start.elapsed().as_secs_f64() * 1e3;
                let measured = technique::measure(renderer.as_mut(), stage, 1, effort.seconds())?;
                let run = Run {
                    technique: technique.name().to_owned(),
                    backend,
                    curve,
                    config: technique.config(&values, &stage.profile, 0),
                    label: pairs.join(" "),
                    prepare_ms,
                    frame_ms: measured.frame_ms,
                    frames: measured.frames,
                    passes: measured.passes,
                    bytes: renderer.bytes(),
                    error: None,
                    below_floor: None,
                    matched: None,
                    indirect: measured.indirect,
                };
                let mut run = truth.judge(run, &stage.file)?;
                run.matched = models.judge(&run, technique.transport(&values))?;
                runs.push(run);
                bar.inc(1);
            }
        }
    }
    bar.finish_and_clear();
    Ok(runs)
}

/// What a reference models, and whether emissive surfaces light it.
type Model = (Transport, bool);

/// References with less than the truth, each made when it is first asked for.
struct Models<'a> {
    source: &'a Source,
    stage: &'a Stage<'a>,
    truth: &'a Truth,
    effort: Effort,
    made: BTreeMap<Model, Rc<Estimate>>,
}

impl Models<'_> {
    fn estimate(&mut self, model: Model) -> Outcome<Rc<Estimate>> {
        if let Some(estimate) = self.made.get(&model) {
            return Ok(Rc::clone(estimate));
        }
        let (transport, emitters) = model;
        let options = ReferenceOptions {
            components: Components::Indirect,
            bounces: Bounces::Count(transport.bounces),
            unoccluded: !transport.occluded,
            spp: 0,
            noise_target: Some(self.effort.noise_target()),
            seed: TRUTH_SEED + 1,
            pixel_filter: PixelFilter::Center,
        };
        let what = format!("reference of {transport}");
        let estimate = if emitters {
            affordable(self.stage, options, self.effort, &what)?
        } else {
            let without = Source {
                file: self.source.file.clone(),
                scene: without_emission(&self.source.scene),
                warnings: Vec::new(),
                load_ms: 0.0,
            };
            let stage = Stage::new(&without, self.source.camera(None)?, self.stage.size, None);
            affordable(&stage, options, self.effort, &what)?
        };
        let estimate = Rc::new(estimate);
        self.made.insert(model, Rc::clone(&estimate));
        Ok(estimate)
    }

    /// The models between the truth and what a technique with this transport must approach, which is the last: each with its
    /// name and what it leaves out that the one before has.
    fn chain(&self, transport: Transport) -> Vec<(&'static str, String, Model)> {
        let Transport { bounces, occluded } = transport;
        let seen = Transport { occluded: true, ..transport };
        let mut chain =
            vec![("later bounces", format!("the model stops after bounce {bounces}"), (seen, true))];
        if !occluded {
            let why = "the model lets light of the first bounce pass through what stands between";
            chain.push(("visibility", why.to_owned(), (transport, true)));
        }
        if self.stage.profile.emissive_triangles > 0 {
            let why = "the model has no light from emissive surfaces";
            chain.push(("emitters", why.to_owned(), (transport, false)));
        }
        chain
    }

    /// The error of a run against the last of its chain; `None` where that is black.
    fn judge(&mut self, run: &Run, transport: Transport) -> Outcome<Option<Matched>> {
        use indirect_metrics::MetricsError;
        let Some((.., model)) = self.chain(transport).pop() else { return Ok(None) };
        if !model.1 && self.stage.profile.punctual_lights() == 0 {
            return Ok(None);
        }
        let matched = self.estimate(model)?;
        let reference = MetricsReference {
            image: &matched.indirect,
            surface: &matched.surface,
            standard_error: Some(&deviation(&matched.indirect_variance)),
            relative_mean_error: relative_mean_error(&matched),
        };
        match compare(&run.indirect, &reference) {
            Ok(error) => Ok(Some(Matched { transport, error })),
            Err(MetricsError::BlackReference | MetricsError::NoSurface) => Ok(None),
            Err(e) => Err(Failure::Check(format!("{}: {}: {e}", self.stage.file, run.technique))),
        }
    }
}

/// Takes the error of the best run apart: what the transport model leaves out, what the sampling adds, what the GPU's
/// arithmetic adds. `None` where the reference is black.
fn split(models: &mut Models<'_>, technique: &dyn Technique, runs: &[Run]) -> Outcome<Option<Split>> {
    let (stage, truth) = (models.stage, models.truth);
    let best = |backend| {
        let of = runs.iter().filter(|r| r.backend == backend && r.error.is_some());
        of.min_by(|a, b| a.rel_rmse().total_cmp(&b.rel_rmse()))
    };
    let Some(cpu) = best(Backend::Cpu) else { return Ok(None) };
    let pairs: Vec<_> = cpu.label.split_whitespace().map(str::to_owned).collect();
    let values = technique.parse(&pairs)?;
    let black = Image::new(stage.size);
    let mut made = Vec::new();
    for (name, why, model) in models.chain(technique.transport(&values)) {
        let dark = !model.1 && stage.profile.punctual_lights() == 0;
        made.push((name, why, if dark { None } else { Some(models.estimate(model)?) }));
    }
    // Each image with its name, what it leaves out that the one before has, and the variance of its pixels.
    let mut chain = vec![("truth", String::new(), &truth.images.indirect, Some(&truth.images.variance))];
    for (name, why, estimate) in &made {
        let (image, variance) =
            estimate.as_ref().map_or((&black, &black), |e| (&e.indirect, &e.indirect_variance));
        chain.push((name, why.clone(), image, Some(variance)));
    }
    chain.push((
        "discretisation",
        "maps, lattices and samples are finite; on the CPU".to_owned(),
        &cpu.indirect,
        None,
    ));
    let twin = runs.iter().find(|r| r.backend == Backend::Gpu && r.label == cpu.label);
    if let Some(gpu) = twin {
        chain.push((
            "precision",
            "the GPU against the CPU: rounding, and silhouette texels that fall to the other side".to_owned(),
            &gpu.indirect,
            None,
        ));
    }
    let part = |from: &Link<'_>, to: &Link<'_>| -> Outcome<Part> {
        let measures = difference(to.2, from.2, &truth.reference())
            .map_err(|e| Failure::Check(format!("{}: {e}", stage.file)))?;
        let noise =
            [from.3, to.3].into_iter().flatten().map(|v| truth.mean_square_noise(v)).sum::<f64>().sqrt();
        Ok(Part { name: to.0, explanation: to.1.clone(), measures, noise })
    };
    let parts = chain.windows(2).map(|pair| part(&pair[0], &pair[1])).collect::<Outcome<_>>()?;
    let whole = part(&chain[0], &chain[chain.len() - 1])?;
    Ok(Some(Split { label: cpu.label.clone(), parts, whole }))
}

/// Standard deviation from variance.
/// The standard error of the mean indirect light as a share of it: pixels share random numbers, so it does not follow from
/// theirs.
fn relative_mean_error(estimate: &Estimate) -> Option<f64> {
    let m = estimate.mean()[1];
    (m.value > 0.0 && m.error.is_finite()).then(|| m.error / m.value)
}

fn deviation(variance: &Image) -> Image {
    Image { size: variance.size, pixels: variance.pixels.iter().map(|v| v.map(f32::sqrt)).collect() }
}

/// Name, explanation, image and variance of an image in the chain from the truth to a technique.
type Link<'a> = (&'static str, String, &'a Image, Option<&'a Image>);

/// The scene with its emissive surfaces switched off.
fn without_emission(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    for m in &mut scene.materials {
        m.emission = Vec3::ZERO;
    }
    scene
}

/// The runs that no other run beats in both time and error, fastest first.
fn front(runs: &[Run]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..runs.len()).filter(|i| runs[*i].rel_rmse().is_finite()).collect();
    order.sort_by(|a, b| runs[*a].frame_ms.total_cmp(&runs[*b].frame_ms));
    let mut least = f64::INFINITY;
    order.retain(|i| {
        let better = runs[*i].rel_rmse() < least;
        least = least.min(runs[*i].rel_rmse());
        better
    });
    order
}

/// Largest resident memory of this process so far, where `/proc` tells.
fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kb| kb * 1024)
}
