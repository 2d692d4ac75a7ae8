//! `validate`: every pass on the GPU against its twin on the CPU.

use serde::Serialize;
use testkit::{CompareError, Comparison, CpuOutput, GpuOutput, Tolerance, compare, compare_exact};

use crate::cli::ValidateArgs;
use crate::failure::{self, Failure, Outcome};
use crate::stage::{Source, Stage};
use crate::technique::{self, Data, Technique, Twin};
use crate::{fixtures as stored, gpu, progress, say, setup, warn};

/// Width of the images that are compared: odd on purpose, so that no size is a multiple of a workgroup.
const WIDTH: u32 = 161;

/// How far a buffer on the GPU is from its twin.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Deviation {
    pub(crate) pass: String,
    pub(crate) buffer: String,
    /// Elements compared.
    pub(crate) elements: usize,
    /// Largest deviation, relative to the CPU's value with an absolute floor; infinite where a side is not finite.
    pub(crate) max: f64,
    /// What 99.9 % of the elements stay within.
    pub(crate) p999: f64,
    /// Largest `max` that passes; 0 for whole numbers.
    pub(crate) tolerance: f64,
    /// Elements where the twins see different triangles.
    pub(crate) silhouettes: usize,
    /// Why the buffer fails, if it does.
    pub(crate) breach: Option<String>,
}

impl Deviation {
    /// One line per pass: the worst of its buffers.
    pub(crate) fn per_pass(all: &[Self]) -> Vec<Self> {
        let mut passes: Vec<Self> = Vec::new();
        for d in all {
            let Some(p) = passes.iter_mut().find(|p| p.pass == d.pass) else {
                passes.push(d.clone());
                continue;
            };
            p.elements += d.elements;
            p.max = p.max.max(d.max);
            p.p999 = p.p999.max(d.p999);
            p.tolerance = p.tolerance.max(d.tolerance);
            p.silhouettes = p.silhouettes.max(d.silhouettes);
            if p.breach.is_none() && d.breach.is_some() {
                (p.buffer, p.breach) = (d.buffer.clone(), d.breach.clone());
            }
        }
        passes
    }
}

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
        let gpu = gpu::open(&source.scene, 0)?;
        let adapter = gpu.context.describe();
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
    if let Some(twin) = twins.iter_mut().find(|t| perturb == Some(t.pass.as_str())) {
        twin.perturb();
    }
    Ok(twins.iter().map(deviation).collect())
}

/// Compares one buffer.
fn deviation(twin: &Twin) -> Deviation {
    let mask = twin.same_triangle.as_deref();
    let (outcome, tolerance) = match (&twin.cpu, &twin.gpu) {
        (Data::Ints(cpu), Data::Ints(gpu)) => {
            (compare_exact(&twin.buffer, CpuOutput(cpu), GpuOutput(gpu), mask), 0.0)
        }
        (Data::Floats(cpu, n), Data::Floats(gpu, m)) if n == m => {
            (floats(&twin.buffer, cpu, gpu, *n, mask), f64::from(Tolerance::TWINS.relative))
        }
        _ => (Err(CompareError::Empty { name: "the sides hold different kinds of numbers".into() }), 0.0),
    };
    let silhouettes = mask.map_or(0, |m| m.iter().filter(|same| !**same).count());
    let mut result = Deviation {
        pass: twin.pass.clone(),
        buffer: twin.buffer.clone(),
        elements: 0,
        max: 0.0,
        p999: 0.0,
        tolerance,
        silhouettes,
        breach: None,
    };
    match outcome {
        // A buffer without elements (no light, no map) has nothing to disagree about.
        Err(CompareError::Empty { .. }) if twin.cpu.is_empty() && twin.gpu.is_empty() => return result,
        Ok(c) => (result.elements, result.max, result.p999) = (c.compared, c.max, c.p999),
        Err(CompareError::Breach(c)) => {
            (result.elements, result.max, result.p999) = (c.compared, c.max, c.p999);
            let worst = c.worst.first().map_or_else(String::new, |w| {
                format!(", the worst [{}]: {} on the CPU, {} on the GPU", w.index, w.cpu, w.gpu)
            });
            result.breach = Some(format!("{} of {} elements deviate{worst}", c.breaches, c.compared));
        }
        Err(e) => result.breach = Some(e.to_string()),
    }
    // JSON has no NaN; a value that is not a number is as far as can be.
    for v in [&mut result.max, &mut result.p999] {
        *v = if v.is_nan() { f64::MAX } else { *v };
    }
    if let Some(mask) = mask
        && silhouettes > mask.len() / 50
    {
        // The twins see the same triangle in all but the texels that an edge crosses: a few in a thousand. Two in a hundred
        // would be an offset of the whole view.
        result.breach.get_or_insert(format!("{silhouettes} of {} elements are silhouettes", mask.len()));
    }
    result
}

/// Compares elements of `components` numbers each, so that deviations are relative to whole vectors.
fn floats(
    name: &str,
    cpu: &[f32],
    gpu: &[f32],
    components: usize,
    mask: Option<&[bool]>,
) -> Result<Comparison, CompareError> {
    fn of<const N: usize>(
        name: &str,
        cpu: &[f32],
        gpu: &[f32],
        mask: Option<&[bool]>,
    ) -> Result<Comparison, CompareError> {
        // Lengths that are no multiple of N would lose their rest, and two different ones could look equal.
        if cpu.len() != gpu.len() || !cpu.len().is_multiple_of(N) {
            return Err(CompareError::Length {
                name: name.to_owned(),
                cpu: cpu.len(),
                gpu: gpu.len(),
                mask: None,
            });
        }
        let (cpu, gpu) = (cpu.as_chunks::<N>().0, gpu.as_chunks::<N>().0);
        // 10⁻⁶ of the buffer's own magnitude where that is below 1: dim and tiny scenes are held as closely as others.
        let largest = cpu.iter().flatten().filter(|v| v.is_finite()).fold(0.0_f32, |m, v| m.max(v.abs()));
        let absolute = Tolerance::TWINS.absolute * largest.clamp(1e-30, 1.0);
        compare(name, CpuOutput(cpu), GpuOutput(gpu), Tolerance { absolute, ..Tolerance::TWINS }, mask)
    }
    match components {
        2 => of::<2>(name, cpu, gpu, mask),
        3 => of::<3>(name, cpu, gpu, mask),
        4 => of::<4>(name, cpu, gpu, mask),
        6 => of::<6>(name, cpu, gpu, mask),
        12 => of::<12>(name, cpu, gpu, mask),
        28 => of::<28>(name, cpu, gpu, mask),
        _ => of::<1>(name, cpu, gpu, mask),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn twin(cpu: &[f32], gpu: &[f32]) -> Twin {
        Twin {
            pass: "p".into(),
            buffer: "b".into(),
            cpu: Data::Floats(cpu.to_vec(), 2),
            gpu: Data::Floats(gpu.to_vec(), 2),
            same_triangle: None,
        }
    }

    #[test]
    fn equal_twins_pass_and_a_perturbed_one_fails() {
        let values: Vec<f32> = (0..1000).map(|i| i as f32 * 0.01).collect();
        let mut t = twin(&values, &values);
        assert!(deviation(&t).breach.is_none());
        t.perturb();
        assert!(deviation(&t).breach.is_some());
        let ints = |v: Vec<u32>| Data::Ints(v);
        let mut t = Twin { cpu: ints(vec![3]), gpu: ints(vec![3]), ..twin(&[], &[]) };
        assert!(deviation(&t).breach.is_none());
        t.perturb();
        assert!(deviation(&t).breach.is_some());
    }

    #[test]
    fn what_cannot_be_compared_fails() {
        assert!(deviation(&twin(&[1.0, 1.0], &[1.0, 1.0, 1.0, 1.0])).breach.is_some());
        assert!(deviation(&twin(&[1.0], &[1.0])).breach.is_some());
        for bad in [f32::NAN, f32::INFINITY] {
            let d = deviation(&twin(&[1.0, 1.0], &[1.0, bad]));
            assert!(d.breach.is_some() && !d.max.is_nan(), "{d:?}");
            assert!(deviation(&twin(&[1.0, bad], &[1.0, bad])).breach.is_some());
        }
        let kinds = Twin { cpu: Data::Ints(vec![1]), ..twin(&[1.0, 1.0], &[1.0, 1.0]) };
        assert!(deviation(&kinds).breach.is_some());
    }

    #[test]
    fn silhouettes_are_counted_and_left_out_but_not_without_limit() {
        let mut t = twin(&[1.0; 200], &[1.0; 200]);
        let mut mask = vec![true; 100];
        mask[3] = false;
        t.same_triangle = Some(mask.clone());
        if let Data::Floats(v, _) = &mut t.gpu {
            v[7] = 9.0;
        }
        let d = deviation(&t);
        assert!(d.breach.is_none() && d.silhouettes == 1 && d.elements == 99 && d.max == 0.0, "{d:?}");
        mask[..5].fill(false);
        t.same_triangle = Some(mask);
        assert!(deviation(&t).breach.is_some());
        t.same_triangle = Some(vec![false; 100]);
        assert!(deviation(&t).breach.is_some());
    }

    #[test]
    fn a_pass_is_as_bad_as_its_worst_buffer() {
        let good = deviation(&twin(&[1.0, 2.0], &[1.0, 2.0]));
        let bad = deviation(&twin(&[1.0, 2.0], &[1.0, 3.0]));
        let passes = Deviation::per_pass(&[good, bad.clone()]);
        assert_eq!((passes.len(), passes[0].elements, passes[0].max), (1, 2, bad.max));
        assert!(passes[0].breach.is_some());
    }

    #[test]
    fn no_result_is_no_success() {
        assert!(judge(&[]).is_err());
    }
}
