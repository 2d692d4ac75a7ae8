use crate::Error;

/// Which parts of the light are estimated; the other image stays black and costs nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Components {
    /// Emission seen and light that was reflected once, at the visible surface.
    Direct,
    /// Everything after.
    Indirect,
    /// Both, apart.
    #[default]
    Both,
}

impl Components {
    pub(crate) const fn direct(self) -> bool {
        matches!(self, Self::Direct | Self::Both)
    }

    pub(crate) const fn indirect(self) -> bool {
        matches!(self, Self::Indirect | Self::Both)
    }
}

/// How many indirect bounces are followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Bounces {
    /// At most so many: 0 is direct light alone, 1 is light → surface → visible surface.
    Count(u32),
    /// All of them, ended by Russian roulette.
    #[default]
    Infinite,
}

impl Bounces {
    pub(crate) const fn limit(self) -> u32 {
        match self {
            Self::Count(n) => n,
            Self::Infinite => u32::MAX,
        }
    }
}

/// Where in a pixel the camera rays go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PixelFilter {
    /// Through its centre, as a real-time technique shades it. The visible surface is found once per pixel, and punctual
    /// lights on it are exact.
    #[default]
    Center,
    /// Evenly over its square.
    Box,
}

/// How light from emissive triangles is found. All three have the same expectation; [`EmitterSampling::Mis`] has by far
/// the least variance. Punctual lights are always sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum EmitterSampling {
    /// Points on the emitters and directions from the surface, weighed by the power heuristic (Veach 1997, §9.2.3).
    #[default]
    Mis,
    /// Points on the emitters only: unbounded variance where an emitter touches another surface.
    Light,
    /// Directions from the surface only.
    Surface,
}

/// Whether pixels share light paths: the vertices of a few thousand paths per batch, which start at the lights, serve every
/// pixel as virtual point lights, and camera paths estimate only what virtual lights do badly. The expectation is the
/// same; see the crate page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum VirtualLights {
    /// Where a short trial finds less variance per ray with them. Never where a batch is small, below 2¹³ pixels
    /// of up to 16 samples (of `16 n` samples, `2¹³/n` pixels), which the trial would not repay. The same for every range of
    /// batches.
    #[default]
    Auto,
    /// Always, where they apply: not for more than one bounce with [`Settings::unoccluded`], nor for [`EmitterSampling`] other
    /// than `Mis`.
    On,
    /// Never: plain path tracing.
    Off,
}

/// Which samples are taken: the batches `first .. first + batches`, each of `batch` samples per pixel.
///
/// A batch is one randomized low-discrepancy point set; batches are independent, so their scatter gives the variance.
/// Larger batches converge faster, more batches give a surer variance. Estimates of disjoint ranges of equal `batch` can be
/// merged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Samples {
    /// Samples per pixel in a batch, at least 1; powers of two are stratified best.
    pub batch: u32,
    /// First batch.
    pub first: u32,
    /// Number of batches, at least 1; the variance needs 2.
    pub batches: u32,
}

impl Samples {
    /// At least `spp` samples per pixel in 8 to 16 batches of a power of two (fewer than 8 samples: that many batches of one).
    /// `spp` is rounded up to whole batches, by less than an eighth.
    #[must_use]
    pub const fn count(spp: u32) -> Self {
        let eighth = spp / 8;
        let batch = if eighth == 0 { 1 } else { 1 << eighth.ilog2() };
        Self { batch, first: 0, batches: spp.div_ceil(batch) }
    }

    /// The share of machine `index` of `machines`: a range of whole batches. Empty, and refused by [`crate::render`], where
    /// there are fewer batches than machines or `index` is out of range.
    #[must_use]
    pub fn part(self, index: u32, machines: u32) -> Self {
        let at = |i: u32| {
            let share = u64::from(self.batches) * u64::from(i.min(machines)) / u64::from(machines.max(1));
            u32::try_from(share).unwrap_or(u32::MAX)
        };
        let (lo, hi) = (at(index), at(index.saturating_add(1)));
        Self { first: self.first.saturating_add(lo), batches: hi - lo, ..self }
    }

    /// Samples per pixel in all.
    #[must_use]
    pub const fn spp(&self) -> u64 {
        self.batch as u64 * self.batches as u64
    }
}

/// What to estimate and how far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Direct light, indirect light or both.
    pub components: Components,
    /// Number of indirect bounces.
    pub bounces: Bounces,
    /// Visibility off on the first indirect bounce, as reflective shadow maps assume; see the crate page for the exact
    /// definition.
    pub unoccluded: bool,
    /// Samples per pixel.
    pub samples: Samples,
    /// Stop before the last batch as soon as [`Estimate::noise`](crate::Estimate::noise) of every requested component is at or
    /// below this, `> 0` (0.01 is 1 %). Looked at after 4 batches and each time that their number has grown by half.
    pub noise_target: Option<f64>,
    /// Any number; another seed gives an independent estimate.
    pub seed: u32,
    /// Where camera rays go.
    pub pixel_filter: PixelFilter,
    /// How light from emissive triangles is found.
    pub emitters: EmitterSampling,
    /// Light paths shared by all pixels.
    pub virtual_lights: VirtualLights,
    /// Russian roulette on camera paths. Without it `bounces` must be a count.
    pub roulette: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            components: Components::Both,
            bounces: Bounces::Infinite,
            unoccluded: false,
            samples: Samples::count(64),
            noise_target: None,
            seed: 0,
            pixel_filter: PixelFilter::Center,
            emitters: EmitterSampling::Mis,
            virtual_lights: VirtualLights::Auto,
            roulette: true,
        }
    }
}

impl Settings {
    /// Checks what no type can.
    ///
    /// # Errors
    /// [`Error::Settings`] names the first field at fault.
    pub fn validate(&self) -> Result<(), Error> {
        let fail = |message| Err(Error::Settings { message });
        let Samples { batch, first, batches } = self.samples;
        if batch == 0 || batches == 0 {
            return fail("there must be at least one batch of one sample");
        }
        if first.checked_add(batches).is_none() || u32::try_from(self.samples.spp()).is_err() {
            return fail("the sample range exceeds 2^32");
        }
        if self.noise_target.is_some_and(|t| !(t > 0.0 && t.is_finite())) {
            return fail("the noise target must be positive");
        }
        if !self.roulette && self.bounces == Bounces::Infinite {
            return fail("without Russian roulette the bounces must be limited");
        }
        Ok(())
    }
}
