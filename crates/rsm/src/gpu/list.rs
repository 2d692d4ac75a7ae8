use bytemuck::{Pod, Zeroable};
use core::num::NonZeroU64;
use indirect_gpu::shaders::{RSM_COMPACT, RSM_GATHER};
use indirect_gpu::wgpu::{BindingResource, Buffer, BufferBinding, Device, Queue};
use indirect_gpu::{GpuError, Named, Pass, Pipelines, Plan, buffers, named};
use indirect_technique::gpu::Exchange;

use crate::{Form, Vpl};

/// VPLs per dispatch: what one uniform buffer binding holds.
pub const CHUNK: u32 = 1024;

/// Bytes of [`CHUNK`] VPLs.
const CHUNK_BYTES: u64 = CHUNK as u64 * size_of::<Vpl>() as u64;

/// Parameters of a chunk take as much of their buffer as WebGPU's largest alignment of uniform offsets.
type Slot = [[u32; 4]; 16];

/// Receivers of a workgroup of `gather`, each of whose threads treats four.
const RECEIVERS: u64 = 4;

indirect_core::wgsl_struct! {
    /// Parameters of one dispatch.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    pub(crate) struct GatherParams = "Gather" {
        pub(crate) first: u32,
        pub(crate) receivers: u32,
        pub(crate) area_scale: f32,
        pub(crate) pad0: u32,
    }
}

/// Chunks of a list.
#[derive(Debug, Clone, Copy)]
pub struct Chunks(u64);

/// How many slots `compact` looks at.
type SlotCount = [u32; 4];

buffers! {
    /// Buffers of a [`VplList`].
    pub struct ListBuffers for Chunks {
        /// Written by whoever makes the VPLs.
        vpls: [Vpl] + UNIFORM = |c| c.0 * u64::from(CHUNK);
        /// How many of them count.
        count: [u32] = |_| 1;
        params: [Slot] + UNIFORM = |c| c.0;
        slot_count: SlotCount;
    }
}

/// A list of VPLs, and the sum of their light at receivers: `compact` fills it, `gather` reads it. Knows nothing of maps: any list of
/// VPLs and any receivers will do.
#[derive(Debug, Clone)]
pub struct VplList {
    /// The buffers.
    pub buffers: ListBuffers,
    capacity: u32,
    chunks: u32,
}

impl VplList {
    /// What a list of up to `capacity` VPLs will allocate.
    #[must_use]
    pub fn plan(capacity: u64) -> Plan {
        let mut plan = ListBuffers::plan(&Self::chunks_of(capacity));
        plan.index("VPLs", capacity);
        plan
    }

    fn chunks_of(capacity: u64) -> Chunks {
        Chunks(capacity.div_ceil(u64::from(CHUNK)).max(1))
    }

    /// Buffers for up to `capacity` VPLs.
    ///
    /// # Errors
    /// [`GpuError::Limit`].
    pub fn new(device: &Device, capacity: u32) -> Result<Self, GpuError> {
        let chunks = Self::chunks_of(capacity.into());
        Ok(Self { buffers: ListBuffers::new(device, &chunks)?, capacity, chunks: chunks.0 as u32 })
    }

    /// Sets the number of receivers and the factor.
    pub fn prepare(&self, queue: &Queue, receivers: u32, form: Form) {
        queue.write_buffer(&self.buffers.slot_count, 0, bytemuck::bytes_of(&[self.capacity, 0, 0, 0]));
        for i in 0..self.chunks {
            let area_scale = form.area_scale();
            let params = GatherParams { first: i * CHUNK, receivers, area_scale, pad0: 0 };
            let at = u64::from(i) * size_of::<Slot>() as u64;
            queue.write_buffer(&self.buffers.params, at, bytemuck::bytes_of(&params));
        }
    }

    /// Uploads a list of VPLs, for callers that make them on the CPU. Those beyond [`Self::capacity`] are left out.
    pub fn write(&self, queue: &Queue, vpls: &[Vpl]) {
        let vpls = &vpls[..vpls.len().min(self.capacity as usize)];
        queue.write_buffer(&self.buffers.vpls, 0, bytemuck::cast_slice(vpls));
        queue.write_buffer(&self.buffers.count, 0, bytemuck::bytes_of(&(vpls.len() as u32)));
    }

    /// Number of VPLs that fit.
    #[must_use]
    pub const fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Dispatches of a gather: one for every [`CHUNK`] VPLs that fit.
    #[must_use]
    pub const fn chunks(&self) -> u32 {
        self.chunks
    }

    /// Adds `compact`: those of [`Self::capacity`] `slots` that hold flux.
    ///
    /// # Errors
    /// None in practice.
    pub fn compact(&self, pipelines: &Pipelines, pass: &mut Pass, slots: &Buffer) -> Result<(), GpuError> {
        pass.compute(
            pipelines,
            (&RSM_COMPACT, "compact"),
            1,
            &[&self.buffers.named(), &[named("slots", slots)]],
        )
    }

    /// Adds `gather`: the irradiance of the whole list at `receivers` receivers. `own` binds `positions`, `normals` (xyz each; a
    /// receiver whose normal is 0 gets 0) and `irradiance`, all `array<vec4<f32>>`.
    ///
    /// # Errors
    /// [`GpuError::Limit`] for more receivers than a dispatch can have, [`GpuError::Unbound`] where one of the names is missing.
    pub fn gather(
        &self,
        pipelines: &Pipelines,
        pass: &mut Pass,
        receivers: u64,
        own: &[Named<'_>],
    ) -> Result<(), GpuError> {
        let threads = receivers.div_ceil(RECEIVERS);
        (0..self.chunks).try_for_each(|i| {
            pass.compute(
                pipelines,
                (&RSM_GATHER, "gather"),
                threads,
                &[&self.buffers.named(), own, &self.chunk(i)],
            )
        })
    }

    /// [`Self::gather`] for receivers and VPLs that the GPU counted: chunk `i` runs the three workgroup counts at byte
    /// `offset + 12·i` of `arguments`, one workgroup for every 256 receivers. The first chunk must always run: it starts the
    /// sums.
    ///
    /// # Errors
    /// [`GpuError::Unbound`] where one of the names is missing.
    pub fn gather_indirect(
        &self,
        pipelines: &Pipelines,
        pass: &mut Pass,
        (arguments, offset): (&Buffer, u64),
        own: &[Named<'_>],
    ) -> Result<(), GpuError> {
        (0..self.chunks).try_for_each(|i| {
            let lists: [&[Named<'_>]; 3] = [&self.buffers.named(), own, &self.chunk(i)];
            let arguments = (arguments, offset + 12 * u64::from(i));
            pass.compute_indirect(pipelines, (&RSM_GATHER, "gather"), arguments, &lists)
        })
    }

    /// What chunk `i` binds.
    fn chunk(&self, i: u32) -> [Named<'_>; 2] {
        let part = |buffer, offset, size| {
            BindingResource::Buffer(BufferBinding { buffer, offset, size: NonZeroU64::new(size) })
        };
        let (i, slot) = (u64::from(i), size_of::<Slot>() as u64);
        [
            ("params", part(&self.buffers.params, i * slot, size_of::<GatherParams>() as u64)),
            ("chunk", part(&self.buffers.vpls, i * CHUNK_BYTES, CHUNK_BYTES)),
        ]
    }

    /// Names the list.
    pub fn exchange(&self, vpls: &mut Vec<Vpl>, exchange: &mut Exchange<'_>) {
        exchange.length(&self.buffers.count, 0, vpls);
        exchange.elements("", &self.buffers.vpls, 0, vpls);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::layout::{check, check_constant};

    #[test]
    fn struct_and_chunk_are_those_of_the_shader() {
        check::<GatherParams>(&RSM_GATHER).unwrap();
        check_constant(&RSM_GATHER, "CHUNK", CHUNK).unwrap();
    }
}
