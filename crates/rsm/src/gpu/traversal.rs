use core::ops::Range;

use bytemuck::{Pod, Zeroable};

use crate::Form;

indirect_core::wgsl_struct! {
    /// Which branches a dispatch of `traverse` (`RSM_TRAVERSE`) walks, and how. The dispatch has a thread for every
    /// four receivers and binds `branches`, `positions`, `normals`, `receiver_count` (`array<u32>`), `irradiance` and
    /// `cuts` (one `u32` per [`TILE`](crate::TILE)), with `traversal` as a uniform.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    pub struct Traversal = "Traversal" {
        /// The first branch of the part that is bound, among all; a part that begins at 0 starts the sums, the others
        /// add to them.
        pub first: u32,
        /// The branch past its end.
        pub end: u32,
        /// See [`Form::area_scale`].
        pub area_scale: f32,
        /// Fills the row.
        pub pad0: u32,
    }
}

impl Traversal {
    /// A walk through a range of branches.
    #[must_use]
    pub const fn new(branches: Range<u32>, form: Form) -> Self {
        Self { first: branches.start, end: branches.end, area_scale: form.area_scale(), pad0: 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Branch, TILE};
    use indirect_gpu::shaders::RSM_TRAVERSE;
    use testkit::layout::{check, check_constant};

    #[test]
    fn structs_and_tile_are_those_of_the_shader() {
        check::<Traversal>(&RSM_TRAVERSE).unwrap();
        check::<Branch>(&RSM_TRAVERSE).unwrap();
        check_constant(&RSM_TRAVERSE, "TILE", TILE as u32).unwrap();
    }
}
