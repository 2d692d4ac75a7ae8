use indirect_core::settings::BadOption;

indirect_core::choice! {
    /// How points are spread over surfaces.
    pub enum Placement {
        /// The scrambled Halton sequence in three dimensions, of which every run is evenly spread: each map draws one run.
        #[default]
        LowDiscrepancy = "low-discrepancy",
        /// Independent random numbers, as Ritschel et al. 2008 place them.
        Random = "random",
    }
}

indirect_core::settings! {
    /// How maps are made.
    pub struct Options {
        /// Points that stand for the whole scene. Higher: maps that share fewer points; time to resolve them grows in
        /// proportion.
        pub points: u32 = 65536, 1..=1 << 24;
        /// Points that are drawn into each map. Higher: fewer holes and finer silhouettes; time grows in proportion.
        pub points_per_map: u32 = 2048, 1..=1 << 20;
        /// Texels along each side of a map, a power of two. Higher: finer silhouettes, more holes; memory grows with its square.
        pub tile: u32 = 32, 8..=256;
        /// Coarser levels from which holes are filled; 0 fills none. Higher: larger holes close, and so do more gaps that are
        /// none.
        pub pull_push: u32 = 0, 0..=4;
        /// Area of a splat over that of the surface it stands for. Higher: fewer holes, wider silhouettes.
        pub overlap: f32 = 2.0, 0.25..=8.0;
        /// How much nearer than a receiver a map's depth must be to shade it, in texels across the line of sight. Higher: fewer
        /// surfaces that shade themselves, more light that leaks in at contacts.
        pub bias: f32 = 0.25, 0.0..=8.0;
        /// How points are spread over surfaces.
        pub placement: Placement = Placement::LowDiscrepancy;
        where Options::relations;
    }
}

impl Options {
    fn relations(&self) -> Result<(), BadOption> {
        if self.tile.is_power_of_two() {
            Ok(())
        } else {
            Err(BadOption::new("tile", self.tile, "a power of two"))
        }
    }
}
