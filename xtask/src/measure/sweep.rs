//! The path tracer and techniques through their settings.

use std::time::Instant;

use reference_pathtracer::{Bounces, Components, PixelFilter};

use super::data::{Run, Truth};
use super::effort::{Effort, TRUTH_SEED};
use super::models::Models;
use crate::failure::Outcome;
use crate::progress;
use crate::stage::Stage;
use crate::technique::{self, Backend, Bytes, Pass, REFERENCE, Reference, ReferenceOptions, Technique};

/// The path tracer at rising sample counts.
pub(super) fn baseline(stage: &Stage<'_>, truth: &Truth, effort: Effort) -> Outcome<Vec<Run>> {
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
pub(super) fn sweep(models: &mut Models<'_>, technique: &dyn Technique) -> Outcome<Vec<Run>> {
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
                let measured = technique::measure(
                    renderer.as_mut(),
                    stage,
                    (1, technique.settles(&values)),
                    effort.seconds(),
                )?;
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
