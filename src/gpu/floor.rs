//! The floor below a scene, with the soft shadow of what stands over it. The shadow lies on the floor, so that it is drawn when
//! something on it moves and not when the camera does.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use super::buffer::Uniform;
use super::context::{SHADOW_FORMAT, begin_color};
use super::pipelines::Pipelines;
use super::{Gpu, wgpu};

/// A floor to be shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Floor {
    /// The middle, meters, world; the floor is level.
    pub center: DVec3,
    /// Half its width, meters.
    pub reach_m: f64,
    /// sRGB, 0..1.
    pub color: [f32; 3],
    /// 0..1 in the middle; at 0 only the shadow is seen.
    pub opacity: f32,
    /// 0..1, opacity of the deepest shadow.
    pub shadow: f32,
}

/// Pixels of the shadow along one side.
const SIDE: u32 = 256;
/// Towards the light that throws the shadow, world: from above (negative z) and a little from the side.
const LIGHT: [f32; 3] = [-0.25, -0.35, -1.0];

/// Twin of the struct in `shaders/common/floor.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct FloorUniform {
    pub(super) color: [f32; 4],
    pub(super) center: [f32; 4],
    pub(super) light: [f32; 4],
    pub(super) shadow: f32,
}

/// Something that throws a shadow: its name, the revision of its mesh, and its pose.
pub(super) type Caster = (String, u64, [f32; 16]);

/// A floor on the device.
#[derive(Debug)]
pub(super) struct FloorData {
    uniform: Uniform<FloorUniform>,
    /// The floor alone, as the shadow's shaders take it.
    ground: wgpu::BindGroup,
    /// Floor and shadow.
    shown: wgpu::BindGroup,
    shadow: [wgpu::TextureView; 2],
    blurred: [wgpu::BindGroup; 2],
    thrown_by: Option<Vec<Caster>>,
}

impl FloorData {
    /// A floor without a shadow yet.
    pub(super) fn new(gpu: &Gpu, pipelines: &Pipelines) -> Self {
        let uniform: Uniform<FloorUniform> = Uniform::new(gpu, "Floor::uniform");
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
        let texture = |label| {
            let texture = gpu.texture(label, [SIDE; 2], SHADOW_FORMAT, 1, usage);
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        };
        let shadow = [texture("Floor::shadow"), texture("Floor::blurred")];
        let blurred = [&shadow[0], &shadow[1]].map(|view| {
            gpu.bind("Floor::blur", &pipelines.picture_layout, &[wgpu::BindingResource::TextureView(view)])
        });
        let buffer = uniform.buffer.as_entire_binding();
        let ground = gpu.bind("Floor::ground", &pipelines.view_layout, std::slice::from_ref(&buffer));
        let shown = [
            buffer,
            wgpu::BindingResource::TextureView(&shadow[0]),
            wgpu::BindingResource::Sampler(&pipelines.floor_sampler),
        ];
        let shown = gpu.bind("Floor::shown", &pipelines.floor_layout, &shown);
        Self { uniform, ground, shown, shadow, blurred, thrown_by: None }
    }

    /// Takes over what changed; returns whether numbers did.
    pub(super) fn update(&mut self, gpu: &Gpu, floor: &Floor) -> bool {
        let [r, g, b] = floor.color;
        let [x, y, z] = floor.center.as_vec3().to_array();
        let written = self.uniform.set(
            gpu,
            FloorUniform {
                color: [r, g, b, floor.opacity.clamp(0.0, 1.0)],
                center: [x, y, z, (floor.reach_m as f32).max(1e-4)],
                light: [LIGHT[0], LIGHT[1], LIGHT[2], 0.0],
                shadow: floor.shadow.clamp(0.0, 1.0),
            },
        );
        if written {
            self.thrown_by = None;
        }
        written
    }

    /// Draws the shadow of these casters, if it is not theirs already; `draw` draws one by its name.
    pub(super) fn throw(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        pipelines: &Pipelines,
        casters: &[Caster],
        draw: impl Fn(&mut wgpu::RenderPass<'_>, &str),
    ) {
        if self.thrown_by.as_deref() == Some(casters) {
            return;
        }
        let clear = wgpu::LoadOp::Clear(wgpu::Color::BLACK);
        {
            let mut pass = begin_color(encoder, "Floor::pass", &self.shadow[0], clear);
            pass.set_pipeline(&pipelines.shadow);
            pass.set_bind_group(0, &self.ground, &[]);
            for (name, ..) in casters {
                draw(&mut pass, name);
            }
        }
        for (from, to, pipeline) in [(0, 1, &pipelines.shadow_across), (1, 0, &pipelines.shadow_down)] {
            let mut pass = begin_color(encoder, "Floor::pass", &self.shadow[to], clear);
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &self.ground, &[]);
            pass.set_bind_group(1, &self.blurred[from], &[]);
            pass.draw(0..6, 0..1);
        }
        self.thrown_by = Some(casters.to_vec());
    }

    /// Draws with the view bound to group 0.
    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_bind_group(1, &self.shown, &[]);
        pass.draw(0..6, 0..1);
    }
}
