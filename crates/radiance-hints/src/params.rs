use glam::Vec3;

use crate::Error;

/// How many spherical harmonics a hint stores per channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Order {
    /// `l ≤ 1`: 4 coefficients, 48 bytes a hint.
    Two,
    /// `l ≤ 2`: 9 coefficients, 112 bytes a hint; the irradiance of any distant light to within 3 %.
    #[default]
    Three,
}

impl Order {
    /// Vectors of four numbers that a hint takes: the first four coefficients of red, green and blue; then, for order 3, the
    /// next four of each, and the ninth of all three.
    #[must_use]
    pub const fn vectors(self) -> u32 {
        match self {
            Self::Two => 3,
            Self::Three => 7,
        }
    }

    /// Coefficients per channel.
    #[must_use]
    pub const fn coefficients(self) -> u32 {
        match self {
            Self::Two => 4,
            Self::Three => 9,
        }
    }
}

/// Which texels of the maps a hint looks at.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Sampling {
    /// Texels of all maps, in proportion to the luminance of the flux that they reflect: no sample falls on an unlit texel,
    /// several maps share the samples by their power, and a sample drawn with probability `p` stands for `1/(p·N_s)`. The
    /// sum is that over all texels, in the mean.
    Importance,
    /// The same, but a hint close to a lit surface spends about half of its samples on the texels around its own projection,
    /// one in each node of a window of the map's pyramid, and the others on all that lies outside of it: what is near is not
    /// left to luck. Keeps 64 bytes for each of [`Draw::near`] samples of each hint, and 32 more. The default.
    #[default]
    Nearby,
    /// As printed (§4): in each map, the samples fall evenly into a disc around the hint's own projection, which takes this
    /// share of the map's area, `(0, 1]`; a sample stands for `c·M/N_s` of the `M` texels. Light from outside of the disc is
    /// lost, which for small discs is most of it. Keeps one list of samples per hint: `64·N_s` bytes a hint.
    Disc {
        /// The share of the map, `c_RSM` in the paper: 0.05 to 0.15 outdoors, up to 0.9 indoors.
        fraction: f32,
    },
}

/// Whether anything stands between a sample and a hint. The paper's method asks nothing: the first bounce passes through
/// walls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Visibility {
    /// Nothing does.
    #[default]
    Off,
    /// The maps' own depth decides: where the segment passes from before a lit surface to behind it, it is blocked; where it
    /// enters a shadow through its side, it is not. Directions of later bounces ([`Transport::Directions`]) end there too. Needs no geometry and does not depend on the camera; a wall that no
    /// light sees stays open.
    RsmDepth,
    /// §8 as printed: points of the segment that lie behind the camera's depth halve the sample's light, each. Depends on
    /// the camera.
    CameraDepth,
}

/// How light goes from hint to hint in the second and later bounces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Transport {
    /// Directions evenly over the sphere, each followed to where the lattice's box ends, where indoors the walls are. Each
    /// direction has the same weight, however near the hint is to a wall. The default.
    #[default]
    Directions,
    /// The paper's places, evenly in a sphere of the radius `range`, with the weighted mean that eq. 8 and 9 mean, Neumann
    /// accumulation and the hints' albedo. Directions are as even as the places: near a wall all light comes from one side.
    Sphere,
    /// Eq. 8 to 10 as printed: weights that are normalised twice (too dark by about `1/N_b`), the running total as source of
    /// the next bounce, and white reflectance.
    SphereAsPrinted,
}

/// Where a pixel reads the field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Reconstruction {
    /// Close to the surface and once farther away, only from hints before its plane, and extrapolated to it: what hints half
    /// a cell away see is not what the surface sees. The default.
    #[default]
    NearSurface,
    /// §5: on a hemisphere whose radius is the diagonal of a cell, lifted by half of that: half a diagonal to one and a half
    /// away from the surface, whatever the hints there are.
    AsPrinted,
}

/// Resolution at which the field is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scale {
    /// At every pixel.
    #[default]
    Full,
    /// At one of 2 × 2 pixels, upsampled by depth and normal.
    Half,
    /// At one of 4 × 4 pixels, upsampled by depth and normal.
    Quarter,
}

impl Scale {
    /// Pixels per texel of the buffer, along each side.
    #[must_use]
    pub const fn step(self) -> u32 {
        match self {
            Self::Full => 1,
            Self::Half => 2,
            Self::Quarter => 4,
        }
    }
}

/// What is fixed when the technique is made; what is not asked for is not allocated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Texels along each side of each shadow map, `1..=8192`. Higher: finer; time and memory grow with its square.
    pub resolution: u32,
    /// Spherical harmonics of a hint.
    pub order: Order,
    /// Samples of all maps together per hint, `1..=1024`; the paper's 12 to 70. Higher: less noise, time grows in proportion.
    pub samples: u32,
    /// Which texels become samples.
    pub sampling: Sampling,
    /// What blocks a sample.
    pub visibility: Visibility,
    /// Indirect bounces, `1..=64`. One allocates neither a second volume nor distances and albedos.
    pub bounces: u32,
    /// Samples of the field per hint and further bounce, `1..=1024`; the paper's 16 to 32. Higher: less noise.
    pub bounce_samples: u32,
    /// Resolution at which pixels read the field.
    pub scale: Scale,
}

impl Options {
    /// # Errors
    /// [`Error::BadOption`] for a value outside its documented range.
    pub fn validate(&self) -> Result<(), Error> {
        rsm::Options { resolution: self.resolution, ..rsm::Options::default() }.validate()?;
        range("samples", self.samples, 1024, "in 1..=1024")?;
        range("bounces", self.bounces, 64, "in 1..=64")?;
        range("bounce_samples", self.bounce_samples, 1024, "in 1..=1024")?;
        match self.sampling {
            Sampling::Disc { fraction } if !(fraction > 0.0 && fraction <= 1.0) => Err(Error::BadOption {
                option: "fraction",
                value: fraction.to_string(),
                requirement: "in (0, 1]",
            }),
            _ => Ok(()),
        }
    }

    /// The options of the maps; a list of virtual lights is not made.
    #[must_use]
    pub const fn rsm(&self) -> rsm::Options {
        rsm::Options { resolution: self.resolution, selection: rsm::Selection::Importance { count: 1 } }
    }

    /// How samples are drawn with this seed.
    #[must_use]
    pub const fn draw(&self, seed: u32) -> Draw {
        Draw { sampling: self.sampling, samples: self.samples, seed }
    }

    /// Words per hint of the visibility test; 0 without one.
    #[must_use]
    pub const fn words(&self) -> u32 {
        match self.visibility {
            Visibility::Off => 0,
            Visibility::RsmDepth | Visibility::CameraDepth => blocked_words(self.samples),
        }
    }

    /// Words per hint of the stops of the directions of later bounces; 0 where nothing is tested or there are none.
    #[must_use]
    pub const fn stop_words(&self) -> u32 {
        match self.visibility {
            Visibility::RsmDepth if self.bounces > 1 => stop_words(self.bounce_samples),
            _ => 0,
        }
    }

    /// Bytes of the hints: `16·vectors` for each and each volume that is held at once, one for one bounce, two for two
    /// and three for more; 20 more for each where there is more than one bounce.
    #[must_use]
    pub fn hint_bytes(&self, hints: u32) -> u64 {
        let volume = 16 * u64::from(self.order.vectors());
        let more = if self.bounces > 1 { 20 } else { 0 };
        u64::from(hints) * (volume * u64::from(self.bounces.min(3)) + more)
    }
}

/// Four bits for each of so many samples of a hint, eight to a word.
pub(crate) const fn blocked_words(samples: u32) -> u32 {
    samples.div_ceil(8)
}

/// Eight bits for each of so many directions of a hint, four to a word.
pub(crate) const fn stop_words(directions: u32) -> u32 {
    directions.div_ceil(4)
}

/// How samples are drawn from the maps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Draw {
    /// Which texels become samples.
    pub sampling: Sampling,
    /// Samples per hint, all maps together.
    pub samples: u32,
    /// Scrambles the sequences.
    pub seed: u32,
}

impl Draw {
    /// Lists of samples that are drawn; see [`INTERLEAVE`].
    #[must_use]
    pub fn lists(&self, hints: u32) -> u32 {
        match self.sampling {
            Sampling::Importance | Sampling::Nearby => INTERLEAVE * INTERLEAVE * INTERLEAVE,
            Sampling::Disc { .. } => hints,
        }
    }

    /// Nodes along each side of either level of the window of a hint, [`Sampling::Nearby`]: an even number, 4 for 60
    /// samples; 0 for other samplings and for fewer than 12 samples.
    #[must_use]
    pub const fn side(&self) -> u32 {
        match self.sampling {
            Sampling::Nearby => 2 * (self.samples / 12).isqrt(),
            Sampling::Importance | Sampling::Disc { .. } => 0,
        }
    }

    /// Samples in the window of a hint: one for each node of the fine level and of what the coarse one has around it.
    #[must_use]
    pub const fn near(&self) -> u32 {
        let side = self.side();
        2 * side * side - side * side / 4
    }
}

fn range(option: &'static str, value: u32, most: u32, requirement: &'static str) -> Result<(), Error> {
    if (1..=most).contains(&value) {
        return Ok(());
    }
    Err(Error::BadOption { option, value: value.to_string(), requirement })
}

impl Default for Options {
    /// Order 3, 60 samples, one bounce, full resolution: the paper's Cornell box.
    fn default() -> Self {
        Self {
            resolution: 512,
            order: Order::Three,
            samples: 60,
            sampling: Sampling::Nearby,
            visibility: Visibility::Off,
            bounces: 1,
            bounce_samples: 32,
            scale: Scale::Full,
        }
    }
}

/// Hints repeat their list of samples after so many cells along each axis. Each block of `4³` hints uses `64·N_s` different
/// samples, consecutive ones of a low-discrepancy sequence, so that what interpolation averages is spread as evenly as the
/// samples of one hint; 64 lists cost `4096·N_s` bytes, whatever the number of hints.
pub const INTERLEAVE: u32 = 4;

/// Mean albedo of what lies behind each face of the lattice's box, `[0, 1]`; black where a side is open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Enclosure {
    /// The faces `−x, +x, −y, +y, −z, +z`.
    pub albedo: [Vec3; 6],
    /// How far it is, as a mean share of the way to the face, `(0, 1]`.
    pub depth: [f32; 6],
}

impl Default for Enclosure {
    /// Nothing: black, at the faces.
    fn default() -> Self {
        Self { albedo: [Vec3::ZERO; 6], depth: [1.0; 6] }
    }
}

/// What may change from frame to frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Params {
    /// Scrambles the sequences. Another seed, other samples of the same expectation.
    pub seed: u32,
    /// How far a sample of a hint may be from its centre, as a share of the cell, `[0, 1]`. 1 is the paper's; lower keeps the
    /// field sharper, and a hint beside a wall on its own side of it. The default is 0.
    pub jitter: f32,
    /// Share of its area by which a sample's `1/d²` is bounded, `[0, 1]`. 0 is the printed form, unbounded where a hint meets
    /// a sample; 1 is a disc of the sample's whole area, which in the corners that it spans is a little too dark. The default
    /// is 0.4.
    pub footprint: f32,
    /// How light goes from hint to hint.
    pub transport: Transport,
    /// What surrounds the box, for [`Transport::Directions`]. `None`: nothing but the maps is known, every side counts as a wall
    /// of the lit surfaces' mean albedo, and later bounces are too bright where a side is open or what no light reaches is
    /// darker.
    pub enclosure: Option<Enclosure>,
    /// How far a hint looks for others, as a share of its volume's diagonal, `(0, 1]`: the paper's `r_max`.
    pub range: f32,
    /// Where pixels read the field.
    pub reconstruction: Reconstruction,
}

impl Params {
    /// # Errors
    /// [`Error::BadOption`] for a value outside its documented range.
    pub fn validate(&self) -> Result<(), Error> {
        let share = |option, value: f32| {
            if (0.0..=1.0).contains(&value) {
                return Ok(());
            }
            Err(Error::BadOption { option, value: value.to_string(), requirement: "in [0, 1]" })
        };
        share("jitter", self.jitter)?;
        share("footprint", self.footprint)?;
        share("range", self.range)?;
        if self.range <= 0.0 {
            let requirement = "in (0, 1]";
            return Err(Error::BadOption { option: "range", value: self.range.to_string(), requirement });
        }
        Ok(())
    }
}

impl Default for Params {
    fn default() -> Self {
        Self {
            seed: 0,
            jitter: 0.0,
            footprint: 0.4,
            transport: Transport::Directions,
            enclosure: None,
            range: 1.0,
            reconstruction: Reconstruction::NearSurface,
        }
    }
}
