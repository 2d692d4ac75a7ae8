use imperfect_shadow_maps::Placement;
pub use indirect_core::settings::Switch;
use indirect_core::settings::{BadOption, Settings as _};
use rsm::{MAX_RESOLUTION, TreeLayout};

indirect_core::choice! {
    /// What stands between a virtual light and a receiver.
    pub enum Visibility {
        /// Rays through the scene's acceleration structure: exact. The default.
        #[default]
        Rays = "rays",
        /// Imperfect shadow maps (Ritschel et al. 2008): a depth map per virtual light, splatted from points of the scene.
        Maps = "maps",
        /// Nothing: light passes through everything.
        Off = "off",
    }
}

indirect_core::choice! {
    /// How the virtual lights of the next bounce are found.
    pub enum Bounce {
        /// Each virtual light sends one ray; what it meets is the next one and carries all its light, times the albedo. The default.
        #[default]
        Rays = "rays",
        /// Each virtual light lights its own points of the scene; one of them, drawn in proportion to what it reflects by a
        /// reservoir, is the next and carries what all of them reflect (thesis §3.6, with the selection of `docs/errata.md`).
        Points = "points",
        /// The brightest of its points is the next and carries its own light alone, as the thesis prints it. Neither its energy
        /// nor its place is right in the mean.
        Brightest = "brightest",
    }
}

indirect_core::choice! {
    /// Which virtual lights a pixel gathers.
    pub enum Gather {
        /// Another part of them at each pixel of a block (Keller & Heidrich 2001). The default.
        #[default]
        Interleaved = "interleaved",
        /// For each tile of 4×2 pixels its own cut through a tree over all of them (Walter et al. 2005): time hardly grows with their
        /// number.
        Cuts = "cuts",
    }
}

indirect_core::choice! {
    /// The points at which lights' maps are sampled.
    pub enum Sequence {
        /// Owen-scrambled Sobol'. The default.
        #[default]
        Sobol = "sobol",
        /// Halton in the bases 2 and 3, shifted by the seed, as the thesis has it.
        Halton = "halton",
    }
}

/// Virtual lights that a pixel asks at most: software renderers end a shader's loops after 65 535 rounds.
const MOST_PER_PIXEL: u32 = 16_384;

/// Parts of the lights that the end of a path is lit by at most.
const PATH_PARTS: u32 = 8;

/// Shadow rays where a path ends, where pixels ask all their lights.
const PATH_TESTS: u32 = 16;

indirect_core::settings! {
    /// What is fixed when buffers are made.
    pub struct Options {
        /// Texels along each side of each reflective shadow map. Higher: finer footprints; time and memory grow with the square.
        pub resolution: u32 = 128, 1..=MAX_RESOLUTION;
        /// Virtual lights of each bounce, rounded up to a multiple of interleave². Higher: less noise, time grows in proportion.
        pub vpls: u32 = 1024, 1..=1 << 16;
        /// Bounces, of which the virtual lights are kept. Higher: more of the light that was reflected often; time grows in proportion.
        pub bounces: u32 = 4, 1..=16;
        /// Whether the last bounce also stands for all that would follow, as if each kept the share that the last one kept.
        pub tail: Switch = Switch::On;
        /// What stands between a virtual light and a receiver.
        pub visibility: Visibility = Visibility::Rays;
        /// Shadow rays per pixel, to as many of its virtual lights, drawn in proportion to what they would give; 0 asks all,
        /// visibility=rays. Higher: less noise, more time. With gather=cuts the GPU takes 1 to 64.
        pub shadow_rays: u32 = 8, 0..=1 << 16;
        /// Which virtual lights a pixel gathers. With cuts interleave² only says which pixels are averaged, and into how many parts the
        /// lights are shared out for paths.
        pub gather: Gather = Gather::Interleaved;
        /// How the virtual lights of the next bounce are found.
        pub bounce: Bounce = Bounce::Rays;
        /// Pixels along each side of a block in which each pixel takes another part of the virtual lights; 1: all take all. Higher:
        /// less time, details of the light are blurred over the block.
        pub interleave: u32 = 8, 1..=8;
        /// Whether paths carry the light that virtual lights are bounded by near surfaces: exact in corners, one more ray per pixel.
        pub compensate: Switch = Switch::On;
        /// Points that stand for the whole scene, visibility=maps or bounce=points|brightest. Higher: shadow maps that share fewer of them.
        pub points: u32 = 65_536, 1..=1 << 24;
        /// Points that are drawn into each shadow map, or lit by each virtual light, likewise. Higher: fewer holes and finer silhouettes;
        /// time grows in proportion.
        pub points_per_map: u32 = 1024, 1..=1 << 16;
        /// Texels along each side of a shadow map, a power of two, visibility=maps. Higher: finer silhouettes, more holes; memory grows
        /// with its square.
        pub tile: u32 = 32, 8..=256;
        /// Coarser levels from which the holes of shadow maps are filled, visibility=maps; 0 fills none. Higher: larger holes close, and
        /// so do more gaps that are none.
        pub pull_push: u32 = 0, 0..=4;
        /// How points are spread over surfaces.
        pub placement: Placement = Placement::LowDiscrepancy;
        /// Whether frames reuse what the frame before computed.
        pub history: Switch = Switch::On;
        /// Whether the movement of vertices is followed into the frame before; without, a moved surface has no past.
        pub motion: Switch = Switch::Off;
        /// The points at which lights' maps are sampled.
        pub sequence: Sequence = Sequence::Sobol;
        where Options::relations;
    }
}

impl Options {
    fn relations(&self) -> Result<(), BadOption> {
        let each = self.per_bounce() / self.parts() * self.bounces;
        // Paths ask a part of them even where pixels gather cuts.
        if each > MOST_PER_PIXEL && (!self.has_cuts() || self.compensate.is_on()) {
            let needed = "at most 16384 · interleave² / bounces: a pixel asks its part of them one by one";
            return Err(BadOption::new("vpls", self.vpls, needed));
        }
        if self.has_cuts()
            && u64::from(self.per_bounce()) * u64::from(self.bounces) > TreeLayout::MAX_LIGHTS.into()
        {
            return Err(BadOption::new("vpls", self.vpls, "at most 2²⁰ / bounces with gather=cuts"));
        }
        self.shadow_maps().validate()
    }

    /// Parts of the lights that the end of a path is lit by: fewer where a part has many lights.
    #[must_use]
    pub const fn path_parts(&self) -> u32 {
        let each = self.per_bounce() / self.parts() * self.bounces;
        let affordable = if each < MOST_PER_PIXEL / 2 { MOST_PER_PIXEL / 2 / each } else { 1 };
        let most = if affordable < PATH_PARTS { affordable } else { PATH_PARTS };
        if most < self.parts() { most } else { self.parts() }
    }

    /// How shadow maps are made.
    #[must_use]
    pub fn shadow_maps(&self) -> imperfect_shadow_maps::Options {
        let Self { points, points_per_map, tile, pull_push, placement, .. } = *self;
        imperfect_shadow_maps::Options {
            points,
            points_per_map,
            tile,
            pull_push,
            placement,
            ..Default::default()
        }
    }

    /// Whether the scene is sampled by points.
    #[must_use]
    pub fn has_points(&self) -> bool {
        self.visibility == Visibility::Maps || self.bounce != Bounce::Rays && self.bounces > 1
    }

    /// Whether pixels gather cuts through a tree.
    #[must_use]
    pub fn has_cuts(&self) -> bool {
        self.gather == Gather::Cuts
    }

    /// Whether what a frame computed serves the next.
    #[must_use]
    pub const fn has_history(&self) -> bool {
        self.history.is_on()
    }

    /// Shadow tests per receiver and range of lights; 0: all lights are tested.
    #[must_use]
    pub fn tests(&self) -> u32 {
        if self.visibility == Visibility::Rays { self.shadow_rays } else { 0 }
    }

    /// Shadow tests where a path ends that carries what bounding removes, for each of its parts; 0: all.
    #[must_use]
    pub fn path_tests(&self) -> u32 {
        let rays = if self.shadow_rays == 0 { PATH_TESTS } else { self.shadow_rays };
        if self.visibility == Visibility::Rays { rays.div_ceil(self.path_parts()) } else { 0 }
    }

    /// Parts into which virtual lights are shared out among the pixels of a block: interleave².
    #[must_use]
    pub const fn parts(&self) -> u32 {
        self.interleave * self.interleave
    }

    /// Virtual lights of each bounce: [`Self::vpls`], rounded up to a multiple of [`Self::parts`].
    #[must_use]
    pub const fn per_bounce(&self) -> u32 {
        self.vpls.div_ceil(self.parts()) * self.parts()
    }

    /// Virtual lights of all bounces.
    #[must_use]
    pub const fn slots(&self) -> u32 {
        self.per_bounce() * self.bounces
    }
}

indirect_core::settings! {
    /// What may change from frame to frame.
    pub struct Params {
        /// Area, in units of the mean area that a virtual light stands for, that bounds its light near by: Φ cosθ cosθ'/(π d² + A).
        /// Higher: smoother; darker corners without compensate.
        pub bound: f32 = 1.0, 0.0..=1e6;
        /// Error of a branch of a cut at which it is split, as a share of the mean irradiance, gather=cuts. Higher: shorter cuts, coarser
        /// light; 0: every light, up to 8192 of them.
        pub tau: f32 = 0.01, 0.0..=1e3;
        /// Share of the past where nothing changed: c_Base of equation 3.4. Higher: smoother, slower to follow.
        pub confidence: f32 = 0.9, 0.0..=0.999;
        /// How much a pixel's way lowers the confidence: w_pos of equation 3.1, with the way in image widths and depth relative to itself.
        pub moved: f32 = 1.0, 0.0..=1e6;
        /// Paths that carry what the bound removes, in units of those that carry all of it when they go on: each then carries its share.
        /// Higher: less noise in corners, more time.
        pub paths: f32 = 4.0, 1.0..=64.0;
        /// How much a turned normal lowers it: w_normal of equation 3.2.
        pub turned: f32 = 2.0, 0.0..=1e6;
        /// How much changed light lowers it: w_illumination of equation 3.3, with the change relative to the light. 0: not at all, no
        /// flicker, but light that is switched off fades slowly.
        pub changed: f32 = 3.0, 0.0..=1e6;
        /// Standard errors of the present frame, estimated from the pixels of its blocks, that the past may be off before it is brought
        /// back to that. Higher: smoother, slower to follow; 0: never, as the thesis has it.
        pub outliers: f32 = 3.0, 0.0..=1e6;
        /// Distance of a neighbour from the pixel's plane, relative to the depth, from which on it is left out of the box filter: α.
        pub depth: f32 = 0.01, 0.0..=1e6;
        /// Least cosine between normals, below which a neighbour is left out: β.
        pub normal: f32 = 0.8, -1.0..=1.0;
        /// Scrambles the sequences. Another seed: other virtual lights of the same expectation.
        pub seed: u32 = 0, 0..=u32::MAX;
    }
}
