//! The render pipelines, built once per device and shared by all views.

use super::context::{COLOR_FORMAT, DEPTH_FORMAT, SHADOW_FORMAT};
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
    /// A picture of one sample per pixel.
    pub(super) picture_layout: wgpu::BindGroupLayout,
    /// A uniform, a picture and its sampler.
    floor_layout: wgpu::BindGroupLayout,
    floor_sampler: wgpu::Sampler,
    pub(super) floor: wgpu::RenderPipeline,
    /// The shadow on the floor, and its blur in both directions.
    pub(super) shadow: wgpu::RenderPipeline,
    pub(super) shadow_across: wgpu::RenderPipeline,
    pub(super) shadow_down: wgpu::RenderPipeline,
    pub(super) points: wgpu::RenderPipeline,
    /// Hides nothing.
    pub(super) points_translucent: wgpu::RenderPipeline,
    /// Hides what is behind it.
    pub(super) mesh_solid: wgpu::RenderPipeline,
    /// Hides nothing.
    pub(super) mesh_xray: wgpu::RenderPipeline,
    /// The depth of veils, then their nearest layer before nothing solid, and before something.
    pub(super) veil: [wgpu::RenderPipeline; 3],
    pub(super) edges: wgpu::RenderPipeline,
    /// Hidden by nothing.
    pub(super) edges_overlay: wgpu::RenderPipeline,
    pub(super) lines: wgpu::RenderPipeline,
    /// Hidden by nothing.
    pub(super) lines_overlay: wgpu::RenderPipeline,
    /// Darkens what lies behind its neighbors; reads the depth and so has none.
    pub(super) edl: wgpu::RenderPipeline,
    /// Darkens what lies in a hollow, the same way.
    pub(super) hollows: wgpu::RenderPipeline,
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
    stencil: Stencil,
}

/// Use of the stencil by a pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stencil {
    /// None.
    Unused,
    /// Says that something solid is here.
    Marks,
    /// Draws where nothing solid is.
    Beside,
    /// Draws where something solid is.
    Before,
}

/// Use of depth by a pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Depth {
    /// Tests and writes it.
    Hides,
    /// Tests and writes it, and no color.
    Only,
    /// Tests it alone.
    Tests,
    /// Draws only what is at just this depth.
    Equals,
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
        let (lines, floor, shadow) = (compiled("lines.wgsl")?, compiled("floor.wgsl")?, compiled("shadow.wgsl")?);
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
            let picture_layout = layout("Pipelines::picture_layout", &[depth_texture(false)]);
            let floor_layout = layout("Pipelines::floor_layout", &[uniform, filtered_texture(1), sampler(2)]);
            let thrown = |label, item_layout: &_, vertices: &[_], vertex, fragment| {
                let layouts = [&view_layout, item_layout];
                build_shadow(gpu, label, layouts, &shadow, vertices, [vertex, fragment])
            };
            let build = |variant: Variant<'_>| build(gpu, &view_layout, &variant);
            let pulled = Variant {
                label: "Points::pipeline",
                module: &points,
                item_layout: &pulled_layout,
                vertices: &[],
                fragment: "fs_main",
                blend: false,
                depth: Depth::Hides,
                stencil: Stencil::Marks,
            };
            let lit = Variant {
                label: "Mesh::solid",
                module: &mesh,
                item_layout: &plain_layout,
                vertices: &[Some(VERTEX_LAYOUT)],
                blend: true,
                ..pulled
            };
            let screen = Variant {
                label: "Edl::pipeline",
                module: &edl,
                item_layout: &depth_layout,
                blend: true,
                depth: Depth::Absent,
                ..pulled
            };
            let veil = |label, fragment, depth, stencil| build(Variant { label, fragment, depth, stencil, ..lit });
            Ok(Self {
                points: build(Variant { ..pulled }),
                points_translucent: build(Variant {
                    label: "Points::translucent",
                    blend: true,
                    depth: Depth::Tests,
                    stencil: Stencil::Unused,
                    ..pulled
                }),
                mesh_solid: build(Variant { ..lit }),
                mesh_xray: build(Variant { label: "Mesh::xray", depth: Depth::Tests, stencil: Stencil::Unused, ..lit }),
                veil: [
                    veil("Veil::depth", "fs_depth", Depth::Only, Stencil::Unused),
                    veil("Veil::beside", "fs_veil", Depth::Equals, Stencil::Beside),
                    veil("Veil::before", "fs_veil_thin", Depth::Equals, Stencil::Before),
                ],
                floor: build(Variant {
                    label: "Floor::pipeline",
                    module: &floor,
                    item_layout: &floor_layout,
                    blend: true,
                    depth: Depth::Tests,
                    stencil: Stencil::Unused,
                    ..pulled
                }),
                shadow: thrown("Shadow::pipeline", &plain_layout, &[Some(VERTEX_LAYOUT)], "vs_main", "fs_main"),
                shadow_across: thrown("Shadow::across", &picture_layout, &[], "vs_blur", "fs_across"),
                shadow_down: thrown("Shadow::down", &picture_layout, &[], "vs_blur", "fs_down"),
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
                    stencil: Stencil::Unused,
                    ..pulled
                }),
                lines: build(Variant {
                    label: "Lines::pipeline",
                    module: &lines,
                    blend: true,
                    depth: Depth::Tests,
                    stencil: Stencil::Unused,
                    ..pulled
                }),
                lines_overlay: build(Variant {
                    label: "Lines::overlay",
                    module: &lines,
                    blend: true,
                    depth: Depth::Ignores,
                    stencil: Stencil::Unused,
                    ..pulled
                }),
                edl: build(Variant { ..screen }),
                hollows: build(Variant { label: "Edl::hollows", fragment: "fs_hollows", ..screen }),
                floor_sampler: gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                    label: Some("Floor::sampler"),
                    mag_filter: wgpu::FilterMode::Linear,
                    min_filter: wgpu::FilterMode::Linear,
                    ..Default::default()
                }),
                view_layout,
                plain_layout,
                pulled_layout,
                depth_layout,
                picture_layout,
                floor_layout,
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

    /// Binds a floor with its shadow.
    pub(super) fn bind_floor(&self, gpu: &Gpu, uniform: &wgpu::Buffer, shadow: &wgpu::TextureView) -> wgpu::BindGroup {
        let entries = [
            uniform.as_entire_binding(),
            wgpu::BindingResource::TextureView(shadow),
            wgpu::BindingResource::Sampler(&self.floor_sampler),
        ];
        let entries: Vec<_> =
            (0..).zip(entries).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        let (label, layout) = (Some("Floor::shown"), &self.floor_layout);
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label, layout, entries: &entries })
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

/// A picture that is read between its pixels, for the fragment stage.
fn filtered_texture(binding: u32) -> wgpu::BindGroupLayoutEntry {
    let ty = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::FRAGMENT, ty, count: None }
}

/// Entry of a sampler for fragments.
fn sampler(binding: u32) -> wgpu::BindGroupLayoutEntry {
    let ty = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::FRAGMENT, ty, count: None }
}

/// Builds a pipeline of the shadow: into its own small picture, without depth.
fn build_shadow(
    gpu: &Gpu,
    label: &str,
    layouts: [&wgpu::BindGroupLayout; 2],
    module: &wgpu::ShaderModule,
    vertices: &[Option<wgpu::VertexBufferLayout<'_>>],
    [vertex, fragment]: [&str; 2],
) -> wgpu::RenderPipeline {
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: &layouts.map(Some),
        immediate_size: 0,
    });
    let compilation_options = wgpu::PipelineCompilationOptions::default();
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(vertex),
            compilation_options: compilation_options.clone(),
            buffers: vertices,
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(fragment),
            compilation_options,
            targets: &[Some(SHADOW_FORMAT.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// The stencil of a pipeline; the reference is 1.
fn stencil_state(stencil: Stencil) -> wgpu::StencilState {
    let keep = wgpu::StencilFaceState::IGNORE;
    let compare = |compare| wgpu::StencilFaceState { compare, ..keep };
    let face = match stencil {
        Stencil::Unused => keep,
        Stencil::Marks => wgpu::StencilFaceState { pass_op: wgpu::StencilOperation::Replace, ..keep },
        Stencil::Beside => compare(wgpu::CompareFunction::NotEqual),
        Stencil::Before => compare(wgpu::CompareFunction::Equal),
    };
    wgpu::StencilState { front: face, back: face, read_mask: 0xff, write_mask: 0xff }
}

/// Builds one pipeline.
fn build(gpu: &Gpu, view_layout: &wgpu::BindGroupLayout, variant: &Variant<'_>) -> wgpu::RenderPipeline {
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(variant.label),
        bind_group_layouts: &[Some(view_layout), Some(variant.item_layout)],
        immediate_size: 0,
    });
    let compare = match variant.depth {
        Depth::Hides | Depth::Only | Depth::Tests => wgpu::CompareFunction::GreaterEqual,
        Depth::Equals => wgpu::CompareFunction::Equal,
        Depth::Ignores | Depth::Absent => wgpu::CompareFunction::Always,
    };
    let depth_stencil = wgpu::DepthStencilState {
        format: DEPTH_FORMAT,
        depth_write_enabled: Some(matches!(variant.depth, Depth::Hides | Depth::Only)),
        depth_compare: Some(compare),
        stencil: stencil_state(variant.stencil),
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
                write_mask: match variant.depth {
                    Depth::Only => wgpu::ColorWrites::empty(),
                    _ => wgpu::ColorWrites::ALL,
                },
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// Blends colors by alpha; the picture itself stays as opaque as its ground.
const OVER: wgpu::BlendState =
    wgpu::BlendState { color: wgpu::BlendState::ALPHA_BLENDING.color, alpha: wgpu::BlendComponent::OVER };
