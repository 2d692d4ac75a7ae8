//! How much work a scene is worth, and the seeds of references.

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
    pub(super) const fn most_spp(self) -> u32 {
        if self.quick { 1024 } else { 8192 }
    }

    /// A reference may stop at this noise: a tenth of the error of a good technique.
    pub(super) const fn noise_target(self) -> f64 {
        if self.quick { 0.01 } else { 0.003 }
    }

    /// Time for one reference.
    pub(super) const fn reference_seconds(self) -> f64 {
        if self.quick { 12.0 } else { 120.0 }
    }

    /// A curve of the path tracer ends with the first run that takes longer.
    pub(super) const fn baseline_ms(self) -> f64 {
        if self.quick { 3e3 } else { 2e4 }
    }

    pub(super) const fn baseline_spp(self) -> &'static [u32] {
        if self.quick { &[1, 2, 4, 8, 16, 32, 64] } else { &[1, 2, 4, 8, 16, 32, 64, 128, 256] }
    }

    /// Time for the frames of one setting.
    pub(super) const fn seconds(self) -> f64 {
        if self.quick { 0.4 } else { 1.5 }
    }
}

/// Seed of the truth; the runs that are measured against it use others.
pub(super) const TRUTH_SEED: u32 = 0x5eed;
