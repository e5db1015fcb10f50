//! Flat triangles into a picture that stays: what the window's toolkit draws, at what a software renderer can do fast.
//!
//! The cost is that of the fragments: one color without a texture costs a fraction of a sampled one.

use std::collections::BTreeMap;
use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use super::buffer::Elements;
use super::context::begin_color;
use super::pipelines::{PipelineParts, sampler, texture};
use super::{Gpu, GpuError, shaders, wgpu};

/// A corner of a triangle.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Corner {
    /// Clip space: -1 to 1 from left to right and from bottom to top.
    pub at: [f32; 2],
    /// Place in the texture, 0 to 1.
    pub uv: [f32; 2],
    /// Premultiplied and sRGB-encoded.
    pub color: [u8; 4],
}

/// Fill of triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fill {
    /// By the colors of their corners.
    Flat,
    /// By the texture of this key times the colors of their corners.
    Textured(u64),
}

/// Triangles in a row that are filled alike.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Left, top, width and height of what may be painted, pixels.
    pub scissor: [u32; 4],
    /// Their corners in the list of indices.
    pub indices: Range<u32>,
    /// Fill of the triangles.
    pub fill: Fill,
}

/// Pipelines and textures.
#[derive(Debug)]
pub struct Raster {
    layout: wgpu::BindGroupLayout,
    flat: wgpu::RenderPipeline,
    textured: wgpu::RenderPipeline,
    whole: wgpu::RenderPipeline,
    samplers: [wgpu::Sampler; 2],
    textures: BTreeMap<u64, Texture>,
    corners: Option<wgpu::Buffer>,
    indices: Option<wgpu::Buffer>,
}

#[derive(Debug)]
struct Texture {
    /// `None` for what somebody else draws.
    own: Option<wgpu::Texture>,
    bindings: wgpu::BindGroup,
}

/// A picture of the window's size, and how it is put on the window.
#[derive(Clone, Debug)]
pub struct FramePicture {
    /// Width and height, pixels.
    pub size: [u32; 2],
    view: wgpu::TextureView,
    bindings: wgpu::BindGroup,
    pipeline: wgpu::RenderPipeline,
}

impl FramePicture {
    /// Width and height, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Copies the picture to the viewport of a pass.
    pub fn copy(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bindings, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// Premultiplied colors over what is there.
const OVER: wgpu::BlendState = wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING;

impl Raster {
    /// For pictures and a window of `format`.
    ///
    /// # Errors
    /// [`GpuError::Device`].
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat) -> Result<Self, GpuError> {
        let module = shaders::compile(gpu, "raster", shaders::RASTER)?;
        gpu.guarded("building the pipelines of the window", || {
            let layout = gpu.layout("Raster::layout", &[texture(0, true, false), sampler(1)]);
            let corners = [Some(wgpu::VertexBufferLayout {
                array_stride: size_of::<Corner>() as u64,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &wgpu::vertex_attr_array![0 => Float32x2, 1 => Float32x2, 2 => Unorm8x4],
            })];
            let build = |label, stages: [&str; 2], bound: bool, blend| {
                let (layouts, vertices) =
                    (&[&layout][..usize::from(bound)], &corners[..usize::from(stages[0] == "vs_main")]);
                let target = wgpu::ColorTargetState { format, blend, write_mask: wgpu::ColorWrites::ALL };
                let (module, depth, samples) = (&module, None, 1);
                PipelineParts { label, module, stages, layouts, vertices, target, depth, samples }.build(gpu)
            };
            Ok(Self {
                flat: build("Raster::flat", ["vs_main", "fs_flat"], false, Some(OVER)),
                textured: build("Raster::textured", ["vs_main", "fs_tinted"], true, Some(OVER)),
                whole: build("Raster::whole", ["vs_whole", "fs_copied"], true, None),
                samplers: [wgpu::FilterMode::Linear, wgpu::FilterMode::Nearest]
                    .map(|filter| gpu.sampler("Raster::sampler", filter)),
                layout,
                textures: BTreeMap::new(),
                corners: None,
                indices: None,
            })
        })
    }

    /// Paints one pixel, so that a device which cannot is known before anything is left to it.
    ///
    /// # Errors
    /// As [`Self::paint`].
    pub fn prove(&mut self, gpu: &Gpu, format: wgpu::TextureFormat) -> Result<(), GpuError> {
        let corner = |at| Corner { at, uv: [0.0; 2], color: [0, 0, 0, 255] };
        let corners = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0]].map(corner);
        let run = Run { scissor: [0, 0, 1, 1], indices: 0..3, fill: Fill::Flat };
        let picture = self.picture(gpu, [1, 1], format);
        self.paint(gpu, &picture, &corners, &[0, 1, 2], &[run])
    }

    fn bind(&self, gpu: &Gpu, view: &wgpu::TextureView, nearest: bool) -> wgpu::BindGroup {
        let sampler = wgpu::BindingResource::Sampler(&self.samplers[usize::from(nearest)]);
        gpu.bind("Raster::texture", &self.layout, &[wgpu::BindingResource::TextureView(view), sampler])
    }

    /// An empty picture of `size` pixels and `format`, which must be that of the raster.
    pub fn picture(&self, gpu: &Gpu, size: [u32; 2], format: wgpu::TextureFormat) -> FramePicture {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
        let texture = gpu.texture("Raster::picture", size.map(|s| s.max(1)), format, 1, usage);
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let bindings = self.bind(gpu, &view, true);
        FramePicture { size, view, bindings, pipeline: self.whole.clone() }
    }

    /// Makes or replaces a texture of `size` pixels, row by row; `rgba` premultiplied.
    pub fn set(&mut self, gpu: &Gpu, key: u64, size: [u32; 2], rgba: &[u8], nearest: bool) {
        let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
        let format = wgpu::TextureFormat::Rgba8Unorm;
        let own = gpu.texture("Raster::texture", size.map(|s| s.max(1)), format, 1, usage);
        write(gpu, &own, [0; 2], size, rgba);
        let bindings = self.bind(gpu, &own.create_view(&wgpu::TextureViewDescriptor::default()), nearest);
        self.textures.insert(key, Texture { own: Some(own), bindings });
    }

    /// Writes a part of a texture at `place`; returns whether there is such a texture.
    pub(crate) fn set_part(&self, gpu: &Gpu, key: u64, place: [u32; 2], size: [u32; 2], rgba: &[u8]) -> bool {
        let Some(texture) = self.textures.get(&key) else { return false };
        let Some(own) = &texture.own else { return false };
        write(gpu, own, place, size, rgba);
        true
    }

    /// A texture that somebody else draws.
    pub fn show(&mut self, gpu: &Gpu, key: u64, view: &wgpu::TextureView) {
        let bindings = self.bind(gpu, view, false);
        self.textures.insert(key, Texture { own: None, bindings });
    }

    /// Frees a texture.
    pub fn free(&mut self, key: u64) {
        self.textures.remove(&key);
    }

    /// Paints into a picture, over what is there.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] and [`GpuError::Device`].
    pub fn paint(
        &mut self,
        gpu: &Gpu,
        picture: &FramePicture,
        corners: &[Corner],
        indices: &[u32],
        runs: &[Run],
    ) -> Result<(), GpuError> {
        gpu.guarded("painting the window", || {
            let usage = wgpu::BufferUsages::VERTEX;
            let corners = Elements::upload(gpu, "Raster::corners", corners, usage, self.corners.take())?;
            let usage = wgpu::BufferUsages::INDEX;
            let indices = Elements::upload(gpu, "Raster::indices", indices, usage, self.indices.take())?;
            let label = Some("Raster::encoder");
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label });
            {
                let load = wgpu::LoadOp::Load;
                let mut pass = begin_color(&mut encoder, "Raster::pass", &picture.view, load);
                pass.set_vertex_buffer(0, corners.buffer.slice(..));
                pass.set_index_buffer(indices.buffer.slice(..), wgpu::IndexFormat::Uint32);
                for run in runs {
                    match run.fill {
                        Fill::Flat => pass.set_pipeline(&self.flat),
                        Fill::Textured(key) => {
                            let Some(texture) = self.textures.get(&key) else { continue };
                            pass.set_pipeline(&self.textured);
                            pass.set_bind_group(0, &texture.bindings, &[]);
                        }
                    }
                    let [x, y, width, height] = run.scissor;
                    pass.set_scissor_rect(x, y, width, height);
                    pass.draw_indexed(run.indices.clone(), 0, 0..1);
                }
            }
            gpu.queue.submit([encoder.finish()]);
            (self.corners, self.indices) = (Some(corners.buffer), Some(indices.buffer));
            Ok(())
        })
    }
}

/// A texture of at least one pixel.
fn write(gpu: &Gpu, texture: &wgpu::Texture, [x, y]: [u32; 2], [width, height]: [u32; 2], rgba: &[u8]) {
    let origin = wgpu::Origin3d { x, y, z: 0 };
    gpu.queue.write_texture(
        wgpu::TexelCopyTextureInfo { texture, mip_level: 0, origin, aspect: wgpu::TextureAspect::All },
        rgba,
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * width), rows_per_image: None },
        wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
    );
}
