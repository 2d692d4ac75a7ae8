use bytemuck::Pod;
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{Buffer, BufferUsages, Device, PollType, Queue};

use crate::{GpuError, Plan};

/// A storage buffer with the given contents, which can be read back and copied into. Nothing at all becomes one zeroed
/// element: WebGPU has no empty bindings.
///
/// # Errors
/// [`GpuError::Limit`] where it is longer than the device lets a shader bind.
pub fn storage_buffer<T: Pod>(device: &Device, label: &'static str, data: &[T]) -> Result<Buffer, GpuError> {
    let zero = [T::zeroed()];
    let contents: &[u8] = bytemuck::cast_slice(if data.is_empty() { &zero } else { data });
    check_storage_size(device, label, contents.len() as u64)?;
    let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
    Ok(device.create_buffer_init(&BufferInitDescriptor { label: Some(label), contents, usage }))
}

/// A zeroed storage buffer of `count` elements (at least one), which can be read back and copied into.
///
/// # Errors
/// [`GpuError::Limit`] where it is longer than the device lets a shader bind.
pub fn empty_storage_buffer<T: Pod>(
    device: &Device,
    label: &'static str,
    count: u64,
) -> Result<Buffer, GpuError> {
    let size = count.max(1).saturating_mul(size_of::<T>() as u64).next_multiple_of(4);
    check_storage_size(device, label, size)?;
    let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
    let mapped_at_creation = false;
    Ok(device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation }))
}

/// A uniform buffer that holds `value`.
#[must_use]
pub fn uniform_buffer<T: Pod>(device: &Device, label: &'static str, value: &T) -> Buffer {
    let contents = bytemuck::bytes_of(value);
    let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
    device.create_buffer_init(&BufferInitDescriptor { label: Some(label), contents, usage })
}

fn check_storage_size(device: &Device, what: &'static str, needed: u64) -> Result<(), GpuError> {
    let mut plan = Plan::new();
    plan.storage::<[u8; 4]>(what, needed.div_ceil(4), BufferUsages::empty());
    plan.check(&device.limits())
}

/// Copies a whole buffer (with usage `COPY_SRC`) back to the CPU. Submits, and blocks until all submitted work is done.
///
/// Bytes beyond the last whole element are left out.
///
/// # Errors
/// [`GpuError::ReadBack`] when the device is lost or the copy cannot be mapped.
pub fn read_buffer<T: Pod>(device: &Device, queue: &Queue, buffer: &Buffer) -> Result<Vec<T>, GpuError> {
    read_range(device, queue, buffer, 0, u64::MAX)
}

/// [`read_buffer`] of up to `count` elements from element `first` on; a part that lies beyond the buffer's end is left out.
///
/// # Errors
/// As there.
pub fn read_range<T: Pod>(
    device: &Device,
    queue: &Queue,
    buffer: &Buffer,
    first: u64,
    count: u64,
) -> Result<Vec<T>, GpuError> {
    let element = size_of::<T>() as u64;
    let end = first.saturating_add(count).saturating_mul(element).min(buffer.size());
    let begin = first.saturating_mul(element).min(end);
    // Copies are in words: an element that is no whole number of them does not occur.
    let size = (end - begin) & !3;
    if size == 0 {
        return Ok(Vec::new());
    }
    let staging = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("read-back"),
        size,
        usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_buffer_to_buffer(buffer, begin, &staging, 0, size);
    queue.submit([encoder.finish()]);
    let (sender, receiver) = std::sync::mpsc::channel();
    staging.map_async(wgpu::MapMode::Read, .., move |result| {
        // The receiver lives until the callback ran or the device is gone; in the latter case nobody listens.
        let _ = sender.send(result);
    });
    let failed = |reason: String| GpuError::ReadBack { label: "buffer".to_owned(), reason };
    device.poll(PollType::wait_indefinitely()).map_err(|e| failed(e.to_string()))?;
    receiver.recv().map_err(|e| failed(e.to_string()))?.map_err(|e| failed(e.to_string()))?;
    let bytes = staging.get_mapped_range(..).map_err(|e| failed(e.to_string()))?;
    let whole = bytes.len() / size_of::<T>() * size_of::<T>();
    Ok(bytemuck::pod_collect_to_vec(&bytes[..whole]))
}
