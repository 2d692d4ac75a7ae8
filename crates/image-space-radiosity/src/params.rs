use rsm::{Form, Selection};

use crate::Error;

/// Which lights a fragment gathers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lights {
    /// The same list for every fragment, as the plain gather has it.
    Flat(Selection),
    /// Basic image-space radiosity (§3.4): the same list for every fragment, made by clustering texels that show no
    /// discontinuity.
    Basic {
        /// The coarsest patches: at most so many along each side of a map, `1..`.
        coarsest: u32,
        /// The finest patches, likewise; `coarsest..`, and no finer than the map.
        finest: u32,
    },
    /// Hierarchical image-space radiosity (§3.5): every tile of neighbouring fragments has its own cut through the tree of
    /// patches, as fine as its error bound asks for.
    Hierarchical {
        /// See [`Lights::Basic`].
        coarsest: u32,
        /// See [`Lights::Basic`].
        finest: u32,
    },
}

/// How light gets from lights to fragments.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Each fragment sums its lights. The default.
    #[default]
    Gather,
    /// Each light is added to every fragment in turn (Nichols & Wyman 2009): the baseline of §4.1.
    Splat,
    /// Each light is added to the pixels near it, at full resolution (Dachsbacher & Stamminger 2006): the other baseline.
    /// Loses the light beyond the bounds.
    BoundedSplat,
}

/// What is fixed when pipelines and buffers are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Texels along each side of each reflective shadow map, `1..=8192`.
    pub resolution: u32,
    /// Which lights a fragment gathers.
    pub lights: Lights,
    /// How light gets there.
    pub method: Method,
    /// Level of the coarsest blocks of pixels, `0..=8`: blocks of `2^level` pixels along each side. 0 gathers at every pixel.
    pub coarsest_block: u32,
}

impl Options {
    /// Largest accepted [`Options::coarsest_block`].
    pub const MAX_BLOCK: u32 = 8;

    /// # Errors
    /// [`Error::BadOption`] for a value outside its documented range, or splatting with lights that are no list.
    pub fn validate(&self) -> Result<(), Error> {
        let bad = |option, value: String, requirement| Err(Error::BadOption { option, value, requirement });
        if self.coarsest_block > Self::MAX_BLOCK {
            return bad("coarsest_block", self.coarsest_block.to_string(), "in 0..=8");
        }
        if let Lights::Basic { coarsest, finest } | Lights::Hierarchical { coarsest, finest } = self.lights {
            if coarsest == 0 {
                return bad("coarsest", coarsest.to_string(), "at least 1");
            }
            if finest < coarsest {
                return bad("finest", finest.to_string(), "at least `coarsest`");
            }
        }
        if self.method != Method::Gather && matches!(self.lights, Lights::Hierarchical { .. }) {
            return bad("method", format!("{:?}", self.method), "Gather with hierarchical lights");
        }
        self.rsm().validate()?;
        Ok(())
    }

    /// The options of the reflective shadow maps.
    #[must_use]
    pub const fn rsm(&self) -> rsm::Options {
        let selection = match self.lights {
            Lights::Flat(selection) => selection,
            // Not asked for any light: the smallest buffers.
            Lights::Basic { .. } | Lights::Hierarchical { .. } => Selection::Grid { cells: 1 },
        };
        rsm::Options { resolution: self.resolution, selection }
    }

    /// Whether light patches are needed.
    #[must_use]
    pub const fn has_patches(&self) -> bool {
        !matches!(self.lights, Lights::Flat(_))
            || matches!(self.method, Method::BoundedSplat)
            || self.coarsest_block > 0
    }
}

impl Default for Options {
    /// 256² texels, hierarchical from 16² patches, blocks of up to 64² pixels: the paper's (§3.2.2, §3.5).
    fn default() -> Self {
        Self {
            resolution: 256,
            lights: Lights::Hierarchical { coarsest: 16, finest: 256 },
            method: Method::Gather,
            coarsest_block: 6,
        }
    }
}

/// When a block or a patch holds a discontinuity. Both measures are free of units; a threshold of 0 finds one everywhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thresholds {
    /// For blocks, the depth range relative to the greatest depth; for patches, the distance from their plane relative to
    /// their radius. `[0, ∞)`; higher: fewer, larger, less exact.
    pub depth: f32,
    /// Half angle of the cone of normals, radians, `[0, π]`; likewise.
    pub normal: f32,
}

impl Thresholds {
    /// `1 − cos` of the angle, without its cancellation.
    #[must_use]
    pub fn versine(&self) -> f32 {
        let s = (0.5 * self.normal.min(core::f32::consts::PI)).sin();
        2.0 * s * s
    }

    fn validate(&self, options: [&'static str; 2]) -> Result<(), Error> {
        for (option, value) in options.into_iter().zip([self.depth, self.normal]) {
            if !(value.is_finite() && value >= 0.0) {
                return Err(Error::BadOption {
                    option,
                    value: value.to_string(),
                    requirement: "finite and ≥ 0",
                });
            }
        }
        Ok(())
    }
}

/// What decides that a patch is too coarse for a fragment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Bound {
    /// The error of taking the patch for one light: `Φ/(πd²) · (r²/d² + versine)`, where `r` is its radius and the versine that
    /// of its cone of normals, `d` the distance of its mean position. An estimate of the error rather than a bound: a patch
    /// that comes nearer than its mean errs more. The default.
    #[default]
    Error,
    /// The light that the patch sends, `Φ/(πd² + A)`: equations 7 and 8 with the reading of `docs/errata.md`. Splits bright
    /// patches that are far or flat as readily as those that need it.
    ContributionAsPrinted,
}

/// What may change from frame to frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Params {
    /// The factor between a light and a receiver.
    pub form: Form,
    /// Scrambles [`Selection::Importance`].
    pub seed: u32,
    /// When a block of pixels is subdivided.
    pub blocks: Thresholds,
    /// Light changes fast beside a surface that rises in front of another. A block is also subdivided for one that begins in the
    /// blocks beside it and within so many times its radius, `[0, ∞)`; 0 looks at the block alone, as the paper does.
    pub margin: f32,
    /// A block is also subdivided where light would bend across it by more than this share of the [`reference irradiance`],
    /// `[0, ∞)`: `Σ Φ/(πD) · r²/D` over the coarsest lights, where `r` is the block's radius and `D` the squared distance of a light
    /// plus the square of its radius. Not in the paper, whose blocks do not know where light comes from; a large number is
    /// the paper's behaviour.
    ///
    /// [`reference irradiance`]: crate::cpu::reference_irradiance
    pub bend: f32,
    /// When [`Lights::Basic`] subdivides a patch.
    pub patches: Thresholds,
    /// [`Lights::Hierarchical`] subdivides a patch whose bound exceeds this share of [`reference irradiance`], `[0, ∞)`. 0
    /// gathers the finest patches. Higher: fewer lights per fragment, less exact.
    ///
    /// [`reference irradiance`]: crate::cpu::reference_irradiance
    pub tau: f32,
    /// What is compared with `tau`.
    pub bound: Bound,
    /// [`Method::BoundedSplat`] ends a splat where its light falls below this share of the reference irradiance, `(0, ∞)`.
    pub cutoff: f32,
}

impl Params {
    /// # Errors
    /// [`Error::BadOption`] for a value outside its documented range.
    pub fn validate(&self) -> Result<(), Error> {
        self.blocks.validate(["blocks.depth", "blocks.normal"])?;
        self.patches.validate(["patches.depth", "patches.normal"])?;
        let bad = |option, value: f32, requirement| {
            Err(Error::BadOption { option, value: value.to_string(), requirement })
        };
        if !(self.bend.is_finite() && self.bend >= 0.0) {
            return bad("bend", self.bend, "finite and ≥ 0");
        }
        if !(self.margin.is_finite() && self.margin >= 0.0) {
            return bad("margin", self.margin, "finite and ≥ 0");
        }
        if !(self.tau.is_finite() && self.tau >= 0.0) {
            return bad("tau", self.tau, "finite and ≥ 0");
        }
        if !(self.cutoff.is_finite() && self.cutoff > 0.0) {
            return bad("cutoff", self.cutoff, "finite and > 0");
        }
        Ok(())
    }
}

impl Default for Params {
    fn default() -> Self {
        Self {
            form: Form::Disc,
            seed: 0,
            blocks: Thresholds { depth: 0.05, normal: 0.3 },
            margin: 3.0,
            bend: 0.003,
            patches: Thresholds { depth: 0.2, normal: 0.3 },
            tau: 0.003,
            bound: Bound::Error,
            cutoff: 0.01,
        }
    }
}
