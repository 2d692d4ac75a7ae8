use rsm::{Form, MAX_RESOLUTION, Select, Selection};

indirect_core::settings! {
    /// What is fixed when buffers are made.
    pub struct Options {
        /// Texels along each side of each map. Higher: finer footprints, smaller silhouette errors; time and memory grow with its
        /// square (156 bytes per texel on the GPU). A point light makes six maps.
        pub resolution: u32 = 512, 1..=MAX_RESOLUTION;
        /// Which texels become virtual point lights.
        pub select: Select = Select::Importance;
        /// Lights drawn with select=importance, all maps together. Higher: less noise, time grows in proportion.
        pub vpls: u32 = 1024, 1..=1 << 24;
        /// Cells along each side of each map with select=grid, no more than texels. Higher: less bias, time grows with the square.
        pub cells: u32 = 32, 1..=MAX_RESOLUTION;
    }
}

impl Options {
    /// Which texels become virtual point lights.
    #[must_use]
    pub const fn selection(&self) -> Selection {
        self.select.with(self.vpls, self.cells)
    }
}

indirect_core::settings! {
    /// What may change from frame to frame.
    pub struct Params {
        /// A light is a small disc (bounded) or a point (bright spots near it).
        pub form: Form = Form::Disc;
        /// Scrambles the sequence that select=importance draws with. Another seed: other lights of the same expectation.
        pub seed: u32 = 0, 0..=u32::MAX;
    }
}

/// All settings.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Setup {
    /// Fixed.
    pub options: Options,
    /// Per frame.
    pub params: Params,
}
