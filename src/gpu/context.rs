//! The graphics device, and its errors as values.

use futures_lite::future::block_on;
use std::sync::Arc;

use super::{GpuError, wgpu};

/// sRGB-encoded bytes behind a plain format: the window toolkit samples its images so, and blends so.
pub const COLOR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Depth is reversed (1 near, 0 far); the stencil says where something solid was drawn, so that a veil before it is thin.
pub(crate) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth24PlusStencil8;
/// Texels of a shadow: the share of each pixel that lies in it.
pub(super) const SHADOW_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

/// A device with its queue, and what the renderer needs to know about them. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Gpu {
    /// Creates buffers, textures and pipelines.
    pub device: wgpu::Device,
    /// Takes uploads and commands.
    pub queue: wgpu::Queue,
    /// Samples per pixel: 4 where the adapter can and is no software renderer, else 1. [`Pipelines`] and [`Target`]s
    /// are made for this number.
    ///
    /// [`Pipelines`]: super::pipelines::Pipelines
    /// [`Target`]: super::target::Target
    pub samples: u32,
    /// The adapter is a program: four samples cost it 2.5 times the time of one, so it is spared them.
    pub software: bool,
    /// Vertices can be read from storage buffers, which points, lines and edges need.
    pub(super) storage: bool,
    max_samples: u32,
    /// Name and driver of the adapter, for the log and the about box.
    pub adapter: String,
}

impl Gpu {
    /// Wraps a device that somebody else made (the window). From now on an error that no scope catches is logged
    /// instead of ending the program.
    pub fn new(adapter: &wgpu::Adapter, device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let four = |format| {
            let flags = adapter.get_texture_format_features(format).flags;
            flags.contains(wgpu::TextureFormatFeatureFlags::MULTISAMPLE_X4)
        };
        let resolves = adapter
            .get_texture_format_features(COLOR_FORMAT)
            .flags
            .contains(wgpu::TextureFormatFeatureFlags::MULTISAMPLE_RESOLVE);
        let can = resolves && four(COLOR_FORMAT) && four(DEPTH_FORMAT);
        let info = adapter.get_info();
        device.on_uncaptured_error(Arc::new(|error| log::error!("graphics device: {error}")));
        let software = info.device_type == wgpu::DeviceType::Cpu;
        let max_samples = if can { 4 } else { 1 };
        let storage = device.limits().max_storage_buffers_per_shader_stage > 0
            && adapter.get_downlevel_capabilities().flags.contains(wgpu::DownlevelFlags::VERTEX_STORAGE);
        let adapter = format!("{} ({})", info.name, info.driver_info);
        Self { device, queue, samples: if software { 1 } else { max_samples }, software, storage, max_samples, adapter }
    }

    /// Device with the smoothest edges it can draw, for figures.
    pub fn smooth(&self) -> Self {
        Self { samples: self.max_samples, ..self.clone() }
    }

    /// Limits that the window asks an adapter for. Of a GL driver all that it has: the toolkit asks such a driver for
    /// what a browser has, and that is no storage buffers.
    pub fn device_descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
        let required_limits = match adapter.get_info().backend {
            wgpu::Backend::Gl => adapter.limits(),
            // Room for a window as large as the adapter can draw.
            _ => {
                let max_texture_dimension_2d = adapter.limits().max_texture_dimension_2d;
                wgpu::Limits { max_texture_dimension_2d, ..wgpu::Limits::default() }
            }
        };
        wgpu::DeviceDescriptor { label: Some("touch2touch window"), required_limits, ..Default::default() }
    }

    /// A device without a window, on the best adapter there is; a software renderer will do.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`] and [`GpuError::NoDevice`].
    pub fn headless() -> Result<Self, GpuError> {
        let adapter = best_adapter()?;
        let limits = wgpu::Limits::default().or_better_values_from(&adapter.limits());
        let limits = if limits.check_limits(&adapter.limits()) { limits } else { adapter.limits() };
        let descriptor =
            wgpu::DeviceDescriptor { label: Some("touch2touch"), required_limits: limits, ..Default::default() };
        let (device, queue) = block_on(adapter.request_device(&descriptor))
            .map_err(|e| GpuError::NoDevice { adapter: adapter.get_info().name, reason: e.to_string() })?;
        Ok(Self::new(&adapter, device, queue))
    }

    /// Runs `work` and turns the first error that the device reports meanwhile into a value.
    ///
    /// # Errors
    /// [`GpuError::Device`] with `what`, or what `work` returns.
    pub fn guarded<T>(&self, what: &str, work: impl FnOnce() -> Result<T, GpuError>) -> Result<T, GpuError> {
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let internal = self.device.push_error_scope(wgpu::ErrorFilter::Internal);
        let validation = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let result = work();
        let invalid = block_on(validation.pop());
        let internal = block_on(internal.pop());
        let full = block_on(memory.pop());
        let value = result?;
        match invalid.or(internal).or(full) {
            None => Ok(value),
            Some(error) => Err(GpuError::Device { what: what.to_owned(), reason: error.to_string() }),
        }
    }

    /// A texture of one level.
    pub(super) fn texture(
        &self,
        label: &str,
        [width, height]: [u32; 2],
        format: wgpu::TextureFormat,
        sample_count: u32,
        usage: wgpu::TextureUsages,
    ) -> wgpu::Texture {
        self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        })
    }

    /// Reads between the pixels of a texture as `filter` says.
    pub(super) fn sampler(&self, label: &str, filter: wgpu::FilterMode) -> wgpu::Sampler {
        let label = Some(label);
        let settings = wgpu::SamplerDescriptor { label, mag_filter: filter, min_filter: filter, ..Default::default() };
        self.device.create_sampler(&settings)
    }

    pub(super) fn layout(&self, label: &str, entries: &[wgpu::BindGroupLayoutEntry]) -> wgpu::BindGroupLayout {
        self.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries })
    }

    /// Binds resources as number 0, 1 and so on.
    pub(super) fn bind(
        &self,
        label: &str,
        layout: &wgpu::BindGroupLayout,
        resources: &[wgpu::BindingResource<'_>],
    ) -> wgpu::BindGroup {
        let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
        let entries: Vec<_> = (0..).zip(resources.iter().cloned()).map(entry).collect();
        self.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
    }

    /// Largest buffer for a usage, bytes. A device without storage buffers still has vertices and indices.
    pub(super) fn max_bytes(&self, usage: wgpu::BufferUsages) -> u64 {
        let limits = self.device.limits();
        if usage.contains(wgpu::BufferUsages::STORAGE) {
            limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
        } else {
            limits.max_buffer_size
        }
    }
}

/// The best graphics adapter of this machine, in words.
///
/// # Errors
/// [`GpuError::NoAdapter`].
pub(crate) fn adapter_in_words() -> Result<String, GpuError> {
    let info = best_adapter()?.get_info();
    let kind = match info.device_type {
        wgpu::DeviceType::Cpu => "software",
        wgpu::DeviceType::IntegratedGpu => "integrated",
        wgpu::DeviceType::DiscreteGpu => "discrete",
        wgpu::DeviceType::VirtualGpu => "virtual",
        wgpu::DeviceType::Other => "of unknown kind",
    };
    let driver = format!("{} {}", info.driver, info.driver_info);
    Ok(format!("{}, {kind} ({}; {})", info.name, info.backend, driver.trim()))
}

fn best_adapter() -> Result<wgpu::Adapter, GpuError> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let power_preference = wgpu::PowerPreference::HighPerformance;
    let options = wgpu::RequestAdapterOptions { power_preference, ..Default::default() };
    block_on(instance.request_adapter(&options)).map_err(|e| GpuError::NoAdapter(e.to_string()))
}

/// Starts a pass that draws color alone into a picture of one sample per pixel.
pub(super) fn begin_color<'e>(
    encoder: &'e mut wgpu::CommandEncoder,
    label: &str,
    view: &wgpu::TextureView,
    load: wgpu::LoadOp<wgpu::Color>,
) -> wgpu::RenderPass<'e> {
    let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
    let color = wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops };
    let (label, color_attachments) = (Some(label), &[Some(color)][..]);
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor { label, color_attachments, ..Default::default() })
}
