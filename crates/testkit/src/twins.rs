//! Twins, as `indirect_technique` brings them, judged by one tolerance.

use indirect_technique::gpu::{Data, Twin};

use crate::{CompareError, Comparison, CpuOutput, GpuOutput, Tolerance, compare, compare_exact};

/// How far a buffer on the GPU is from its twin.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Deviation {
    /// Name of the pass.
    pub pass: &'static str,
    /// What the buffer holds.
    pub buffer: String,
    /// Elements compared.
    pub elements: usize,
    /// Largest deviation, relative to the CPU's value with an absolute floor; infinite where a side is not finite.
    pub max: f64,
    /// What 99.9 % of the elements stay within.
    pub p999: f64,
    /// Largest `max` that passes; 0 for whole numbers.
    pub tolerance: f64,
    /// Elements where the twins made different choices: saw other triangles, fell to the other side of a border.
    pub silhouettes: usize,
    /// Why the buffer fails, if it does.
    pub breach: Option<String>,
}

impl Deviation {
    /// One row per pass: the worst of its buffers.
    #[must_use]
    pub fn per_pass(all: &[Self]) -> Vec<Self> {
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

/// Fails where any buffer deviates from its twin, or where there is none to compare.
///
/// # Panics
/// With the buffers that do.
pub fn judge(twins: &[Twin]) -> Vec<Deviation> {
    assert!(!twins.is_empty(), "nothing was compared");
    let all: Vec<_> = twins.iter().map(deviation).collect();
    let bad: Vec<_> =
        all.iter().filter_map(|d| Some(format!("{} {}: {}", d.pass, d.buffer, d.breach.as_ref()?))).collect();
    assert!(bad.is_empty(), "{} of {} buffers deviate:\n{}", bad.len(), all.len(), bad.join("\n"));
    all
}

/// Adds 1 % to the largest number of the GPU (1 where all are 0), or 1 to the first whole one: what a comparison must notice.
pub fn perturb(twin: &mut Twin) {
    let same = twin.same.as_deref();
    let counts = |i: usize, components: usize| same.is_none_or(|m| m[i / components]);
    match &mut twin.gpu {
        Data::U32 { values, components } => {
            if let Some(i) = (0..values.len()).find(|i| counts(*i, *components)) {
                values[i] = values[i].wrapping_add(1);
            }
        }
        Data::F32 { values, components } => {
            let largest = (0..values.len())
                .filter(|i| counts(*i, *components))
                .max_by(|a, b| values[*a].abs().total_cmp(&values[*b].abs()));
            if let Some(i) = largest {
                values[i] = if values[i] == 0.0 { 1.0 } else { 1.01 * values[i] };
            }
        }
    }
}

/// Compares one buffer.
#[must_use]
pub fn deviation(twin: &Twin) -> Deviation {
    let mask = twin.same.as_deref();
    let (outcome, tolerance) = match (&twin.cpu, &twin.gpu) {
        (Data::U32 { values: cpu, components: n }, Data::U32 { values: gpu, components: m }) if n == m => {
            let (cpu, gpu): (Vec<_>, Vec<_>) = (cpu.chunks(*n).collect(), gpu.chunks(*n).collect());
            (compare_exact(&twin.buffer, CpuOutput(&cpu), GpuOutput(&gpu), mask), 0.0)
        }
        (Data::F32 { values: cpu, components: n }, Data::F32 { values: gpu, components: m }) if n == m => {
            (floats(&twin.buffer, cpu, gpu, *n, mask), f64::from(Tolerance::TWINS.relative))
        }
        _ => (Err(CompareError::Empty { name: "the sides hold different kinds of numbers".into() }), 0.0),
    };
    let silhouettes = mask.map_or(0, |m| m.iter().filter(|same| !**same).count());
    let mut result = Deviation {
        pass: twin.pass,
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
            pass: "p",
            buffer: "b".into(),
            cpu: Data::floats(cpu, 2),
            gpu: Data::floats(gpu, 2),
            same: None,
        }
    }

    #[test]
    fn equal_twins_pass_and_a_perturbed_one_fails() {
        let values: Vec<f32> = (0..1000).map(|i| i as f32 * 0.01).collect();
        let mut t = twin(&values, &values);
        assert!(deviation(&t).breach.is_none());
        perturb(&mut t);
        assert!(deviation(&t).breach.is_some());
        let ints = |v: Vec<u32>| Data::words(&v, 1);
        let mut t = Twin { cpu: ints(vec![3]), gpu: ints(vec![3]), ..twin(&[], &[]) };
        assert!(deviation(&t).breach.is_none());
        perturb(&mut t);
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
        let kinds = Twin { cpu: Data::words(&[1_u32], 1), ..twin(&[1.0, 1.0], &[1.0, 1.0]) };
        assert!(deviation(&kinds).breach.is_some());
    }

    #[test]
    fn silhouettes_are_counted_and_left_out_but_not_without_limit() {
        let mut t = twin(&[1.0; 200], &[1.0; 200]);
        let mut mask = vec![true; 100];
        mask[3] = false;
        t.same = Some(mask.clone());
        if let Data::F32 { values: v, .. } = &mut t.gpu {
            v[7] = 9.0;
        }
        let d = deviation(&t);
        assert!(d.breach.is_none() && d.silhouettes == 1 && d.elements == 99 && d.max == 0.0, "{d:?}");
        mask[..5].fill(false);
        t.same = Some(mask);
        assert!(deviation(&t).breach.is_some());
        t.same = Some(vec![false; 100]);
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
}
