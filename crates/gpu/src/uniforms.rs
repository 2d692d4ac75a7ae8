use core::marker::PhantomData;

use bytemuck::Pod;
use wgpu::{BindingResource, Buffer, BufferBinding, BufferSize, BufferUsages, Device, Queue};

/// Where an element of a uniform buffer may begin on any WebGPU device: at multiples of so many bytes.
const ALIGNMENT: usize = 256;

/// Many values of one uniform in one buffer, so that a frame writes all of them at once. A clone refers to the same memory.
#[derive(Debug, Clone)]
pub struct Uniforms<T> {
    buffer: Buffer,
    element: PhantomData<T>,
}

impl<T: Pod> Uniforms<T> {
    const STRIDE: usize = size_of::<T>().next_multiple_of(ALIGNMENT);

    /// Bytes of `count` values.
    #[must_use]
    pub const fn bytes_of(count: usize) -> u64 {
        (Self::STRIDE * if count == 0 { 1 } else { count }) as u64
    }

    /// `count` values, zeroed.
    #[must_use]
    pub fn new(device: &Device, label: &str, count: usize) -> Self {
        let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        let (label, size, mapped_at_creation) = (Some(label), Self::bytes_of(count), false);
        let buffer = device.create_buffer(&wgpu::BufferDescriptor { label, size, usage, mapped_at_creation });
        Self { buffer, element: PhantomData }
    }

    /// Value `i`, to be bound.
    #[must_use]
    pub fn binding(&self, i: usize) -> BindingResource<'_> {
        let offset = (Self::STRIDE * i) as u64;
        BindingResource::Buffer(BufferBinding {
            buffer: &self.buffer,
            offset,
            size: BufferSize::new(size_of::<T>() as u64),
        })
    }

    /// Writes values from number `first` on, from the next submission on.
    pub fn write(&self, queue: &Queue, first: usize, values: &[T]) {
        let mut bytes = vec![0; Self::STRIDE * values.len()];
        for (slot, value) in bytes.chunks_mut(Self::STRIDE).zip(values) {
            slot[..size_of::<T>()].copy_from_slice(bytemuck::bytes_of(value));
        }
        queue.write_buffer(&self.buffer, (Self::STRIDE * first) as u64, &bytes);
    }

    /// Whether both are in one buffer.
    #[must_use]
    pub fn is(&self, other: &Self) -> bool {
        self.buffer == other.buffer
    }
}
