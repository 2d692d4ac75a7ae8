use web_time::Instant;
use wgpu::{
    BufferUsages, CommandEncoder, ComputePass, Device, Features, QuerySet, Queue, RenderPass,
    RenderPassDescriptor,
};

use crate::{GpuError, PassTime, read_buffer};

/// Most passes that one [`PassTimer`] times by timestamps between two [`PassTimer::finish`]; WebGPU guarantees 4096
/// queries.
const MAX_PASSES: u32 = 2048;

#[derive(Debug)]
enum Clock {
    Off,
    Timestamps { queries: QuerySet, names: Vec<&'static str> },
    Wall { times: Vec<PassTime> },
}

/// Begins the passes of a frame and, where asked to, measures each.
///
/// Every `encode` of this workspace takes one. [`PassTimer::off`] only begins passes: that is for renderers.
/// [`PassTimer::new`] is for tools: it uses GPU timestamps where the device has them. Where not, it falls back to the wall
/// clock, for which it submits the encoder after each pass, waits, and goes on with a fresh encoder.
#[derive(Debug)]
pub struct PassTimer {
    clock: Clock,
    gpu: Option<(Device, Queue)>,
}

impl PassTimer {
    /// Measures nothing, never submits.
    #[must_use]
    pub const fn off() -> Self {
        Self { clock: Clock::Off, gpu: None }
    }

    /// Measures by timestamps where the device has [`Features::TIMESTAMP_QUERY`], else by the wall clock.
    #[must_use]
    pub fn new(device: &Device, queue: &Queue) -> Self {
        if !device.features().contains(Features::TIMESTAMP_QUERY) {
            return Self::wall(device, queue);
        }
        let queries = device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("pass times"),
            ty: wgpu::QueryType::Timestamp,
            count: 2 * MAX_PASSES,
        });
        let clock = Clock::Timestamps { queries, names: Vec::new() };
        Self { clock, gpu: Some((device.clone(), queue.clone())) }
    }

    /// Measures by the wall clock: submission, execution and waiting of each pass alone.
    #[must_use]
    pub fn wall(device: &Device, queue: &Queue) -> Self {
        Self { clock: Clock::Wall { times: Vec::new() }, gpu: Some((device.clone(), queue.clone())) }
    }

    /// Name of the clock, for reports: `off`, `timestamps` or `wall`.
    #[must_use]
    pub const fn clock(&self) -> &'static str {
        match self.clock {
            Clock::Off => "off",
            Clock::Timestamps { .. } => "timestamps",
            Clock::Wall { .. } => "wall",
        }
    }

    /// Encodes one compute pass.
    pub fn compute(
        &mut self,
        encoder: &mut CommandEncoder,
        name: &'static str,
        encode: impl FnOnce(&mut ComputePass<'_>),
    ) {
        let index = self.begin(encoder, name);
        let timestamp_writes =
            self.queries(index).map(|(query_set, start)| wgpu::ComputePassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: Some(start),
                end_of_pass_write_index: Some(start + 1),
            });
        let label = Some(name);
        encode(&mut encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label, timestamp_writes }));
        self.end(encoder, name);
    }

    /// Encodes one render pass; the timer overrides the descriptor's timestamps.
    pub fn render(
        &mut self,
        encoder: &mut CommandEncoder,
        name: &'static str,
        descriptor: &RenderPassDescriptor<'_>,
        encode: impl FnOnce(&mut RenderPass<'_>),
    ) {
        let index = self.begin(encoder, name);
        let timestamp_writes =
            self.queries(index).map(|(query_set, start)| wgpu::RenderPassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: Some(start),
                end_of_pass_write_index: Some(start + 1),
            });
        let label = Some(name);
        encode(&mut encoder.begin_render_pass(&RenderPassDescriptor {
            label,
            timestamp_writes,
            ..descriptor.clone()
        }));
        self.end(encoder, name);
    }

    /// The times of all passes since the last call, in order, passes of one name as one; the encoders that hold them must have
    /// been submitted. Blocks.
    ///
    /// # Errors
    /// [`GpuError::ReadBack`].
    pub fn finish(&mut self) -> Result<Vec<PassTime>, GpuError> {
        let Some((device, queue)) = &self.gpu else { return Ok(Vec::new()) };
        let mut times = Vec::new();
        match &mut self.clock {
            Clock::Off => {}
            Clock::Wall { times: found } => {
                core::mem::take(found).into_iter().for_each(|p| PassTime::add(&mut times, p.name, p.ms));
            }
            Clock::Timestamps { names, .. } if names.is_empty() => {}
            Clock::Timestamps { queries, names } => {
                let count = 2 * (names.len() as u32).min(MAX_PASSES);
                let buffer = device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("pass times"),
                    size: u64::from(count) * 8,
                    usage: BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC,
                    mapped_at_creation: false,
                });
                let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                encoder.resolve_query_set(queries, 0..count, &buffer, 0);
                queue.submit([encoder.finish()]);
                let ticks: Vec<u64> = read_buffer(device, queue, &buffer)?;
                let ms = f64::from(queue.get_timestamp_period()) * 1e-6;
                for (name, t) in core::mem::take(names).into_iter().zip(ticks.chunks_exact(2)) {
                    PassTime::add(&mut times, name, t[1].saturating_sub(t[0]) as f64 * ms);
                }
            }
        }
        Ok(times)
    }

    /// Notes the pass; with the wall clock, everything encoded before it is submitted and done when this returns.
    fn begin(&mut self, encoder: &mut CommandEncoder, name: &'static str) -> u32 {
        match &mut self.clock {
            Clock::Off => 0,
            Clock::Timestamps { names, .. } => {
                names.push(name);
                names.len() as u32 - 1
            }
            Clock::Wall { .. } => {
                self.flush(encoder);
                0
            }
        }
    }

    fn end(&mut self, encoder: &mut CommandEncoder, name: &'static str) {
        if !matches!(self.clock, Clock::Wall { .. }) {
            return;
        }
        let start = Instant::now();
        self.flush(encoder);
        if let Clock::Wall { times } = &mut self.clock {
            times.push(PassTime { name, ms: start.elapsed().as_secs_f64() * 1e3 });
        }
    }

    fn flush(&self, encoder: &mut CommandEncoder) {
        if let Some((device, queue)) = &self.gpu {
            let fresh = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            queue.submit([core::mem::replace(encoder, fresh).finish()]);
            // A lost device is reported by whoever reads the results; here only the time would be wrong.
            let _ = device.poll(wgpu::PollType::wait_indefinitely());
        }
    }

    fn queries(&self, index: u32) -> Option<(&QuerySet, u32)> {
        match &self.clock {
            Clock::Timestamps { queries, .. } if index < MAX_PASSES => Some((queries, 2 * index)),
            _ => None,
        }
    }
}
