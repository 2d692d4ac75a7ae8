use bytemuck::{Pod, Zeroable};
use indirect_gpu::shaders::RSM_GATHER;
use indirect_gpu::wgpu::{
    BindGroup, Buffer, BufferBinding, BufferDescriptor, BufferUsages, CommandEncoder, Device, Queue,
};
use indirect_gpu::{GpuError, Kernel, PassTimer, empty_storage_buffer, workgroups_1d};

use crate::{Error, Form, Vpl};

/// VPLs per dispatch: what one uniform buffer binding holds.
pub const CHUNK: u32 = 1024;

/// Distance of the chunks' parameters in their buffer, bytes: WebGPU's largest alignment of uniform offsets.
const PARAMS_STRIDE: u64 = 256;

/// Parameters of one dispatch, as `gather.wgsl` declares them.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct GatherParams {
    pub(crate) first: u32,
    pub(crate) receivers: u32,
    pub(crate) area_scale: f32,
    pub(crate) pad0: u32,
}

/// `gather`: the irradiance that VPLs cast on receivers, without visibility. Knows nothing of maps: any list of VPLs and any
/// list of receivers will do.
#[derive(Debug, Clone)]
pub struct Gather {
    kernel: Kernel,
}

impl Gather {
    /// Builds the pipeline.
    #[must_use]
    pub fn new(device: &Device) -> Self {
        Self { kernel: Kernel::new(device, &RSM_GATHER, "gather", &[]) }
    }

    /// Sums all VPLs of `resources` into its irradiance.
    ///
    /// # Errors
    /// [`Error::Gpu`] for more receivers than a dispatch can have.
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &GatherResources,
    ) -> Result<(), Error> {
        let workgroups = workgroups_1d(u64::from(resources.receivers).div_ceil(4), 64)?;
        timer.compute(encoder, "gather", |pass| {
            for group in &resources.groups {
                self.kernel.record(pass, &[group], workgroups);
            }
        });
        Ok(())
    }

    /// [`Gather::encode`] for receivers and VPLs that the GPU counted: chunk `i` runs the three workgroup counts at byte
    /// `offset + 12·i` of `workgroups`, one workgroup for every 256 receivers. The first chunk must always run: it starts the
    /// sums.
    pub fn encode_indirect(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &GatherResources,
        workgroups: &Buffer,
        offset: u64,
    ) {
        timer.compute(encoder, "gather", |pass| {
            for (i, group) in (0..).zip(&resources.groups) {
                self.kernel.record_indirect(pass, &[group], workgroups, offset + 12 * i);
            }
        });
    }
}

/// Buffers of a [`Gather`]: VPLs in, irradiance out.
#[derive(Debug, Clone)]
pub struct GatherResources {
    /// `array<Vpl>`, [`GatherResources::capacity`] long. Written by whoever makes the VPLs.
    pub vpls: Buffer,
    /// `array<u32, 1>`: how many of them count.
    pub count: Buffer,
    /// `array<vec4<f32>>`: irradiance per receiver, W/m², and 0.
    pub irradiance: Buffer,
    params: Buffer,
    groups: Vec<BindGroup>,
    receivers: u32,
    capacity: u32,
}

impl GatherResources {
    /// Buffers for up to `capacity` VPLs and the receivers `0..receivers` of two `array<vec4<f32>>`, position (xyz) and unit
    /// normal (xyz). A receiver whose normal is 0 gets 0.
    ///
    /// # Errors
    /// [`Error::Gpu`] where a buffer exceeds the device's limits.
    pub fn new(
        device: &Device,
        gather: &Gather,
        capacity: u32,
        positions: &Buffer,
        normals: &Buffer,
        receivers: u32,
    ) -> Result<Self, Error> {
        let chunks = capacity.div_ceil(CHUNK).max(1);
        let chunk_bytes = u64::from(CHUNK) * size_of::<Vpl>() as u64;
        let size = u64::from(chunks) * chunk_bytes;
        let limits = device.limits();
        let available = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if size > available {
            let limit = "max_storage_buffer_binding_size";
            return Err(GpuError::Limit { what: "the VPL buffer", limit, needed: size, available }.into());
        }
        let usage =
            BufferUsages::STORAGE | BufferUsages::UNIFORM | BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
        let vpls = device.create_buffer(&BufferDescriptor {
            label: Some("vpls"),
            size,
            usage,
            mapped_at_creation: false,
        });
        let params = device.create_buffer(&BufferDescriptor {
            label: Some("gather params"),
            size: u64::from(chunks) * PARAMS_STRIDE,
            usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let count = empty_storage_buffer::<u32>(device, "vpl count", 1)?;
        let irradiance = empty_storage_buffer::<[f32; 4]>(device, "irradiance", u64::from(receivers))?;
        let part = |buffer, offset, size| {
            let size = core::num::NonZeroU64::new(size);
            indirect_gpu::wgpu::BindingResource::Buffer(BufferBinding { buffer, offset, size })
        };
        let groups = (0..u64::from(chunks))
            .map(|i| {
                let resources = [
                    (0, part(&params, i * PARAMS_STRIDE, size_of::<GatherParams>() as u64)),
                    (1, part(&vpls, i * chunk_bytes, chunk_bytes)),
                    (2, count.as_entire_binding()),
                    (3, positions.as_entire_binding()),
                    (4, normals.as_entire_binding()),
                    (5, irradiance.as_entire_binding()),
                ];
                gather.kernel.bind(device, 0, &resources)
            })
            .collect();
        Ok(Self { vpls, count, irradiance, params, groups, receivers, capacity })
    }

    /// Sets the factor that the next submission uses. Call it once before the first.
    pub fn prepare(&self, queue: &Queue, form: Form) {
        for i in 0..self.groups.len() as u32 {
            let params = GatherParams {
                first: i * CHUNK,
                receivers: self.receivers,
                area_scale: form.area_scale(),
                pad0: 0,
            };
            queue.write_buffer(&self.params, u64::from(i) * PARAMS_STRIDE, bytemuck::bytes_of(&params));
        }
    }

    /// Uploads a list of VPLs, for callers that make them on the CPU. Those beyond [`GatherResources::capacity`] are left out.
    pub fn write_vpls(&self, queue: &Queue, vpls: &[Vpl]) {
        let vpls = &vpls[..vpls.len().min(self.capacity as usize)];
        queue.write_buffer(&self.vpls, 0, bytemuck::cast_slice(vpls));
        queue.write_buffer(&self.count, 0, bytemuck::bytes_of(&(vpls.len() as u32)));
    }

    /// Number of VPLs that fit.
    #[must_use]
    pub const fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Dispatches of a gather: one for every [`CHUNK`] VPLs that fit.
    #[must_use]
    pub fn chunks(&self) -> u32 {
        self.groups.len() as u32
    }

    /// Number of receivers.
    #[must_use]
    pub const fn receivers(&self) -> u32 {
        self.receivers
    }

    /// Bytes of all buffers.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        [&self.vpls, &self.count, &self.irradiance, &self.params].map(Buffer::size).iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::{assert_layout, layout::check_constant};

    #[test]
    fn struct_and_chunk_are_those_of_the_shader() {
        assert_layout!(RSM_GATHER, "Gather" = GatherParams { first, receivers, area_scale, pad0 });
        check_constant(&RSM_GATHER, "CHUNK", CHUNK).unwrap();
    }
}
