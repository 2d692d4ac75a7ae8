//! What binds the filters on wgpu. `shade` and `bilateral` need nothing of their own: their names are those of the G-buffer
//! and of the technique's images.

use bytemuck::{Pod, Zeroable};
use indirect_core::View;
use indirect_gpu::shaders::FILTER_SMOOTH;
use indirect_gpu::wgpu::Queue;
use indirect_gpu::{GpuError, Named, Pass, Pipelines, Vec3Pad, ViewUniform, buffers};

use crate::History;

indirect_core::wgsl_struct! {
    /// Parameters of `smooth`.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    pub(crate) struct Smoothing = "Smoothing" {
        pub(crate) factor: f32,
    }
}

buffers! {
    /// Buffers of `smooth` for so many pixels; 0 where nothing is smoothed.
    pub struct SmoothBuffers for u64 {
        /// Smoothed irradiance per pixel, W/m², and view depth, metres.
        smoothed: [Vec3Pad] = |pixels| *pixels;
        /// The same of the frame before; all 0 before the first frame, which is not blended.
        history: [Vec3Pad] = |pixels| *pixels;
        /// The camera of the present frame.
        present_view: [ViewUniform] = |_| 1;
        /// The camera of the frame before.
        previous_view: ViewUniform;
        /// The share of the past.
        smoothing: Smoothing;
    }
}

impl SmoothBuffers {
    /// Sets the camera of the frame, which sees an image of `size` pixels, and the share of the past, `[0, 1)`.
    pub fn prepare(&self, queue: &Queue, view: &View, size: [u32; 2], factor: f32) {
        let view = ViewUniform::new(view, size, 0);
        queue.write_buffer(&self.present_view, 0, bytemuck::bytes_of(&view));
        queue.write_buffer(&self.smoothing, 0, bytemuck::bytes_of(&Smoothing { factor }));
    }

    /// Overwrites what is kept of the frame before; `None` forgets it.
    pub fn restore(&self, queue: &Queue, history: Option<&History>) {
        match history {
            Some(h) => {
                let view = ViewUniform::new(&h.view, h.size, 0);
                queue.write_buffer(&self.previous_view, 0, bytemuck::bytes_of(&view));
                queue.write_buffer(&self.history, 0, bytemuck::cast_slice(&h.pixels));
            }
            None => queue.write_buffer(&self.history, 0, &vec![0; self.history.size() as usize]),
        }
    }

    /// Adds `smooth`: [`Self::smoothed`](field@Self::smoothed) from what `lists` bind as `irradiance`, `positions` and
    /// `normals`, one `vec4<f32>` per pixel; then keeps it for the next frame.
    ///
    /// # Errors
    /// [`GpuError::Limit`] for more pixels than a dispatch can have, [`GpuError::Unbound`] where one of the names is missing.
    pub fn smooth(
        &self,
        pipelines: &Pipelines,
        pass: &mut Pass,
        pixels: u64,
        named: &[Named<'_>],
    ) -> Result<(), GpuError> {
        pass.compute(pipelines, (&FILTER_SMOOTH, "smooth_pixels"), pixels, &[named, &self.named()])?;
        pass.copy("history", (&self.smoothed, 0), (&self.history, 0), self.history.size());
        pass.copy(
            "previous_view",
            (&self.present_view, 0),
            (&self.previous_view, 0),
            self.previous_view.size(),
        );
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::layout::check;

    #[test]
    fn structs_lie_in_memory_as_in_wgsl() {
        check::<Smoothing>(&FILTER_SMOOTH).unwrap();
        check::<crate::Reduced>(&indirect_gpu::shaders::RADIANCE_HINTS_UPSAMPLE).unwrap();
    }

    #[cfg(feature = "cpu")]
    #[test]
    fn constants_are_the_same_in_wgsl() {
        testkit::layout::check_constant(&FILTER_SMOOTH, "DEPTH_TOLERANCE", crate::cpu::DEPTH_TOLERANCE)
            .unwrap();
    }
}
