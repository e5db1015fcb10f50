//! Buffers that are written only when their contents change.

use bytemuck::Pod;

use super::{Gpu, GpuError, wgpu};

/// One struct of numbers for the shaders.
#[derive(Debug)]
pub(super) struct Uniform<T> {
    pub(super) buffer: wgpu::Buffer,
    value: Option<T>,
}

impl<T: Pod + PartialEq> Uniform<T> {
    /// An empty one; the first [`Self::set`] writes.
    pub(super) fn new(gpu: &Gpu, label: &str) -> Self {
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: size_of::<T>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self { buffer, value: None }
    }

    /// Writes `value` unless it is there already; returns whether it wrote. NaN counts as different from itself, so
    /// a value with NaN is written every time.
    pub(super) fn set(&mut self, gpu: &Gpu, value: T) -> bool {
        if self.value == Some(value) {
            return false;
        }
        gpu.queue.write_buffer(&self.buffer, 0, bytemuck::bytes_of(&value));
        self.value = Some(value);
        true
    }
}

/// Many elements for the shaders.
#[derive(Debug)]
pub(super) struct Elements {
    pub(super) buffer: wgpu::Buffer,
    pub(super) count: u32,
}

impl Elements {
    /// Uploads `elements`, into `old`'s buffer if it is large enough (and not far too large).
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub(super) fn upload<T: Pod>(
        gpu: &Gpu,
        what: &str,
        elements: &[T],
        usage: wgpu::BufferUsages,
        old: Option<wgpu::Buffer>,
    ) -> Result<Self, GpuError> {
        let bytes = std::mem::size_of_val(elements) as u64;
        let limit = gpu.max_bytes(usage);
        let too_large = || GpuError::TooLarge { what: what.to_owned(), bytes, limit };
        let count = u32::try_from(elements.len()).map_err(|_| too_large())?;
        if bytes > limit {
            return Err(too_large());
        }
        let fits = |b: &wgpu::Buffer| b.size() >= bytes && b.size() <= bytes.max(1 << 16) * 4;
        let buffer = old.filter(fits).unwrap_or_else(|| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(what),
                // Never empty: a binding of no bytes is not allowed.
                size: bytes.max(64),
                usage: usage | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        });
        gpu.queue.write_buffer(&buffer, 0, bytemuck::cast_slice(elements));
        Ok(Self { buffer, count })
    }
}
