//! Comparison of a GPU result with its CPU twin.

use core::fmt;

use glam::{Vec2, Vec3, Vec4};

/// What the CPU computed: the side that errors are relative to.
#[derive(Debug, Clone, Copy)]
pub struct CpuOutput<'a, T>(pub &'a [T]);

/// What the GPU computed.
#[derive(Debug, Clone, Copy)]
pub struct GpuOutput<'a, T>(pub &'a [T]);

/// A value that is compared as a whole: the error of a vector is relative to the vector, not to each component, since a
/// component near 0 is the difference of larger numbers.
pub trait Element: Copy + fmt::Debug {
    /// The components.
    fn components(&self) -> impl Iterator<Item = f32>;
}

impl Element for f32 {
    fn components(&self) -> impl Iterator<Item = f32> {
        core::iter::once(*self)
    }
}

impl<const N: usize> Element for [f32; N] {
    fn components(&self) -> impl Iterator<Item = f32> {
        self.iter().copied()
    }
}

macro_rules! element {
    ($($vector:ty),*) => {$(
        impl Element for $vector {
            fn components(&self) -> impl Iterator<Item = f32> {
                self.to_array().into_iter()
            }
        }
    )*};
}
element!(Vec2, Vec3, Vec4);

/// How far two values may be apart: `relative · |cpu| + absolute`, by the largest component.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Share of the CPU's value, `> 0`.
    pub relative: f32,
    /// In the unit of the value, `≥ 0`.
    pub absolute: f32,
}

impl Tolerance {
    /// The workspace's tolerance for twins: 10⁻⁴ relative + 10⁻⁶ absolute.
    pub const TWINS: Self = Self { relative: 1e-4, absolute: 1e-6 };
}

/// An element with a large deviation.
#[derive(Debug, Clone, PartialEq)]
pub struct Worst {
    /// Its index.
    pub index: usize,
    /// Its deviation, see [`Comparison::max`]; NaN where a side is not finite.
    pub deviation: f64,
    /// The CPU's value, printed.
    pub cpu: String,
    /// The GPU's value, printed.
    pub gpu: String,
}

/// The outcome of a comparison that could be made.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// What was compared.
    pub name: String,
    /// Elements compared.
    pub compared: usize,
    /// Elements left out by the mask.
    pub masked: usize,
    /// Elements beyond the tolerance, those that are not finite included.
    pub breaches: usize,
    /// Largest deviation `|cpu − gpu| / (|cpu| + absolute/relative)`: at most [`Tolerance::relative`] where the
    /// tolerance is met. NaN where any side is not finite. For exact comparisons, 1 where anything differs.
    pub max: f64,
    /// The deviation that 99.9 % of the elements do not exceed.
    pub p999: f64,
    /// The worst elements, worst first.
    pub worst: Vec<Worst>,
}

/// Why two results cannot be compared, or are too far apart.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum CompareError {
    /// The sides, or the mask, differ in length.
    Length {
        /// What was compared.
        name: String,
        /// Elements of the CPU.
        cpu: usize,
        /// Elements of the GPU.
        gpu: usize,
        /// Elements of the mask, if any.
        mask: Option<usize>,
    },
    /// There is nothing to compare, or the mask leaves nothing.
    Empty {
        /// What was compared.
        name: String,
    },
    /// Elements are beyond the tolerance.
    Breach(Comparison),
}

impl core::error::Error for CompareError {}

impl fmt::Display for CompareError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length { name, cpu, gpu, mask: None } => {
                write!(f, "{name}: {cpu} elements on the CPU, {gpu} on the GPU")
            }
            Self::Length { name, cpu, gpu, mask: Some(mask) } => {
                write!(f, "{name}: {cpu} elements on the CPU, {gpu} on the GPU, {mask} in the mask")
            }
            Self::Empty { name } => write!(f, "{name}: nothing to compare"),
            Self::Breach(comparison) => {
                write!(f, "{comparison}")?;
                for w in &comparison.worst {
                    write!(
                        f,
                        "\n  [{}] deviation {:.3e}: cpu {}, gpu {}",
                        w.index, w.deviation, w.cpu, w.gpu
                    )?;
                }
                Ok(())
            }
        }
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, compared, masked, breaches, max, p999, .. } = self;
        write!(
            f,
            "{name}: {compared} compared, {masked} masked, {breaches} beyond tolerance, deviation max {max:.2e}, 99.9 % {p999:.2e}"
        )
    }
}

/// Number of elements listed in [`Comparison::worst`].
const WORST: usize = 8;

/// Compares two float results element by element, leaving out where `mask` is `false`.
///
/// # Errors
/// [`CompareError::Length`], [`CompareError::Empty`], and [`CompareError::Breach`] where an element is beyond the
/// tolerance or not finite on either side.
pub fn compare<T: Element>(
    name: &str,
    cpu: CpuOutput<'_, T>,
    gpu: GpuOutput<'_, T>,
    tolerance: Tolerance,
    mask: Option<&[bool]>,
) -> Result<Comparison, CompareError> {
    let floor = f64::from(tolerance.absolute) / f64::from(tolerance.relative);
    let limit = f64::from(tolerance.relative);
    judge(name, cpu, gpu, mask, limit, |a, b| {
        let (mut scale, mut error) = (0.0_f64, 0.0_f64);
        for (a, b) in a.components().zip(b.components()) {
            let (a, b) = (f64::from(a), f64::from(b));
            if !(a.is_finite() && b.is_finite()) {
                return f64::NAN;
            }
            scale = scale.max(a.abs());
            error = error.max((a - b).abs());
        }
        // Without an absolute tolerance, equal zeros would be 0/0.
        if error > 0.0 { error / (scale + floor) } else { 0.0 }
    })
}

/// Compares two results that must be equal: integers, indices, flags.
///
/// # Errors
/// As [`compare`].
pub fn compare_exact<T: PartialEq + fmt::Debug>(
    name: &str,
    cpu: CpuOutput<'_, T>,
    gpu: GpuOutput<'_, T>,
    mask: Option<&[bool]>,
) -> Result<Comparison, CompareError> {
    judge(name, cpu, gpu, mask, 0.0, |a, b| if a == b { 0.0 } else { 1.0 })
}

fn judge<T: fmt::Debug>(
    name: &str,
    CpuOutput(cpu): CpuOutput<'_, T>,
    GpuOutput(gpu): GpuOutput<'_, T>,
    mask: Option<&[bool]>,
    limit: f64,
    deviation: impl Fn(&T, &T) -> f64,
) -> Result<Comparison, CompareError> {
    let name = name.to_owned();
    if cpu.len() != gpu.len() || mask.is_some_and(|m| m.len() != cpu.len()) {
        let mask = mask.map(<[bool]>::len);
        return Err(CompareError::Length { name, cpu: cpu.len(), gpu: gpu.len(), mask });
    }
    let kept = |i: &usize| mask.is_none_or(|m| m[*i]);
    let mut deviations: Vec<(usize, f64)> =
        (0..cpu.len()).filter(kept).map(|i| (i, deviation(&cpu[i], &gpu[i]))).collect();
    if deviations.is_empty() {
        return Err(CompareError::Empty { name });
    }
    // NaN first, then the largest.
    deviations.sort_by(|(_, a), (_, b)| b.total_cmp(a));
    let compared = deviations.len();
    let breaches = deviations.iter().filter(|(_, d)| d.is_nan() || *d > limit).count();
    let worst = deviations.iter().take(WORST).filter(|(_, d)| *d != 0.0).map(|&(index, deviation)| Worst {
        index,
        deviation,
        cpu: format!("{:?}", cpu[index]),
        gpu: format!("{:?}", gpu[index]),
    });
    let comparison = Comparison {
        name,
        compared,
        masked: cpu.len() - compared,
        breaches,
        max: deviations[0].1,
        // One in a thousand may exceed it.
        p999: deviations[compared / 1000].1,
        worst: worst.collect(),
    };
    if breaches > 0 { Err(CompareError::Breach(comparison)) } else { Ok(comparison) }
}
