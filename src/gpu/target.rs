//! An off-screen picture with its own depth: what a 3D view draws into and the window shows as an image.

use std::sync::atomic::{AtomicU64, Ordering};

use super::context::{COLOR_FORMAT, DEPTH_FORMAT};
use super::{Gpu, GpuError, wgpu};

/// Color (multisampled where possible), its resolved picture and depth, in physical pixels.
#[derive(Debug)]
pub struct Target {
    size: [u32; 2],
    generation: u64,
    resolved: wgpu::Texture,
    resolved_view: wgpu::TextureView,
    multisampled: Option<wgpu::TextureView>,
    depth: wgpu::TextureView,
    /// The depth of every sample, without the stencil, for shaders.
    pub(super) depth_alone: wgpu::TextureView,
}

impl Target {
    /// A target of `size` pixels (width, height); sizes that the device cannot hold are brought into its range.
    ///
    /// # Errors
    /// [`GpuError::Device`], for one if there is no memory for it.
    pub fn new(gpu: &Gpu, size: [u32; 2]) -> Result<Self, GpuError> {
        static GENERATION: AtomicU64 = AtomicU64::new(0);
        let size = Self::possible(gpu, size);
        gpu.guarded("creating the off-screen picture", || {
            let texture = |label, format, samples, usage| gpu.texture(label, size, format, samples, usage);
            let attachment = wgpu::TextureUsages::RENDER_ATTACHMENT;
            let shown = attachment | wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
            let view = |t: wgpu::Texture| t.create_view(&wgpu::TextureViewDescriptor::default());
            let resolved = texture("Target::resolved", COLOR_FORMAT, 1, shown);
            let resolved_view = view(resolved.clone());
            let multisampled =
                (gpu.samples > 1).then(|| view(texture("Target::multisampled", COLOR_FORMAT, gpu.samples, attachment)));
            let depth_usage = attachment | wgpu::TextureUsages::TEXTURE_BINDING;
            let depth = texture("Target::depth", DEPTH_FORMAT, gpu.samples, depth_usage);
            let alone = wgpu::TextureViewDescriptor { aspect: wgpu::TextureAspect::DepthOnly, ..Default::default() };
            let (depth_alone, depth) = (depth.create_view(&alone), view(depth));
            let generation = GENERATION.fetch_add(1, Ordering::Relaxed);
            Ok(Self { size, generation, resolved, resolved_view, multisampled, depth, depth_alone })
        })
    }

    /// Makes the target `size` pixels large; does nothing if it is already. Returns whether the texture is a new one,
    /// so that it has to be registered again where it is shown.
    ///
    /// # Errors
    /// As [`Self::new`]; the old target stays.
    pub fn resize(&mut self, gpu: &Gpu, size: [u32; 2]) -> Result<bool, GpuError> {
        if Self::possible(gpu, size) == self.size {
            return Ok(false);
        }
        *self = Self::new(gpu, size)?;
        Ok(true)
    }

    /// Width and height, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Tells two targets, and a target before and after a change of size, apart.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// The finished picture, for sampling: sRGB-encoded, premultiplied.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.resolved_view
    }

    /// Starts a pass.
    pub(super) fn begin<'e>(&self, encoder: &'e mut wgpu::CommandEncoder, pass: Pass) -> wgpu::RenderPass<'e> {
        let (view, resolve_target, store_color) = match &self.multisampled {
            // The samples are not needed once they are resolved.
            Some(samples) if pass.last => (samples, Some(&self.resolved_view), wgpu::StoreOp::Discard),
            Some(samples) => (samples, None, wgpu::StoreOp::Store),
            None => (&self.resolved_view, None, wgpu::StoreOp::Store),
        };
        let [r, g, b, a] = pass.clear.unwrap_or_default().map(f64::from);
        let color = pass.clear.map(|_| wgpu::Color { r, g, b, a });
        let store = if pass.last { wgpu::StoreOp::Discard } else { wgpu::StoreOp::Store };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("Scene::pass"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target,
                ops: ops(color, store_color),
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: pass.writes_depth.then(|| ops(pass.clear.map(|_| 0.0), store)),
                stencil_ops: pass.writes_depth.then(|| ops(pass.clear.map(|_| 0), store)),
            }),
            ..Default::default()
        })
    }

    /// Waits for the picture and copies it to memory, for tests and screenshots.
    ///
    /// # Errors
    /// [`GpuError::Device`].
    pub fn read(&self, gpu: &Gpu) -> Result<Picture, GpuError> {
        const WHAT: &str = "reading the picture back";
        let failed = |reason: String| GpuError::Device { what: WHAT.to_owned(), reason };
        let [width, height] = self.size;
        let row = width * 4;
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = gpu.guarded(WHAT, || {
            let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("Target::read"),
                size: u64::from(padded) * u64::from(height),
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            });
            let mut encoder =
                gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("Target::read") });
            let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded), rows_per_image: None };
            encoder.copy_texture_to_buffer(
                self.resolved.as_image_copy(),
                wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
                wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            );
            gpu.queue.submit([encoder.finish()]);
            Ok(buffer)
        })?;
        let (send, receive) = std::sync::mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            // The receiver lives until the answer is there.
            send.send(result).unwrap_or_default();
        });
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| failed(e.to_string()))?;
        receive.recv().map_err(|e| failed(e.to_string()))?.map_err(|e| failed(e.to_string()))?;
        let bytes = buffer.get_mapped_range(..).map_err(|e| failed(e.to_string()))?;
        let mut rgba = Vec::with_capacity(bytes.len());
        bytes.chunks_exact(padded as usize).for_each(|padded| rgba.extend_from_slice(&padded[..row as usize]));
        Ok(Picture { size: self.size, rgba })
    }

    /// The nearest size that the device can hold.
    fn possible(gpu: &Gpu, size: [u32; 2]) -> [u32; 2] {
        size.map(|s| s.clamp(1, gpu.device.limits().max_texture_dimension_2d))
    }
}

/// Operations of a pass on an attachment, which it clears first or goes on with.
fn ops<V>(clear: Option<V>, store: wgpu::StoreOp) -> wgpu::Operations<V> {
    wgpu::Operations { load: clear.map_or(wgpu::LoadOp::Load, wgpu::LoadOp::Clear), store }
}

/// Settings of a pass over the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pass {
    /// Clears everything to this color (sRGB, premultiplied) first; without one the picture goes on.
    pub clear: Option<[f32; 4]>,
    /// True where it writes depth; else its shaders may read it.
    pub writes_depth: bool,
    /// True where the picture is finished after it.
    pub last: bool,
}

/// A picture in memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// sRGB and alpha, four bytes per pixel, row by row from the top.
    pub rgba: Vec<u8>,
}

impl Picture {
    /// The color of a pixel; `None` outside.
    pub fn rgb(&self, x: u32, y: u32) -> Option<[u8; 3]> {
        let [width, height] = self.size;
        let start = (y as usize * width as usize + x as usize) * 4;
        (x < width && y < height).then(|| [self.rgba[start], self.rgba[start + 1], self.rgba[start + 2]])
    }
}
