use bytemuck::{Pod, Zeroable};
use indirect_shaders::COMPACT;
use wgpu::{Buffer, Device};

use crate::{GpuError, Named, Pass, Pipelines, Plan, Scan, buffers, named, uniform_buffer};

indirect_core::wgsl_struct! {
    /// Room in the list.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    pub(crate) struct CompactUniform = "Compact" {
        capacity: u32,
    }
}

buffers! {
    /// Buffers of a [`Compact`], by the number of flags.
    pub struct CompactBuffers for u64 {
        /// Where each element goes: its place in the list; at least the list's capacity where there is no room for it, and
        /// [`Compact::NONE`] where its flag is 0.
        destinations: [u32] = |n| *n;
    }
}

/// Appends the flagged of some elements to a list, in order: says where each goes, so that a kernel of the caller moves it where
/// that is below the list's capacity. Twin of [`indirect_core::sort::compact`].
#[derive(Debug, Clone)]
pub struct Compact {
    /// The buffers.
    pub buffers: CompactBuffers,
    scan: Scan,
    compact: Buffer,
}

impl Compact {
    /// The destination of an element whose flag is 0.
    pub const NONE: u32 = u32::MAX;

    /// What it will allocate for `length` flags and a list of up to `capacity` elements; flags, list and count left out.
    #[must_use]
    pub fn plan(length: u64, capacity: u64) -> Plan {
        let mut plan = CompactBuffers::plan(&length).and(Scan::plan(length));
        plan.uniform::<CompactUniform>("compact");
        // Destinations beyond the capacity are still told apart from `NONE`.
        plan.index("destinations", capacity.saturating_add(length));
        plan
    }

    /// For `length` flags and a list of up to `capacity` elements.
    ///
    /// # Errors
    /// [`GpuError::Limit`].
    pub fn new(device: &Device, length: u32, capacity: u32) -> Result<Self, GpuError> {
        Self::plan(length.into(), capacity.into()).check(&device.limits())?;
        Ok(Self {
            buffers: CompactBuffers::new(device, &length.into())?,
            scan: Scan::new(device, length)?,
            compact: uniform_buffer(device, "compact", &CompactUniform { capacity }),
        })
    }

    /// Finds the destinations. `list` binds `flags`, one `u32` each, and `count`, two of them: how many elements the list holds
    /// before, and then with the new ones, at most its capacity; and a number that grows by how many found no room, up to
    /// `u32::MAX`. Where both are 0 at first, several rounds append to each other.
    ///
    /// # Errors
    /// [`GpuError::Unbound`] where one of the names is missing.
    pub fn encode(&self, pipelines: &Pipelines, pass: &mut Pass, list: &[Named<'_>]) -> Result<(), GpuError> {
        let (own, compact) = (self.buffers.named(), [named("compact", &self.compact)]);
        self.scan.encode_with(pipelines, pass, &COMPACT, &[list, &own, &compact])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::layout::{check, check_constant};

    #[test]
    fn structs_and_constants_are_those_of_the_shaders() {
        check::<CompactUniform>(&COMPACT).unwrap();
        check_constant(&COMPACT, "COMPACT_NONE", Compact::NONE).unwrap();
    }
}
