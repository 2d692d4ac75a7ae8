//! One scene: the truth, every technique through its sweep, the path tracer at the same times, the split of the error and the twins.

use std::collections::BTreeMap;
use std::time::Instant;

use indirect_gpu::wgpu::Limits;

use super::data::{Run, SceneReport, TechniqueReport};
use super::effort::Effort;
use super::models::Models;
use super::split::split;
use super::sweep::{baseline, sweep};
use super::truth::truth;
use crate::failure::Outcome;
use crate::stage::{Source, Stage};
use crate::technique::Technique;
use crate::validate;

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
