//! Buffers that are written only when their contents change.

use bytemuck::Pod;

use super::pipelines::Pipelines;
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
            // As the shaders count it.
            size: size_of::<T>().next_multiple_of(16) as u64,
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

/// One item of a scene on the device: its elements, the numbers that go with them, and both as its shader takes them.
#[derive(Debug)]
pub(super) struct Item<K, U> {
    uploaded: K,
    pub(super) elements: Elements,
    pub(super) uniform: Uniform<U>,
    pub(super) bindings: wgpu::BindGroup,
}

impl<K: PartialEq, U: Pod + PartialEq> Item<K, U> {
    /// Uploads the elements unless `old` holds what `wanted` names; returns whether it did. Storage is bound, vertices are not.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub(super) fn upload<T: Pod>(
        (gpu, pipelines): (&Gpu, &Pipelines),
        label: [&str; 2],
        old: Option<Self>,
        wanted: K,
        usage: wgpu::BufferUsages,
        elements: impl FnOnce() -> Vec<T>,
    ) -> Result<(Self, bool), GpuError> {
        let (buffer, uniform) = match old {
            Some(item) if item.uploaded == wanted => return Ok((item, false)),
            old => old.map_or((None, None), |item| (Some(item.elements.buffer), Some(item.uniform))),
        };
        let label = label.join("::");
        let elements = Elements::upload(gpu, &label, &elements(), usage, buffer)?;
        let uniform = uniform.unwrap_or_else(|| Uniform::new(gpu, &label));
        let numbers = uniform.buffer.as_entire_binding();
        let bindings = if usage.contains(wgpu::BufferUsages::STORAGE) {
            gpu.bind(&label, &pipelines.pulled_layout, &[numbers, elements.buffer.as_entire_binding()])
        } else {
            gpu.bind(&label, &pipelines.plain_layout, &[numbers])
        };
        Ok((Self { uploaded: wanted, elements, uniform, bindings }, true))
    }
}
