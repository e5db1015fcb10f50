//! The render pipelines, built once per device and shared by all views.

use super::context::{COLOR_FORMAT, DEPTH_FORMAT};
use super::vertex::VERTEX_LAYOUT;
use super::{Gpu, GpuError, shaders, wgpu};

/// All pipelines and the layouts of their bindings.
#[derive(Debug)]
pub struct Pipelines {
    pub(super) view_layout: wgpu::BindGroupLayout,
    /// A uniform.
    pub(super) plain_layout: wgpu::BindGroupLayout,
    /// A uniform and a storage buffer.
    pub(super) pulled_layout: wgpu::BindGroupLayout,
    /// The depth of a target.
    pub(super) depth_layout: wgpu::BindGroupLayout,
    pub(super) points: wgpu::RenderPipeline,
    /// Hides nothing.
    pub(super) points_translucent: wgpu::RenderPipeline,
    /// Hides what is behind it.
    pub(super) mesh_solid: wgpu::RenderPipeline,
    /// Hides nothing.
    pub(super) mesh_xray: wgpu::RenderPipeline,
    pub(super) edges: wgpu::RenderPipeline,
    /// Hidden by nothing.
    pub(super) edges_overlay: wgpu::RenderPipeline,
    pub(super) lines: wgpu::RenderPipeline,
    /// Hidden by nothing.
    pub(super) lines_overlay: wgpu::RenderPipeline,
    /// Darkens what lies behind its neighbors; reads the depth and so has none.
    pub(super) edl: wgpu::RenderPipeline,
}

/// Settings that differ between the pipelines.
struct Variant<'a> {
    label: &'a str,
    module: &'a wgpu::ShaderModule,
    item_layout: &'a wgpu::BindGroupLayout,
    vertices: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    /// Entry point of the fragment stage.
    fragment: &'a str,
    blend: bool,
    depth: Depth,
}

/// Use of depth by a pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Depth {
    /// Tests and writes it.
    Hides,
    /// Tests it alone.
    Tests,
    /// Neither, in a pass that has it.
    Ignores,
    /// None: its pass has no depth.
    Absent,
}

impl Pipelines {
    /// Compiles the shaders and builds every pipeline.
    ///
    /// # Errors
    /// [`GpuError::NoStorage`], [`GpuError::Shader`] with file and line, or [`GpuError::Device`] with the driver's reason: to
    /// be shown in place of the view.
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        if !gpu.storage {
            return Err(GpuError::NoStorage { adapter: gpu.adapter.clone() });
        }
        let compiled = |name| shaders::compile(gpu, name);
        let (points, mesh, edges) = (compiled("points.wgsl")?, compiled("mesh.wgsl")?, compiled("edges.wgsl")?);
        let lines = compiled("lines.wgsl")?;
        let edl = compiled(if gpu.samples > 1 { "edl_many.wgsl" } else { "edl_one.wgsl" })?;
        gpu.guarded("building the render pipelines", || {
            let uniform = binding(0, wgpu::BufferBindingType::Uniform);
            let storage = binding(1, wgpu::BufferBindingType::Storage { read_only: true });
            let layout = |label, entries: &[_]| {
                gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries })
            };
            let view_layout = layout("Pipelines::view_layout", &[uniform]);
            let plain_layout = layout("Pipelines::plain_layout", &[uniform]);
            let pulled_layout = layout("Pipelines::pulled_layout", &[uniform, storage]);
            let depth_layout = layout("Pipelines::depth_layout", &[depth_texture(gpu.samples > 1)]);
            let build = |variant: Variant<'_>| build(gpu, &view_layout, &variant);
            let pulled = Variant {
                label: "Points::pipeline",
                module: &points,
                item_layout: &pulled_layout,
                vertices: &[],
                fragment: "fs_main",
                blend: false,
                depth: Depth::Hides,
            };
            let lit = Variant {
                label: "Mesh::solid",
                module: &mesh,
                item_layout: &plain_layout,
                vertices: &[Some(VERTEX_LAYOUT)],
                blend: true,
                ..pulled
            };
            Ok(Self {
                points: build(Variant { ..pulled }),
                points_translucent: build(Variant {
                    label: "Points::translucent",
                    blend: true,
                    depth: Depth::Tests,
                    ..pulled
                }),
                mesh_solid: build(Variant { ..lit }),
                mesh_xray: build(Variant { label: "Mesh::xray", depth: Depth::Tests, ..lit }),
                edges: build(Variant {
                    label: "Edges::pipeline",
                    module: &edges,
                    blend: true,
                    depth: Depth::Tests,
                    ..pulled
                }),
                edges_overlay: build(Variant {
                    label: "Edges::overlay",
                    module: &edges,
                    fragment: "fs_hidden",
                    blend: true,
                    depth: Depth::Ignores,
                    ..pulled
                }),
                lines: build(Variant { label: "Lines::pipeline", module: &lines, blend: true, ..pulled }),
                lines_overlay: build(Variant {
                    label: "Lines::overlay",
                    module: &lines,
                    blend: true,
                    depth: Depth::Ignores,
                    ..pulled
                }),
                edl: build(Variant {
                    label: "Edl::pipeline",
                    module: &edl,
                    item_layout: &depth_layout,
                    blend: true,
                    depth: Depth::Absent,
                    ..pulled
                }),
                view_layout,
                plain_layout,
                pulled_layout,
                depth_layout,
            })
        })
    }

    /// Binds the uniform of an item, and its storage buffer if it has one.
    pub(super) fn bind(
        &self,
        gpu: &Gpu,
        label: &str,
        uniform: &wgpu::Buffer,
        storage: Option<&wgpu::Buffer>,
    ) -> wgpu::BindGroup {
        let layout = if storage.is_some() { &self.pulled_layout } else { &self.plain_layout };
        let entries: Vec<wgpu::BindGroupEntry<'_>> = [Some(uniform), storage]
            .into_iter()
            .flatten()
            .zip(0..)
            .map(|(buffer, binding)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
    }

    /// Binds the depth of a target.
    pub(super) fn bind_depth(&self, gpu: &Gpu, depth: &wgpu::TextureView) -> wgpu::BindGroup {
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("Edl::depth"),
            layout: &self.depth_layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(depth) }],
        })
    }
}

/// One buffer for both stages.
fn binding(binding: u32, ty: wgpu::BufferBindingType) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    }
}

/// The depth of a target, for the fragment stage.
fn depth_texture(multisampled: bool) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding: 0,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty: wgpu::BindingType::Texture {
            // Not as depth: GL cannot load single pixels of that.
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled,
        },
        count: None,
    }
}

/// Builds one pipeline.
fn build(gpu: &Gpu, view_layout: &wgpu::BindGroupLayout, variant: &Variant<'_>) -> wgpu::RenderPipeline {
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(variant.label),
        bind_group_layouts: &[Some(view_layout), Some(variant.item_layout)],
        immediate_size: 0,
    });
    let compare = match variant.depth {
        Depth::Hides | Depth::Tests => wgpu::CompareFunction::GreaterEqual,
        Depth::Ignores | Depth::Absent => wgpu::CompareFunction::Always,
    };
    let depth_stencil = wgpu::DepthStencilState {
        format: DEPTH_FORMAT,
        depth_write_enabled: Some(variant.depth == Depth::Hides),
        depth_compare: Some(compare),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    };
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(variant.label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: variant.module,
            entry_point: Some("vs_main"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: variant.vertices,
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: (variant.depth != Depth::Absent).then_some(depth_stencil),
        multisample: wgpu::MultisampleState { count: gpu.samples, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module: variant.module,
            entry_point: Some(variant.fragment),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format: COLOR_FORMAT,
                blend: variant.blend.then_some(OVER),
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// Blends colors by alpha; the picture itself stays opaque.
const OVER: wgpu::BlendState =
    wgpu::BlendState { color: wgpu::BlendState::ALPHA_BLENDING.color, alpha: wgpu::BlendComponent::OVER };
