use indirect_core::settings::BadOption;
use rsm::{Bound, Form, MAX_RESOLUTION, Select, Selection};

indirect_core::choice! {
    /// Which lights a fragment gathers.
    pub enum Lights {
        /// Hierarchical image-space radiosity (§3.5): every tile of neighbouring fragments has its own cut through the tree of
        /// patches, as fine as its error bound asks for. The default.
        #[default]
        Hierarchical = "hierarchical",
        /// Basic image-space radiosity (§3.4): the same list for every fragment, made by clustering texels that show no
        /// discontinuity.
        Basic = "basic",
        /// The same list for every fragment, as the plain gather has it: a [`Selection`] of texels.
        Flat = "flat",
    }
}

indirect_core::choice! {
    /// How light gets from lights to fragments.
    pub enum Method {
        /// Each fragment sums its lights. The default.
        #[default]
        Gather = "gather",
        /// Each light is added to every fragment in turn (Nichols & Wyman 2009): the baseline of §4.1.
        Splat = "splat",
        /// Each light is added to the pixels near it, at full resolution (Dachsbacher & Stamminger 2006): the other baseline.
        /// Loses the light beyond the bounds.
        BoundedSplat = "bounded",
    }
}

indirect_core::choice! {
    /// What stands between lights and fragments.
    pub enum Visibility {
        /// Nothing: light passes through everything, as the paper has it. The default.
        #[default]
        Off = "off",
        /// Imperfect shadow maps (Ritschel et al. 2008): depth maps of one coarse level of patches, splatted from points of
        /// the scene.
        Maps = "maps",
    }
}

indirect_core::settings! {
    /// What is fixed when buffers are made.
    pub struct Options {
        /// Texels along each side of each reflective shadow map. Higher: finer footprints; time and memory grow with the square.
        pub resolution: u32 = 256, 1..=MAX_RESOLUTION;
        /// Whether each tile of fragments gathers its own cut, or all one list of clusters, or one list of texels.
        pub lights: Lights = Lights::Hierarchical;
        /// Coarsest patches, at most so many along each side of a map, lights=hierarchical|basic.
        pub coarsest: u32 = 16, 1..=MAX_RESOLUTION;
        /// Finest patches, likewise, no finer than the map; at least coarsest. Higher: more lights, less bias.
        pub finest: u32 = MAX_RESOLUTION, 1..=MAX_RESOLUTION;
        /// Which texels become lights, lights=flat.
        pub select: Select = Select::Grid;
        /// Cells along each side of each map, no more than texels, select=grid. Higher: less bias, time grows with the square.
        pub cells: u32 = 16, 1..=MAX_RESOLUTION;
        /// Lights drawn, all maps together, select=importance. Higher: less noise, time grows in proportion.
        pub vpls: u32 = 1024, 1..=1 << 24;
        /// Coarsest blocks of pixels: 2^block along each side; 0 gathers at every pixel. Higher: fewer fragments.
        pub block: u32 = 6, 0..=8;
        /// How light gets to fragments; the splats are the paper's baselines, lights=flat|basic.
        pub method: Method = Method::Gather;
        /// What stands between lights and fragments. With maps every light of every fragment asks one, which takes three to nine
        /// times as long as without, and the maps are drawn in each frame: so no kind of scene is given them unasked.
        pub visibility: Visibility = Visibility::Off;
        /// Patches that have a shadow map, at most so many along each side of a reflective shadow map, visibility=maps,
        /// lights=hierarchical|basic. Higher: shadows that follow the lights more closely; time and memory grow with the square.
        pub shadow_cells: u32 = 16, 1..=128;
        /// Points that stand for the whole scene, visibility=maps. Higher: shadow maps that share fewer of them.
        pub points: u32 = 65_536, 1..=1 << 24;
        /// Points that are drawn into each shadow map, likewise. Higher: fewer holes and finer silhouettes; time grows in proportion.
        pub points_per_map: u32 = 4096, 1..=1 << 20;
        /// Texels along each side of a shadow map, a power of two, likewise. Higher: finer silhouettes, more holes; memory grows
        /// with its square.
        pub tile: u32 = 64, 8..=256;
        /// Area of what a point draws over that of the surface it stands for, likewise. Higher: fewer holes, and silhouettes that
        /// are wider and darken.
        pub overlap: f32 = 1.0, 0.25..=8.0;
        where Options::relations;
    }
}

impl Options {
    fn relations(&self) -> Result<(), BadOption> {
        if self.finest < self.coarsest {
            return Err(BadOption::new("finest", self.finest, "at least coarsest"));
        }
        if self.method != Method::Gather && self.lights == Lights::Hierarchical {
            return Err(BadOption::new("method", self.method.word(), "gather with lights=hierarchical"));
        }
        if self.visibility == Visibility::Maps {
            if self.method != Method::Gather {
                return Err(BadOption::new(
                    "visibility",
                    self.visibility.word(),
                    "off with method=splat|bounded",
                ));
            }
            if !self.tile.is_power_of_two() {
                return Err(BadOption::new("tile", self.tile, "a power of two"));
            }
        }
        Ok(())
    }

    /// Whether shadow maps are made.
    #[must_use]
    pub fn has_shadows(&self) -> bool {
        self.visibility == Visibility::Maps
    }

    /// How they are made.
    #[must_use]
    pub fn shadow_maps(&self) -> imperfect_shadow_maps::Options {
        let Self { points, points_per_map, tile, overlap, .. } = *self;
        imperfect_shadow_maps::Options { points, points_per_map, tile, overlap, ..Default::default() }
    }

    /// Whether fragments walk a tree, and do not sum a list: each branch says whom to ask for what stands in between.
    #[must_use]
    pub fn has_tree(&self) -> bool {
        self.lights == Lights::Hierarchical || self.has_shadows()
    }

    /// Whether the clusters of [`Lights::Basic`] are made a list; a walk finds them by itself.
    #[must_use]
    pub fn has_clusters(&self) -> bool {
        self.lights == Lights::Basic && !self.has_shadows()
    }

    /// Whether lights are a list.
    #[must_use]
    pub fn has_list(&self) -> bool {
        self.lights == Lights::Flat || self.has_clusters()
    }

    /// Which texels become lights with [`Lights::Flat`].
    #[must_use]
    pub const fn selection(&self) -> Selection {
        self.select.with(self.vpls, self.cells)
    }

    /// Whether patches are needed: as lights, or for the reference irradiance.
    #[must_use]
    pub fn has_patches(&self) -> bool {
        self.lights != Lights::Flat || self.method == Method::BoundedSplat || self.block > 0
    }

    /// Whether light is gathered at fragments, and not splatted onto pixels.
    #[must_use]
    pub fn has_fragments(&self) -> bool {
        self.method != Method::BoundedSplat
    }

    /// Whether the maps' own pyramids are needed: lights are drawn from them by importance.
    #[must_use]
    pub fn has_pyramids(&self) -> bool {
        self.lights == Lights::Flat && self.select == Select::Importance
    }
}

indirect_core::settings! {
    /// What may change from frame to frame. No threshold has a unit; one of 0 subdivides everywhere.
    pub struct Params {
        /// Share of the reference irradiance that the error of a patch may reach before it is subdivided, lights=hierarchical.
        /// Higher: fewer lights per fragment, less exact; 0 gathers the finest patches.
        pub tau: f32 = 0.003, 0.0..=1e6;
        /// What tau bounds: the error of taking a patch for one light, or the light that it sends, as the paper prints it.
        pub bound: Bound = Bound::Error;
        /// Distance of a patch's texels from its plane, in its radii, from which on it is subdivided, lights=basic. Higher: fewer
        /// lights, less exact.
        pub patch_depth: f32 = 0.2, 0.0..=1e6;
        /// Half angle of its cone of normals, radians, likewise.
        pub patch_normal: f32 = 0.3, 0.0..=10.0;
        /// Depth range of a block of pixels, relative to its greatest depth, from which on it is subdivided. Higher: fewer
        /// fragments, less exact.
        pub depth: f32 = 0.05, 0.0..=1e6;
        /// Half angle of its cone of normals, radians, likewise.
        pub normal: f32 = 0.3, 0.0..=10.0;
        /// Distance to a concave edge, in radii of a block, within which it is subdivided: irradiance varies fast there. Higher: more
        /// fragments, more exact; 0 looks at the block alone, as the paper does.
        pub margin: f32 = 3.0, 0.0..=1e6;
        /// Second difference of the irradiance across a block, as a share of the reference irradiance, from which on it is
        /// subdivided: Σ Φ/(πD) · r²/D over the coarsest lights, where r is the block's radius and D the squared distance of a
        /// light plus the square of its radius. Higher: fewer fragments, less exact; 1e9 is the paper's behaviour, whose blocks do
        /// not know where light comes from.
        pub bend: f32 = 0.003, 0.0..=1e9;
        /// Share of the reference irradiance at which a bounded splat ends, method=bounded. Higher: faster and darker.
        pub cutoff: f32 = 0.01, 1e-9..=1e6;
        /// A light is a small disc (bounded) or a point (bright spots near it).
        pub form: Form = Form::Disc;
        /// Scrambles the sequence that select=importance draws with, and where in their patches shadow maps stand. Another seed: other
        /// lights and shadows of the same expectation.
        pub seed: u32 = 0, 0..=u32::MAX;
    }
}

/// When a block or a patch holds a discontinuity. Both measures are free of units; a threshold of 0 finds one everywhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thresholds {
    /// For blocks, the depth range relative to the greatest depth; for patches, the distance from their plane relative to
    /// their radius. `[0, ∞)`; higher: fewer, larger, less exact.
    pub depth: f32,
    /// `1 − cos` of the half angle of the cone of normals, `[0, 2]`; likewise.
    pub versine: f32,
}

impl Thresholds {
    /// From the relative depth and the half angle, radians, `[0, π]`; more counts as π.
    #[must_use]
    pub fn new(depth: f32, normal: f32) -> Self {
        // Without the cancellation of 1 − cos.
        let s = (0.5 * normal.min(core::f32::consts::PI)).sin();
        Self { depth, versine: 2.0 * s * s }
    }
}

impl Params {
    /// When a block is subdivided.
    #[must_use]
    pub fn blocks(&self) -> Thresholds {
        Thresholds::new(self.depth, self.normal)
    }

    /// When [`Lights::Basic`] subdivides a patch.
    #[must_use]
    pub fn patches(&self) -> Thresholds {
        Thresholds::new(self.patch_depth, self.patch_normal)
    }
}
