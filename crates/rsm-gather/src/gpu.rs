//! Frames on wgpu.

use indirect_core::settings::Settings;
use indirect_gpu::wgpu::{Buffer, Device, Queue};
use indirect_gpu::{GpuError, Named, Plan, Vec3Pad};
use rsm::Error;
use rsm::gpu::{Maps, VplList, VplSlots};

pub use crate::buffers::{Buffers, ImageBuffers, Sizes};
pub use indirect_technique::gpu::{GpuTechnique, Inputs};

use crate::passes::RsmGather;
use crate::settings::Setup;

/// Buffers and passes of the technique.
pub type Resources = indirect_technique::gpu::Resources<RsmGather>;

impl GpuTechnique for RsmGather {
    type Maps = Maps;

    fn sizes(setup: &Setup, [width, height]: [u32; 2], maps: usize) -> Sizes {
        let pixels = u64::from(width) * u64::from(height);
        Sizes { pixels, resolution: setup.options.resolution, maps, selection: setup.options.selection() }
    }

    fn plan(s: &Sizes) -> Plan {
        let slots = s.selection.slot_count(s.maps, s.resolution) as u64;
        let lights = VplSlots::plan(s.selection, s.resolution, s.maps).and(VplList::plan(slots));
        Maps::plan(s.resolution, s.maps).and(lights).and(ImageBuffers::plan(s))
    }

    fn allocate(device: &Device, _: &Queue, s: &Sizes, _: &Setup) -> Result<Buffers, GpuError> {
        let slots = VplSlots::new(device, s.selection, s.resolution, s.maps)?;
        Ok(Buffers {
            rsm: Maps::new(device, s.resolution, s.maps)?,
            list: VplList::new(device, slots.count())?,
            slots,
            own: ImageBuffers::new(device, s)?,
        })
    }

    fn resize(
        old: &Buffers,
        device: &Device,
        _: &Queue,
        [sizes, probe]: [&Sizes; 2],
        _: &Setup,
    ) -> Result<Buffers, GpuError> {
        Ok(Buffers { own: old.own.resized(device, sizes, probe)?, ..old.clone() })
    }

    fn maps(buffers: &Buffers) -> &Maps {
        &buffers.rsm
    }

    fn named(buffers: &Buffers) -> Vec<Named<'_>> {
        buffers.own.named()
    }

    fn prepare(
        buffers: &mut Buffers,
        queue: &Queue,
        inputs: &Inputs<'_>,
        setup: &Setup,
    ) -> Result<(), Error> {
        setup.params.validate()?;
        buffers.rsm.prepare(queue, inputs.lights, inputs.views)?;
        buffers.slots.prepare(queue, setup.params.seed);
        let receivers = (buffers.own.image.size() / size_of::<Vec3Pad>() as u64) as u32;
        buffers.list.prepare(queue, receivers, setup.params.form);
        Ok(())
    }

    fn image_buffer(buffers: &Buffers) -> &Buffer {
        &buffers.own.image
    }
}
