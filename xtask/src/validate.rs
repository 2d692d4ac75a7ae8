//! `validate`: every pass on the GPU against its twin on the CPU.

use indirect_gpu::wgpu::Limits;
use serde::Serialize;
use testkit::{Deviation, deviation, perturb as perturbed};

use crate::cli::ValidateArgs;
use crate::failure::{self, Failure, Outcome};
use crate::stage::{Source, Stage};
use crate::technique::{self, Technique};
use crate::{fixtures as stored, gpu, progress, say, setup, warn};

/// Width of the images that are compared: odd on purpose, so that no size is a multiple of a workgroup.
const WIDTH: u32 = 161;

/// The comparison of one scene.
#[derive(Debug, Serialize)]
struct SceneResult {
    scene: String,
    technique: &'static str,
    adapter: String,
    passes: Vec<Deviation>,
}

pub(crate) fn run(args: &ValidateArgs) -> Outcome {
    let techniques = technique::find_all(&args.techniques)?;
    let scenes = if args.scenes.is_empty() { stored::stored() } else { args.scenes.clone() };
    args.json.as_deref().map(failure::will_write).transpose()?;
    let results = measure(&scenes, &techniques, args.perturb.as_deref())?;
    if let Some(path) = &args.json {
        failure::write_json(path, &results)?;
    }
    judge(&results)
}

/// All stored fixtures with all techniques.
pub(crate) fn fixtures() -> Outcome {
    judge(&measure(&stored::stored(), &technique::real_time(), None)?)
}

fn measure(
    scenes: &[String],
    techniques: &[Box<dyn Technique>],
    perturb: Option<&str>,
) -> Outcome<Vec<SceneResult>> {
    let mut results = Vec::new();
    for scene in scenes {
        let source = Source::load(scene)?;
        source.warnings.iter().for_each(|w| warn(format!("{scene}: {w}")));
        let camera = source.camera(None)?;
        let gpu = gpu::open(&source.scene, &Limits::default())?;
        let adapter = gpu.device.context.describe();
        let stage_ = Stage::new(&source, camera, Source::size(camera, WIDTH), Some(gpu));
        for technique in techniques {
            let bar = progress::spinner(format!("{scene}: {}", technique.name()));
            let passes = stage(&stage_, technique.as_ref(), perturb)?;
            bar.finish_and_clear();
            say(format!("{scene}: {} on {adapter}", technique.name()));
            Deviation::per_pass(&passes).iter().for_each(|d| say(line(d)));
            let technique = technique.name();
            results.push(SceneResult { scene: scene.clone(), technique, adapter: adapter.clone(), passes });
        }
    }
    if let Some(pass) = perturb
        && !results.iter().flat_map(|r| &r.passes).any(|d| d.pass == pass)
    {
        return Err(Failure::Input(format!("--perturb {pass}: no such pass")));
    }
    Ok(results)
}

fn line(d: &Deviation) -> String {
    let verdict = match &d.breach {
        Some(breach) => format!("BREACH in {}: {breach}", d.buffer),
        None => "ok".to_owned(),
    };
    format!(
        "  {:<10} {:>8} elements  max {:.1e}  99.9 % {:.1e}  tolerance {:.0e}  silhouettes {:<5} {verdict}",
        d.pass, d.elements, d.max, d.p999, d.tolerance, d.silhouettes
    )
}

fn judge(results: &[SceneResult]) -> Outcome {
    let breaches: Vec<_> = results
        .iter()
        .flat_map(|r| {
            r.passes.iter().filter(|d| d.breach.is_some()).map(|d| format!("{} in {}", d.pass, r.scene))
        })
        .collect();
    let passes = results.iter().map(|r| r.passes.len()).sum::<usize>();
    if passes == 0 {
        return Err(Failure::Check(format!("nothing was compared: {}", setup::NO_ADAPTER)));
    }
    if breaches.is_empty() {
        say(format!("{passes} buffers agree"));
        return Ok(());
    }
    Err(Failure::Check(format!("{} of {passes} buffers deviate: {}", breaches.len(), breaches.join(", "))))
}

/// All passes of a technique on one stage, which has a GPU.
pub(crate) fn stage(
    stage: &Stage<'_>,
    technique: &dyn Technique,
    perturb: Option<&str>,
) -> Outcome<Vec<Deviation>> {
    let mut twins = technique.twins(stage)?;
    if let Some(twin) = twins.iter_mut().find(|t| perturb == Some(t.pass)) {
        perturbed(twin);
    }
    Ok(twins.iter().map(deviation).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_result_is_no_success() {
        assert!(judge(&[]).is_err());
    }
}
