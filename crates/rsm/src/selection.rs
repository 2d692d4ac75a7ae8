use glam::Vec2;

/// Which texels of the maps become virtual point lights (VPLs).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Selection {
    /// Every texel that reflects light. The gather then converges to unoccluded one-bounce transport as the resolution
    /// grows; cost grows with its square. For ground truth, not for frames.
    All,
    /// `cells × cells` cells per map, each a VPL with the whole flux and area of its cell at the cell's most central
    /// reflecting texel. No noise; light from small bright regions lands at the wrong place by up to half a cell.
    Grid {
        /// Cells along each side of each map, `1..=resolution` (more are cut down to the resolution).
        cells: u32,
    },
    /// `count` texels over all maps together, drawn in proportion to the luminance of their reflected flux by hierarchical
    /// warping of a low-discrepancy sequence: every VPL carries the same luminance, and their sum is that of the maps.
    Importance {
        /// Number of VPLs, at least 1. Higher: less noise, cost grows in proportion.
        count: u32,
    },
}

impl Selection {
    /// Slots, one VPL each, that this selection needs for `maps` maps of `resolution²` texels.
    #[must_use]
    pub fn slot_count(self, maps: usize, resolution: u32) -> usize {
        let square = |n: u32| n as usize * n as usize;
        match self {
            Self::All => maps * square(resolution),
            Self::Grid { cells } => maps * square(cells.min(resolution)),
            Self::Importance { count } => count as usize,
        }
    }

    /// The points in `[0, 1)²` that [`Selection::Importance`] warps, one per slot: an Owen-scrambled Sobol' sequence. Empty
    /// for the other selections.
    #[must_use]
    pub fn points(self, seed: u32) -> Vec<Vec2> {
        match self {
            Self::Importance { count } => {
                (0..count).map(|i| indirect_sampling::sobol::sample_2d(i, seed)).collect()
            }
            Self::All | Self::Grid { .. } => Vec::new(),
        }
    }
}

indirect_core::choice! {
    /// What the factor between a VPL and a receiver divides by.
    pub enum Form {
        /// A VPL is a small disc of its footprint's area: `cosθ_i cosθ_j / (π d² + A)`. Bounded; the default.
        #[default]
        Disc = "disc",
        /// A VPL is a point: `cosθ_i cosθ_j / (π d²)`. Bright spots where a receiver is near; kept as the form the literature
        /// starts from, and as the limit of small footprints.
        Point = "point",
    }
}

impl Form {
    /// What the kernel multiplies a VPL's area by.
    #[must_use]
    pub const fn area_scale(self) -> f32 {
        match self {
            Self::Disc => 1.0,
            Self::Point => 0.0,
        }
    }
}

indirect_core::choice! {
    /// The name of a [`Selection`], as a setting.
    pub enum Select {
        /// [`Selection::Importance`].
        #[default]
        Importance = "importance",
        /// [`Selection::Grid`].
        Grid = "grid",
        /// [`Selection::All`].
        All = "all",
    }
}

impl Select {
    /// The selection with the number of its VPLs, of which only one counts.
    #[must_use]
    pub const fn with(self, count: u32, cells: u32) -> Selection {
        match self {
            Self::Importance => Selection::Importance { count },
            Self::Grid => Selection::Grid { cells },
            Self::All => Selection::All,
        }
    }
}

indirect_core::choice! {
    /// What decides that lights are too coarse a group for a receiver to be taken for one.
    pub enum Bound {
        /// The error of taking them for one light: `Φ/(πd²) · (r²/d² + versine)`, where `r` is their radius and the versine that
        /// of their cone of normals, `d` the distance of their mean position. An estimate of the error rather than a bound: a group
        /// that comes nearer than its mean errs more. The default.
        #[default]
        Error = "error",
        /// The light that they send, `Φ/(πd² + A)`: Nichols, Shopf & Wyman 2009, equations 7 and 8, with the reading of
        /// `docs/errata.md`. Splits bright groups that are far or flat as readily as those that need it.
        ContributionAsPrinted = "contribution",
    }
}
