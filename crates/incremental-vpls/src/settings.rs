//! How many lights, and how many of them are new in each frame.

use indirect_core::settings::BadOption;

indirect_core::choice! {
    /// How a spot's directions are laid onto the disc in which its lights are spread evenly.
    pub enum Density {
        /// In proportion to intensity: equal areas of the disc carry equal flux, as in the paper, whose spots have a
        /// cosine falloff. The default: every light carries about the same.
        #[default]
        Flux = "flux",
        /// In proportion to solid angle: more lights where a spot fades out, each of which carries less.
        SolidAngle = "solid-angle",
    }
}

indirect_core::choice! {
    /// Where lights go when none is kept: in the first frame, after a rebuild, after a jump of the light.
    pub enum Start {
        /// One by one into the largest empty circle, as later ones do. The default: the most even.
        #[default]
        Dispersion = "dispersion",
        /// At an Owen-scrambled Sobol' sequence: faster, less even.
        Sequence = "sequence",
    }
}

indirect_core::settings! {
    /// Settings of a [`State`](crate::State).
    pub struct Settings {
        /// Directions in which lights are kept; those that meet a surface are lights. Higher: less error, time grows
        /// in proportion.
        pub count: u32 = 256, 1..=4096;
        /// Lights that are made anew in every frame, at least: where all are valid, as many go from where they are
        /// densest. Higher: a more even spread after a movement, fewer lights kept.
        pub recalc_min: u32 = 4, 0..=4096;
        /// Lights that are made anew in a frame, at most, unless none is left. Higher: a faster recovery from a quick
        /// movement, longer frames.
        pub recalc_max: u32 = 32, 1..=4096;
        /// Two lights are too close where their distance, in the domain of the light's directions, is less than this
        /// share of √(area/count): then one of them goes, as long as no more than recalc_max are new. Higher: a more
        /// even spread, fewer lights kept. 0 leaves only what recalc_min asks for, as in the paper.
        pub evenness: f32 = 0.5, 0.0..=0.7;
        /// Seed of the sequence, and of the first light.
        pub seed: u32 = 0, 0..=4_294_967_295;
        /// Layout of a spot's disc.
        pub density: Density = Density::Flux;
        /// Where lights go when none is kept.
        pub start: Start = Start::Dispersion;
        where |s| if s.recalc_min > s.recalc_max {
            Err(BadOption::new("recalc_min", s.recalc_min, "at most recalc_max"))
        } else {
            Ok(())
        };
    }
}
