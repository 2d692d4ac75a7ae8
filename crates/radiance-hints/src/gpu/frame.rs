use indirect_core::settings::Settings;
use indirect_gpu::wgpu::{Buffer, Device, Queue};
use indirect_gpu::{GpuError, Named, Plan};
use indirect_technique::gpu::{GpuTechnique, Inputs};

use super::buffers::{Buffers, Sizes};
use crate::{
    Error,
    passes::{Output, RadianceHints},
    setup::Setup,
};

/// Buffers and passes of the technique.
pub type Resources = indirect_technique::gpu::Resources<RadianceHints>;

impl GpuTechnique for RadianceHints {
    fn sizes(setup: &Setup, size: [u32; 2], maps: usize) -> Sizes {
        Sizes::new(setup, size, maps)
    }

    fn plan(sizes: &Sizes) -> Plan {
        Buffers::plan(sizes)
    }

    fn allocate(device: &Device, queue: &Queue, sizes: &Sizes, _: &Setup) -> Result<Buffers, GpuError> {
        Buffers::new(device, queue, sizes)
    }

    fn named(buffers: &Buffers) -> Vec<Named<'_>> {
        buffers.named()
    }

    fn prepare(
        buffers: &mut Buffers,
        queue: &Queue,
        inputs: &Inputs<'_>,
        setup: &Setup,
    ) -> Result<(), Error> {
        setup.params.validate()?;
        buffers.prepare(queue, inputs, setup)
    }

    fn restore(buffers: &Buffers, queue: &Queue, past: &Output) {
        buffers.smooth.restore(queue, past.history.as_ref());
    }

    fn image_buffer(buffers: &Buffers) -> &Buffer {
        &buffers.own.image
    }
}
