use glam::Vec3;
use indirect_core::Aabb;
use indirect_core::settings::{BadOption, Settings};
use indirect_filter::Reduced;

use crate::{
    settings::{Options, Params, Sampling},
    volume::Lattice,
};

/// Mean albedo of the surfaces that surround the lattice's box, and how far they are, per face of the box; black where a
/// side is open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Enclosure {
    /// Albedo behind the faces `−x, +x, −y, +y, −z, +z`, `[0, 1]`.
    pub albedo: [Vec3; 6],
    /// Distance from inside the box to the surfaces, as a mean share of the distance to the face, `(0, 1]`.
    pub depth: [f32; 6],
}

impl Default for Enclosure {
    /// Black, at the faces.
    fn default() -> Self {
        Self { albedo: [Vec3::ZERO; 6], depth: [1.0; 6] }
    }
}

/// All settings, and what was fitted to the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// Fixed when buffers are made.
    pub options: Options,
    /// Per frame.
    pub params: Params,
    /// Where the hints are. May move from frame to frame; another number of hints needs other buffers.
    pub lattice: Lattice,
    /// What surrounds its box, for [`Transport::Directions`](crate::Transport::Directions); `None` where it is not known, see
    /// [`Surround::Maps`](crate::Surround::Maps).
    pub enclosure: Option<Enclosure>,
}

impl Setup {
    /// One box of at most [`Options::lattice`]`³` hints over `bounds`, whose surroundings are not known. Where the geometry
    /// is at hand, `RadianceHints::fit` measures them too.
    ///
    /// # Errors
    /// [`BadOption`] where a setting is out of range, or as [`Lattice::fit`].
    pub fn new(bounds: &Aabb, options: Options, params: Params) -> Result<Self, BadOption> {
        options.validate()?;
        params.validate()?;
        let lattice = Lattice::fit(bounds, options.lattice.pow(3))?;
        Ok(Self { options, params, lattice, enclosure: None })
    }

    /// The image that the field is read at, for one of `size` pixels.
    #[must_use]
    pub fn reduced(&self, size: [u32; 2]) -> Reduced {
        Reduced::new(size, self.options.scale.step())
    }

    /// How samples are drawn from the maps.
    #[must_use]
    pub const fn draw(&self) -> Draw {
        let (Options { sampling, samples, .. }, Params { disc, seed, .. }) = (&self.options, &self.params);
        Draw { sampling: *sampling, disc: *disc, samples: *samples, seed: *seed }
    }
}

/// Hints repeat their list of samples after so many cells along each axis. Each block of `4³` hints uses `64·N_s` different
/// samples, consecutive ones of a low-discrepancy sequence, so that what interpolation averages is spread as evenly as the
/// samples of one hint; 64 lists cost `4096·N_s` bytes, whatever the number of hints.
pub const INTERLEAVE: u32 = 4;

/// How samples are drawn from the maps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Draw {
    /// Which texels become samples.
    pub sampling: Sampling,
    /// See [`Params::disc`].
    pub disc: f32,
    /// Samples per hint, all maps together.
    pub samples: u32,
    /// Scrambles the sequences.
    pub seed: u32,
}

impl Draw {
    /// Lists of samples that are drawn; see [`INTERLEAVE`].
    #[must_use]
    pub const fn lists(&self, hints: u32) -> u32 {
        match self.sampling {
            Sampling::Importance | Sampling::Nearby => INTERLEAVE * INTERLEAVE * INTERLEAVE,
            Sampling::Disc => hints,
        }
    }

    /// Nodes along each side of either level of the window of a hint, [`Sampling::Nearby`]: an even number, 4 for 60
    /// samples; 0 for other samplings and for fewer than 12 samples.
    #[must_use]
    pub const fn side(&self) -> u32 {
        match self.sampling {
            Sampling::Nearby => 2 * (self.samples / 12).isqrt(),
            Sampling::Importance | Sampling::Disc => 0,
        }
    }

    /// Samples in the window of a hint: one for each node of the fine level and of what the coarse one has around it.
    #[must_use]
    pub const fn near(&self) -> u32 {
        let side = self.side();
        2 * side * side - side * side / 4
    }
}
