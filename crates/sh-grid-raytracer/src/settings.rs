use indirect_core::settings::BadOption;
pub use indirect_core::settings::Switch;

use crate::directions::MOST_DIRECTIONS;

indirect_core::choice! {
    /// How rays from the cells of the field find what they see.
    pub enum Traverse {
        /// Through the scene's acceleration structure: exact. The default.
        #[default]
        Rays = "rays",
        /// Through the two grids (§3.4.2): time does not depend on the number of triangles, surfaces are as thick as their fine cells.
        Voxels = "voxels",
    }
}

indirect_core::choice! {
    /// How radiance is read from the R-grid.
    pub enum Reconstruct {
        /// Flux over the area that sent it, of the surfaces that face as the one that is seen: exact in the mean for a Lambertian wall of
        /// any slope, seen from anywhere. The default.
        #[default]
        Area = "area",
        /// Flux over the area of the cell's faces, with Gaussian weights, as printed: too dark, by a factor that depends on the slope.
        AsPrinted = "as-printed",
    }
}

indirect_core::choice! {
    /// Which of the 27 cells around a point its light is interpolated from.
    pub enum Weights {
        /// Those on the side that the surface faces, and only if nothing is between. The default.
        #[default]
        Visible = "visible",
        /// Those on the side that the surface faces.
        Side = "side",
        /// All, as printed: light leaks through walls.
        AsPrinted = "as-printed",
    }
}

indirect_core::choice! {
    /// How a pixel gathers its light.
    pub enum Gather {
        /// The field against the cosine, in closed form. The default.
        #[default]
        Closed = "closed",
        /// The field in directions over the hemisphere, as printed (§4.2).
        Samples = "samples",
        /// Rays over the hemisphere, each with one look at the R-grid where it ends: the field is not made.
        Final = "final",
    }
}

indirect_core::settings! {
    /// What is fixed when buffers are made.
    pub struct Options {
        /// Cells of the SH-grid along the scene's longest side; the V-grid has four times as many. Higher: finer light, time and memory
        /// grow with the square.
        pub grid: u32 = 32, 1..=128;
        /// Photons. Higher: less noise in the R-grid.
        pub photons: u32 = 262_144, 1..=1 << 22;
        /// Reflections of a photon that are stored, at most; roulette ends most photons sooner. The paper has 5.
        pub bounces: u32 = 16, 1..=64;
        /// Directions in which each cell of the field looks: N_sh. Higher: less noise; time grows in proportion.
        pub directions: u32 = 400, 6..=MOST_DIRECTIONS;
        /// Bands of the spherical harmonics; 2, 3, 4 have 4, 9, 16 coefficients. The fourth adds nothing to gather=closed.
        pub order: u32 = 3, 2..=4;
        /// How rays from the cells of the field find what they see.
        pub traverse: Traverse = Traverse::Rays;
        /// How radiance is read from the R-grid.
        pub reconstruct: Reconstruct = Reconstruct::Area;
        /// Whether a look reads the level of the R-grid whose faces are as large as what it stands for (§3.4.3): less noise with few
        /// directions, but light spreads to surfaces that are not seen.
        pub footprint: Switch = Switch::Off;
        /// Whether each cell turns its directions: noise that interpolation averages instead of errors that all cells share.
        pub turned: Switch = Switch::On;
        /// Points on the surfaces of a face's area from which it is asked how much of their light gets away from them; 0: all does. Higher:
        /// better told where surfaces lie close to each other.
        pub open_points: u32 = 64, 0..=1024;
        /// How far light must get from a surface to count as leaving its cell, in cells. Higher: what shines into gaps is left out of more
        /// of them.
        pub open_reach: f32 = 1.0, 0.0..=4.0;
        /// Which cells a point's light is interpolated from.
        pub weights: Weights = Weights::Visible;
        /// How a pixel gathers its light.
        pub gather: Gather = Gather::Closed;
        /// Directions of a pixel: N_d with gather=samples, rays with gather=final, and those in which obscurance=on asks for distances.
        pub samples: u32 = 32, 1..=1024;
        /// Whether indirect light is darkened where surfaces are near, as §4.4 has it: not physical, for its looks.
        pub obscurance: Switch = Switch::Off;
        where Options::relations;
    }
}

impl Options {
    fn relations(&self) -> Result<(), BadOption> {
        if self.gather == Gather::Final {
            if self.obscurance.is_on() {
                return Err(BadOption::new(
                    "obscurance",
                    "on",
                    "off with gather=final, which makes no field",
                ));
            }
            if self.traverse == Traverse::Voxels {
                let needed =
                    "rays with gather=final: rays that graze a surface would end in its own fine cells";
                return Err(BadOption::new("traverse", "voxels", needed));
            }
        }
        Ok(())
    }

    /// Photons that are stored at most: three for each that is emitted, which roulette allows in the mean, and what it may be off.
    /// More than that are left out.
    #[must_use]
    pub const fn most_stored(&self) -> u32 {
        3 * self.photons + self.photons / 8 + 4096
    }

    /// Coefficients of a cell.
    #[must_use]
    pub const fn coefficients(&self) -> u32 {
        self.order * self.order
    }

    /// Whether there is a field.
    #[must_use]
    pub fn has_field(&self) -> bool {
        self.gather != Gather::Final
    }

    /// Whether radiance is read as printed.
    #[must_use]
    pub fn is_printed(&self) -> bool {
        self.reconstruct == Reconstruct::AsPrinted
    }
}

indirect_core::settings! {
    /// What may change from frame to frame.
    pub struct Params {
        /// Farthest centre of a cell that a point's light is interpolated from, in cells: r_max of §4.1.
        pub reach: f32 = 1.75, 0.9..=1.75;
        /// Least area of a surface in a cell that its own photons are trusted for, in faces; the rest is filled from the next level.
        pub least_area: f32 = 0.05, 0.0..=10.0;
        /// Distance from which on nothing darkens, in units of the scene's diagonal, obscurance=on: R_max/w_oc.
        pub obscurance_distance: f32 = 0.1, 1e-6..=1e3;
        /// Scrambles photons and directions.
        pub seed: u32 = 0, 0..=u32::MAX;
    }
}
