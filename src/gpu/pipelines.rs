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
    pub(super) floor_layout: wgpu::BindGroupLayout,
    pub(super) floor_sampler: wgpu::Sampler,
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
    /// Darkens what lies behind its neighbors; reads the depth and so writes none.
    pub(super) edl: wgpu::RenderPipeline,
    /// Darkens what lies in a hollow, the same way.
    pub(super) hollows: wgpu::RenderPipeline,
}

/// Settings that differ between the pipelines.
#[derive(Clone, Copy)]
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
    /// Draws where there is something, and may read how deep that is.
    Covered,
}

impl Pipelines {
    /// Compiles the shaders and builds every pipeline.
    ///
    /// # Errors
    /// [`GpuError::NoStorage`], or [`GpuError::Device`] with the driver's reason: to be shown in place of the view.
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        if !gpu.storage {
            return Err(GpuError::NoStorage { adapter: gpu.adapter.clone() });
        }
        let compiled = |label, text| shaders::compile(gpu, label, text);
        let (points, mesh) = (compiled("points", shaders::POINTS)?, compiled("mesh", shaders::MESH)?);
        let (lines, edges) = (compiled("lines", shaders::LINES)?, compiled("edges", shaders::EDGES)?);
        let (floor, shadow) = (compiled("floor", shaders::FLOOR)?, compiled("shadow", shaders::SHADOW)?);
        let edl = compiled("edl", if gpu.samples > 1 { shaders::EDL_MANY } else { shaders::EDL_ONE })?;
        gpu.guarded("building the render pipelines", || {
            let uniform = binding(0, wgpu::BufferBindingType::Uniform);
            let storage = binding(1, wgpu::BufferBindingType::Storage { read_only: true });
            let layout = |label, entries: &[_]| gpu.layout(label, entries);
            let view_layout = layout("Pipelines::view_layout", &[uniform]);
            let plain_layout = layout("Pipelines::plain_layout", &[uniform]);
            let pulled_layout = layout("Pipelines::pulled_layout", &[uniform, storage]);
            let depth_layout = layout("Pipelines::depth_layout", &[texture(0, false, gpu.samples > 1)]);
            let picture_layout = layout("Pipelines::picture_layout", &[texture(0, false, false)]);
            let floor_layout = layout("Pipelines::floor_layout", &[uniform, texture(1, true, false), sampler(2)]);
            let thrown = |label, item_layout, vertices, stages| {
                let (module, layouts) = (&shadow, &[&view_layout, item_layout][..]);
                let (target, depth, samples) = (SHADOW_FORMAT.into(), None, 1);
                PipelineParts { label, module, stages, layouts, vertices, target, depth, samples }.build(gpu)
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
            // Hides nothing.
            let over = Variant { blend: true, depth: Depth::Tests, stencil: Stencil::Unused, ..pulled };
            let vertices = &[Some(VERTEX_LAYOUT)];
            let lit = Variant { label: "Mesh::solid", module: &mesh, item_layout: &plain_layout, vertices, ..pulled };
            let lit = Variant { blend: true, ..lit };
            let veil = |label, fragment, depth, stencil| build(Variant { label, fragment, depth, stencil, ..lit });
            let edge = Variant { label: "Edges::pipeline", module: &edges, ..over };
            let line = Variant { label: "Lines::pipeline", module: &lines, ..over };
            let screen = Variant { label: "Edl::pipeline", module: &edl, item_layout: &depth_layout, ..pulled };
            let screen = Variant { blend: true, depth: Depth::Covered, stencil: Stencil::Unused, ..screen };
            let hidden = Variant { label: "Edges::overlay", fragment: "fs_hidden", depth: Depth::Ignores, ..edge };
            Ok(Self {
                points: build(pulled),
                points_translucent: build(Variant { label: "Points::translucent", ..over }),
                mesh_solid: build(lit),
                mesh_xray: build(Variant { label: "Mesh::xray", depth: Depth::Tests, stencil: Stencil::Unused, ..lit }),
                veil: [
                    veil("Veil::depth", "fs_depth", Depth::Only, Stencil::Unused),
                    veil("Veil::beside", "fs_veil", Depth::Equals, Stencil::Beside),
                    veil("Veil::before", "fs_veil_thin", Depth::Equals, Stencil::Before),
                ],
                floor: build(Variant { label: "Floor::pipeline", module: &floor, item_layout: &floor_layout, ..over }),
                shadow: thrown("Shadow::pipeline", &plain_layout, vertices, ["vs_main", "fs_main"]),
                shadow_across: thrown("Shadow::across", &picture_layout, &[], ["vs_blur", "fs_across"]),
                shadow_down: thrown("Shadow::down", &picture_layout, &[], ["vs_blur", "fs_down"]),
                edges: build(Variant { stencil: Stencil::Marks, ..edge }),
                edges_overlay: build(hidden),
                lines: build(line),
                lines_overlay: build(Variant { label: "Lines::overlay", depth: Depth::Ignores, ..line }),
                edl: build(screen),
                hollows: build(Variant { label: "Edl::hollows", fragment: "fs_hollows", ..screen }),
                floor_sampler: gpu.sampler("Floor::sampler", wgpu::FilterMode::Linear),
                view_layout,
                plain_layout,
                pulled_layout,
                depth_layout,
                picture_layout,
                floor_layout,
            })
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

/// A picture for the fragment stage; `filterable` where it is read between its pixels. The depth of a target is one, too:
/// GL cannot load single pixels of depth.
pub(super) fn texture(binding: u32, filterable: bool, multisampled: bool) -> wgpu::BindGroupLayoutEntry {
    let sample_type = wgpu::TextureSampleType::Float { filterable };
    let view_dimension = wgpu::TextureViewDimension::D2;
    let ty = wgpu::BindingType::Texture { sample_type, view_dimension, multisampled };
    wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::FRAGMENT, ty, count: None }
}

/// Entry of a sampler for fragments.
pub(super) fn sampler(binding: u32) -> wgpu::BindGroupLayoutEntry {
    let ty = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::FRAGMENT, ty, count: None }
}

/// Parts of a pipeline.
pub(super) struct PipelineParts<'a> {
    pub(super) label: &'a str,
    pub(super) module: &'a wgpu::ShaderModule,
    /// Entry points of the vertex and the fragment stage.
    pub(super) stages: [&'a str; 2],
    pub(super) layouts: &'a [&'a wgpu::BindGroupLayout],
    pub(super) vertices: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    pub(super) target: wgpu::ColorTargetState,
    pub(super) depth: Option<wgpu::DepthStencilState>,
    pub(super) samples: u32,
}

impl PipelineParts<'_> {
    pub(super) fn build(self, gpu: &Gpu) -> wgpu::RenderPipeline {
        let (label, module) = (Some(self.label), self.module);
        let layouts: Vec<_> = self.layouts.iter().copied().map(Some).collect();
        let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label,
            bind_group_layouts: &layouts,
            immediate_size: 0,
        });
        let [vertex, fragment] = self.stages.map(Some);
        let compilation_options = wgpu::PipelineCompilationOptions::default();
        gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label,
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module,
                entry_point: vertex,
                compilation_options: compilation_options.clone(),
                buffers: self.vertices,
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: self.depth,
            multisample: wgpu::MultisampleState { count: self.samples, ..Default::default() },
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: fragment,
                compilation_options,
                targets: &[Some(self.target)],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
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
    let compare = match variant.depth {
        Depth::Hides | Depth::Only | Depth::Tests => wgpu::CompareFunction::GreaterEqual,
        Depth::Equals => wgpu::CompareFunction::Equal,
        Depth::Covered => wgpu::CompareFunction::Less,
        Depth::Ignores => wgpu::CompareFunction::Always,
    };
    let depth = wgpu::DepthStencilState {
        format: DEPTH_FORMAT,
        depth_write_enabled: Some(matches!(variant.depth, Depth::Hides | Depth::Only)),
        depth_compare: Some(compare),
        stencil: stencil_state(variant.stencil),
        bias: wgpu::DepthBiasState::default(),
    };
    let write_mask = match variant.depth {
        Depth::Only => wgpu::ColorWrites::empty(),
        _ => wgpu::ColorWrites::ALL,
    };
    PipelineParts {
        label: variant.label,
        module: variant.module,
        stages: ["vs_main", variant.fragment],
        layouts: &[view_layout, variant.item_layout],
        vertices: variant.vertices,
        target: wgpu::ColorTargetState { format: COLOR_FORMAT, blend: variant.blend.then_some(OVER), write_mask },
        depth: Some(depth),
        samples: gpu.samples,
    }
    .build(gpu)
}

/// Blends colors by alpha; the picture itself stays as opaque as its ground.
const OVER: wgpu::BlendState =
    wgpu::BlendState { color: wgpu::BlendState::ALPHA_BLENDING.color, alpha: wgpu::BlendComponent::OVER };
