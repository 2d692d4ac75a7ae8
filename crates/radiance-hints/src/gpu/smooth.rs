use bytemuck::{Pod, Zeroable};
use indirect_core::View;
use indirect_gpu::layout::ViewUniform;
use indirect_gpu::shaders::FILTER_SMOOTH;
use indirect_gpu::wgpu::{BindGroup, Buffer, CommandEncoder, Device, Queue};
use indirect_gpu::{
    GBufferTarget, Kernel, PassTimer, Vec3Pad, empty_storage_buffer, uniform_buffer, workgroups_1d,
};

use super::WORKGROUP;
use crate::Error;

/// As `smooth.wgsl` declares it.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct SmoothUniform {
    factor: f32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

/// `smooth`: a frame's irradiance blended with that of the frames before. Knows nothing of hints: any irradiance will do.
#[derive(Debug, Clone)]
pub struct Smooth {
    kernel: Kernel,
}

impl Smooth {
    /// Builds the pipeline.
    #[must_use]
    pub fn new(device: &Device) -> Self {
        Self { kernel: Kernel::new(device, &FILTER_SMOOTH, "smooth_pixels", &[]) }
    }

    /// Smooths one frame: from the irradiance that `resources` were made for to [`SmoothResources::smoothed`], which the next
    /// frame then takes for its past.
    ///
    /// # Errors
    /// [`Error::Gpu`] for more pixels than a dispatch can have.
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut PassTimer,
        resources: &mut SmoothResources,
    ) -> Result<(), Error> {
        let workgroups = workgroups_1d(resources.pixels, WORKGROUP)?;
        resources.latest = 1 - resources.latest;
        let group = &resources.groups[resources.latest];
        timer.compute(encoder, "smooth", |pass| self.kernel.record(pass, &[group], workgroups));
        Ok(())
    }
}

/// Buffers of a [`Smooth`]: two images that take turns.
#[derive(Debug)]
pub struct SmoothResources {
    /// `array<vec4<f32>>`: smoothed irradiance, W/m², and view depth, metres.
    pub images: [Buffer; 2],
    view: Buffer,
    params: Buffer,
    groups: [BindGroup; 2],
    latest: usize,
    pixels: u64,
    size: [u32; 2],
}

impl SmoothResources {
    /// Buffers for the irradiance `current`, one `vec4<f32>` per pixel of `camera`. Without a past: the first frame is as it is.
    ///
    /// # Errors
    /// [`Error::Gpu`] where a buffer exceeds the device's limits.
    pub fn new(
        device: &Device,
        smooth: &Smooth,
        current: &Buffer,
        camera: &GBufferTarget,
    ) -> Result<Self, Error> {
        let size = camera.size();
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let image = || empty_storage_buffer::<Vec3Pad>(device, "smoothed irradiance", pixels);
        let images = [image()?, image()?];
        let params = uniform_buffer(device, "smooth", &SmoothUniform::zeroed());
        let view = uniform_buffer(device, "smooth view", &ViewUniform::zeroed());
        let groups = [0, 1].map(|latest: usize| {
            let resources = [
                (0, params.as_entire_binding()),
                (1, view.as_entire_binding()),
                (2, camera.position.as_entire_binding()),
                (3, camera.normal.as_entire_binding()),
                (4, current.as_entire_binding()),
                (5, images[1 - latest].as_entire_binding()),
                (6, images[latest].as_entire_binding()),
            ];
            smooth.kernel.bind(device, 0, &resources)
        });
        Ok(Self { images, view, params, groups, latest: 0, pixels, size })
    }

    /// Sets the camera of the *last* frame and the share of the past, `[0, 1)`; call it once a frame.
    ///
    /// # Errors
    /// [`Error::BadOption`] for another share.
    pub fn prepare(&self, queue: &Queue, previous: &View, factor: f32) -> Result<(), Error> {
        if !(0.0..1.0).contains(&factor) {
            let requirement = "in [0, 1)";
            return Err(Error::BadOption { option: "factor", value: factor.to_string(), requirement });
        }
        let view = ViewUniform::new(previous, self.size, 0);
        queue.write_buffer(&self.view, 0, bytemuck::bytes_of(&view));
        let params = SmoothUniform { factor, pad0: 0, pad1: 0, pad2: 0 };
        queue.write_buffer(&self.params, 0, bytemuck::bytes_of(&params));
        Ok(())
    }

    /// The image that was smoothed last.
    #[must_use]
    pub fn smoothed(&self) -> &Buffer {
        &self.images[self.latest]
    }

    /// GPU memory, bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.images.iter().chain([&self.view, &self.params]).map(Buffer::size).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::assert_layout;

    #[test]
    fn struct_lies_in_memory_as_in_wgsl() {
        assert_layout!(FILTER_SMOOTH, "Smooth" = SmoothUniform { factor, pad0, pad1, pad2 });
    }
}
