use indirect_core::{choice, settings};
use rsm::MAX_RESOLUTION;

choice! {
    /// How many spherical harmonics a hint (an irradiance probe) stores per channel.
    pub enum Order {
        /// `l ≤ 1`: 4 coefficients, 48 bytes a hint.
        Two = "2",
        /// `l ≤ 2`: 9 coefficients, 112 bytes a hint; the irradiance of any distant light to within 3 %.
        #[default]
        Three = "3",
    }
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
}

choice! {
    /// Which texels of the maps a hint takes as samples.
    pub enum Sampling {
        /// As [`Sampling::Importance`], but a hint close to a lit surface spends about half of its samples on the texels around
        /// its own projection into the map, one in each node of a window of the map's pyramid (stratified), and the others on
        /// all that lies outside of the window. Keeps 64 bytes for each of [`Draw::near`](crate::Draw::near)
        /// samples of each hint, and 32 more.
        #[default]
        Nearby = "nearby",
        /// Texels of all maps, with a probability in proportion to the luminance of the flux that they reflect: no sample
        /// falls on an unlit texel, several maps share the samples by their power, and a sample drawn with probability `p`
        /// stands for `1/(p·N_s)` texels. Unbiased: the expected sum is that over all texels.
        Importance = "importance",
        /// As printed (§4): in each map, the samples fall evenly into a disc around the hint's own projection, which takes the
        /// share [`Params::disc`] of the map's area; a sample stands for `c·M/N_s` of the `M` texels. Light from outside of the
        /// disc is lost, which for small discs is most of it. Keeps one list of samples per hint: `64·N_s` bytes a hint.
        Disc = "disc",
    }
}

choice! {
    /// What occludes a sample from a hint. The paper's method tests nothing: the first bounce passes through walls.
    pub enum Visibility {
        /// Nothing does.
        Off = "off",
        /// The maps' own depth decides: where the segment passes from before a lit surface to behind it, it is blocked;
        /// where it enters a shadow through its side, it is not. Directions of later bounces ([`Transport::Directions`]) end
        /// there too. Needs no geometry and does not depend on the camera; a wall that no light sees stays open.
        #[default]
        RsmDepth = "rsm-depth",
        /// §8 as printed: each point of the segment that lies behind the camera's depth halves the sample's light. Depends on
        /// the camera.
        CameraDepth = "camera-depth",
    }
}

choice! {
    /// How light goes from hint to hint in the second and later bounces.
    pub enum Transport {
        /// Directions uniform over the sphere, each followed to the border of the lattice's box, where indoors the walls
        /// are. Each direction has the same weight, however near the hint is to a wall.
        #[default]
        Directions = "directions",
        /// The paper's points, uniform in a ball of the radius [`Params::range`], with the weighted mean that eq. 8 and 9
        /// intend, the bounces added up as a Neumann series, and the hints' albedo. Only points within the lattice count:
        /// near a wall all light comes from one side.
        Sphere = "sphere",
        /// Eq. 8 to 10 as printed: weights that are normalised twice (too dark by about `1/N_b`), the running total as
        /// source of the next bounce, and white reflectance.
        SphereAsPrinted = "sphere-as-printed",
    }
}

choice! {
    /// Where the albedo of what surrounds the lattice's box comes from, for [`Transport::Directions`].
    pub enum Surround {
        /// Rays, once per scene: see [`Enclosure`](crate::Enclosure).
        #[default]
        Measured = "measured",
        /// The maps alone: every side counts as a wall of the lit surfaces' mean albedo, and later bounces are too bright
        /// where a side is open or what no light reaches is darker.
        Maps = "maps",
    }
}

choice! {
    /// Where a pixel reads the field.
    pub enum Reconstruction {
        /// Close to the surface and once farther away, only from hints in front of its plane, extrapolated to the surface:
        /// hints half a cell away receive other light than the surface.
        #[default]
        NearSurface = "near-surface",
        /// §5: on a hemisphere whose radius is the diagonal of a cell, lifted by half of that: half a diagonal to one and a
        /// half away from the surface, whatever the hints there are.
        AsPrinted = "as-printed",
    }
}

choice! {
    /// Resolution at which the field is read.
    pub enum Scale {
        /// At every pixel.
        #[default]
        Full = "full",
        /// At one of 2 × 2 pixels, upsampled by depth and normal.
        Half = "half",
        /// At one of 4 × 4 pixels, upsampled by depth and normal.
        Quarter = "quarter",
    }
}

impl Scale {
    /// Pixels per texel of the smaller image, along each side.
    #[must_use]
    pub const fn step(self) -> u32 {
        match self {
            Self::Full => 1,
            Self::Half => 2,
            Self::Quarter => 4,
        }
    }
}

settings! {
    /// What is fixed when buffers are made; what is not asked for is not allocated.
    pub struct Options {
        /// Texels along each side of each map. Higher: finer, time and memory grow with the square.
        pub resolution: u32 = 512, 1..=MAX_RESOLUTION;
        /// Cube root of the most hints; the scene's extents share them out. Higher: finer, time grows with the cube.
        pub lattice: u32 = 16, 1..=128;
        /// 2: 4 coefficients a hint and channel; 3: 9, sharper in direction.
        pub order: Order = Order::Three;
        /// Samples of all maps together per hint; the paper's 12 to 70. Higher: less noise, time grows in proportion.
        pub samples: u32 = 60, 1..=1024;
        /// Texels by the flux they reflect, those near a hint stratified or not; or as printed: a disc around its projection.
        pub sampling: Sampling = Sampling::Nearby;
        /// What blocks light: nothing as printed; the maps' depth, in all bounces; the camera's in the first (view-dependent).
        pub visibility: Visibility = Visibility::RsmDepth;
        /// Indirect bounces; 1 allocates no second volume.
        pub bounces: u32 = 3, 1..=64;
        /// Samples of the field per hint and later bounce; the paper's 16 to 32. Higher: less noise, time grows in proportion.
        pub bounce_samples: u32 = 32, 1..=1024;
        /// Later bounces: uniform directions to the border, or points in a ball, corrected or as printed.
        pub transport: Transport = Transport::Directions;
        /// Albedo around the box: by 2048 rays once per scene, or what the maps alone tell.
        pub enclosure: Surround = Surround::Measured;
        /// Resolution at which pixels read the field; the rest is upsampled by depth and normal.
        pub scale: Scale = Scale::Full;
        /// Share of the past in a frame, reprojected; the paper's is 0.5. Higher: calmer, slower to follow.
        pub smoothing: f32 = 0.0, 0.0..=0.95;
    }
}

impl Options {
    /// Words per hint of the visibility test, which takes four bits for each sample; 0 without one.
    #[must_use]
    pub const fn blocked_words(&self) -> u32 {
        match self.visibility {
            Visibility::Off => 0,
            Visibility::RsmDepth | Visibility::CameraDepth => words_of_samples(self.samples),
        }
    }

    /// Words per hint of the stops of later bounces' directions, eight bits each; 0 where nothing is tested or there are none.
    #[must_use]
    pub const fn stop_words(&self) -> u32 {
        match (self.visibility, self.transport) {
            (Visibility::RsmDepth, Transport::Directions) if self.bounces > 1 => {
                words_of_stops(self.bounce_samples)
            }
            _ => 0,
        }
    }
}

/// Four bits for each of so many samples of a hint.
pub(crate) const fn words_of_samples(samples: u32) -> u32 {
    samples.div_ceil(8)
}

/// Eight bits for each of so many directions of a hint.
pub(crate) const fn words_of_stops(directions: u32) -> u32 {
    directions.div_ceil(4)
}

settings! {
    /// What may change from frame to frame.
    pub struct Params {
        /// Share of the map that the disc takes (c_RSM) with sampling=disc: 0.05 to 0.15 outdoors, up to 0.9 indoors.
        pub disc: f32 = 0.9, 0.001..=1.0;
        /// Farthest that a later bounce comes from, as a share of the box's diagonal: the paper's r_max.
        pub range: f32 = 1.0, 0.01..=1.0;
        /// Share of its cell within which a hint's points of view are spread; 1 is the paper's. Lower: sharper, and a hint
        /// beside a wall stays on its side.
        pub jitter: f32 = 0.0, 0.0..=1.0;
        /// Share of a sample's area that bounds 1/d²; 0 is the paper's, unbounded; 1 is too dark in corners.
        pub footprint: f32 = 0.4, 0.0..=1.0;
        /// Where pixels read: extrapolated to their surface, or half to one and a half diagonals of a cell away.
        pub reconstruct: Reconstruction = Reconstruction::NearSurface;
        /// Scrambles the sequences. Another seed: other samples of the same expectation.
        pub seed: u32 = 0, 0..=u32::MAX;
    }
}
