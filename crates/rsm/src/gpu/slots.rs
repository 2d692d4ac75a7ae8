use bytemuck::{Pod, Zeroable};
use glam::Vec2;
use indirect_gpu::shaders::RSM_VPLS;
use indirect_gpu::wgpu::{Buffer, Device, Queue};
use indirect_gpu::{GpuError, Pass, Pipelines, Plan, buffers, named, uniform_buffer};

use super::Maps;
use crate::{Selection, Vpl};

indirect_core::wgsl_struct! {
    /// One map among all, and the slots it fills.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    pub(crate) struct SelectionUniform = "Selection" {
        pub(crate) resolution: u32,
        pub(crate) map: u32,
        pub(crate) maps: u32,
        pub(crate) first_slot: u32,
        pub(crate) slots: u32,
        pub(crate) cells: u32,
        pub(crate) pad0: u32,
        pub(crate) pad1: u32,
    }
}

/// What the lengths of [`SlotBuffers`] follow from.
#[derive(Debug, Clone, Copy)]
pub struct SlotSizes {
    slots: u64,
    points: u64,
}

impl SlotSizes {
    fn new(selection: Selection, resolution: u32, maps: usize) -> Self {
        let slots = selection.slot_count(maps, resolution) as u64;
        Self { slots, points: if matches!(selection, Selection::Importance { .. }) { slots } else { 0 } }
    }
}

buffers! {
    /// Buffers of [`VplSlots`].
    pub struct SlotBuffers for SlotSizes {
        /// One per slot of the selection.
        slots: [Vpl] = |s| s.slots;
        /// The sequence that [`Selection::Importance`] warps.
        points: [[f32; 2]] = |s| s.points;
    }
}

/// `vpls`: one VPL or none per slot of a selection, drawn from the maps.
#[derive(Debug, Clone)]
pub struct VplSlots {
    /// The buffers.
    pub buffers: SlotBuffers,
    selection: Selection,
    count: u32,
    uniforms: Vec<Buffer>,
}

impl VplSlots {
    /// What a selection from `maps` maps of `resolution`² texels will allocate.
    #[must_use]
    pub fn plan(selection: Selection, resolution: u32, maps: usize) -> Plan {
        let sizes = SlotSizes::new(selection, resolution, maps);
        let mut plan = SlotBuffers::plan(&sizes);
        plan.index("slots", sizes.slots);
        (0..maps).for_each(|_| plan.uniform::<SelectionUniform>("selection"));
        plan
    }

    /// Buffers for it.
    ///
    /// # Errors
    /// [`GpuError::Limit`].
    pub fn new(
        device: &Device,
        selection: Selection,
        resolution: u32,
        maps: usize,
    ) -> Result<Self, GpuError> {
        Self::plan(selection, resolution, maps).check(&device.limits())?;
        let sizes = SlotSizes::new(selection, resolution, maps);
        let (count, all) = (sizes.slots as u32, maps as u32);
        let uniform = |map: u32| {
            let per_map = count / all;
            let (first_slot, slots, cells) = match selection {
                Selection::All => (map * per_map, per_map, 0),
                Selection::Grid { cells } => (map * per_map, per_map, cells.min(resolution)),
                Selection::Importance { count } => (0, count, 0),
            };
            let value =
                SelectionUniform { resolution, map, maps: all, first_slot, slots, cells, pad0: 0, pad1: 0 };
            uniform_buffer(device, "selection", &value)
        };
        let buffers = SlotBuffers::new(device, &sizes)?;
        Ok(Self { buffers, selection, count, uniforms: (0..all).map(uniform).collect() })
    }

    /// Number of slots.
    #[must_use]
    pub const fn count(&self) -> u32 {
        self.count
    }

    /// Sets the seed of the sequence.
    pub fn prepare(&self, queue: &Queue, seed: u32) {
        self.write_points(queue, &self.selection.points(seed));
    }

    /// Sets the points in `[0, 1)²` that [`Selection::Importance`] warps, one per slot, for callers with a sequence of their own; those
    /// beyond [`Self::count`] are left out.
    pub fn write_points(&self, queue: &Queue, points: &[Vec2]) {
        let points = &points[..points.len().min(self.count as usize)];
        queue.write_buffer(&self.buffers.points, 0, bytemuck::cast_slice(points));
    }

    /// Adds `vpls`: slots from texels and pyramids.
    ///
    /// # Errors
    /// [`GpuError::Limit`] for more slots than a dispatch can have.
    pub fn draw(&self, pipelines: &Pipelines, pass: &mut Pass, maps: &Maps) -> Result<(), GpuError> {
        let entry = match self.selection {
            Selection::All => "vpls_all",
            Selection::Grid { .. } => "vpls_grid",
            Selection::Importance { .. } => "vpls_importance",
        };
        let slots = match self.selection {
            Selection::Importance { .. } => u64::from(self.count),
            Selection::All | Selection::Grid { .. } => u64::from(self.count) / maps.maps.len().max(1) as u64,
        };
        let own = self.buffers.named();
        for (m, uniform) in maps.maps.iter().zip(&self.uniforms) {
            let more = [named("selection", uniform), named("tops", &maps.tops)];
            pass.compute(pipelines, (&RSM_VPLS, entry), slots, &[&m.named(), &own, &more])?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::layout::check;

    #[test]
    fn structs_lie_in_memory_as_in_wgsl() {
        check::<SelectionUniform>(&RSM_VPLS).unwrap();
        check::<Vpl>(&RSM_VPLS).unwrap();
    }
}
