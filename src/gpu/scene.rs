//! A scene, and the renderer of one view of it.
//!
//! Draw order: the floor, lines, opaque meshes and their edges, points; shading by depth; outlines, veils, what is
//! translucent, x-ray meshes; outlines behind something, overlay lines.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::Vec4;

use super::buffer::Uniform;
use super::floor::{Caster, Floor, FloorData};
use super::lines::{LinesData, LinesItem};
use super::mesh::{Look, MeshData, MeshItem};
use super::pipelines::Pipelines;
use super::points::{CloudItem, PointsData};
use super::target::{Pass, Target};
use super::view::{self, Camera, Part, ViewUniform};
use super::{Gpu, GpuError, wgpu};

with_defaults! {
    /// Everything that one view shows. Cheap to make anew for every frame: the geometry is shared.
    #[derive(Clone, Debug)]
    pub struct SceneData {
        /// sRGB, 0..1.
        pub background: [f32; 3] = [0.1, 0.11, 0.13],
        /// Point clouds, with different names.
        pub clouds: Vec<CloudItem> = vec![],
        /// Meshes, with different names.
        pub meshes: Vec<MeshItem> = vec![],
        /// Lines, with different names.
        pub lines: Vec<LinesItem> = vec![],
        /// The floor, with the shadow of solid meshes.
        pub floor: Option<Floor> = None,
        /// True where the background is left out: what nothing covers has no opacity.
        pub transparent: bool = false,
        /// Pixels that stand for one of a screen: widths and sizes in pixels are drawn so many times as large.
        pub unit_px: f32 = 1.0,
        /// True where what lies behind its neighbors or in a hollow is darkened (eye-dome lighting, ambient occlusion).
        pub eye_dome: bool = false,
        /// The camera is being moved: only so many points are drawn as [`SceneRenderer::moving_points`] allows.
        pub moving: bool = false,
    }
}

/// Counts of what a renderer has done since it was made: proof that nothing is done twice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Geometry sent to the device, items.
    pub uploads: u64,
    /// Small blocks of numbers (camera, pose, colors) sent to the device.
    pub uniforms: u64,
    /// Pictures drawn.
    pub renders: u64,
}

/// Draws one view. Every view has its own.
#[derive(Debug)]
pub struct SceneRenderer {
    /// Points drawn while the camera moves, over all clouds: every n-th, so that orbiting stays smooth. Preset by
    /// what draws them: a million on a graphics card, 20 thousand (about 15 ms on two cores) in software.
    pub moving_points: u32,
    pipelines: Arc<Pipelines>,
    view: Uniform<ViewUniform>,
    view_bindings: wgpu::BindGroup,
    clouds: BTreeMap<String, PointsData>,
    meshes: BTreeMap<String, MeshData>,
    lines: BTreeMap<String, LinesData>,
    floor: Option<FloorData>,
    /// The depth of the target of this generation.
    depth: Option<(u64, wgpu::BindGroup)>,
    shown: Option<Shown>,
    counters: Counters,
}

/// State that the picture was drawn from, apart from the contents of the buffers.
#[derive(Clone, Debug, PartialEq)]
struct Shown {
    target: u64,
    background: [f32; 4],
    eye_dome: bool,
    moving: bool,
    casters: Vec<Caster>,
    order: Vec<(Layer, String)>,
}

/// When an item is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Layer {
    Floor,
    Lines,
    OpaqueMesh,
    Edges,
    Points,
    /// From here on nothing is shaded by its depth.
    Outline,
    VeilDepth,
    VeilBeside,
    VeilBefore,
    TranslucentMesh,
    TranslucentPoints,
    XRayMesh,
    /// From here on over everything.
    HiddenOutline,
    OverlayLines,
}

impl SceneRenderer {
    /// A renderer that has drawn nothing yet.
    ///
    /// # Errors
    /// [`GpuError::Device`].
    pub fn new(gpu: &Gpu, pipelines: Arc<Pipelines>) -> Result<Self, GpuError> {
        gpu.guarded("preparing a 3D view", || {
            let view: Uniform<ViewUniform> = Uniform::new(gpu, "Scene::view");
            let buffer = view.buffer.as_entire_binding();
            let view_bindings = gpu.bind("Scene::view", &pipelines.view_layout, &[buffer]);
            Ok(Self {
                moving_points: if gpu.software { 20_000 } else { 1_000_000 },
                pipelines,
                view,
                view_bindings,
                clouds: BTreeMap::new(),
                meshes: BTreeMap::new(),
                lines: BTreeMap::new(),
                floor: None,
                depth: None,
                shown: None,
                counters: Counters::default(),
            })
        })
    }

    /// Counts so far.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Brings the picture in `target`, which has the size of the part of the picture, up to date; returns whether it had to be
    /// drawn.
    ///
    /// Does nothing at all if scene, camera and target are as they were at the last call. A target must not be drawn
    /// into by two renderers.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] and [`GpuError::Device`]; the next call starts afresh.
    pub fn render(
        &mut self,
        gpu: &Gpu,
        scene: &SceneData,
        (camera, part): (&Camera, Part),
        target: &Target,
    ) -> Result<bool, GpuError> {
        let before = self.shown.take();
        let result = gpu.guarded("drawing a 3D view", || {
            let (changed, shown) = self.update(gpu, scene, (camera, part), target)?;
            if !changed && before.as_ref() == Some(&shown) {
                return Ok((shown, false));
            }
            // In passes, with the shading by depth between them: hollows in the meshes, which points would fill with copies
            // of themselves, then what lies behind its neighbors.
            let label = Some("Scene::encoder");
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label });
            if let Some(floor) = &mut self.floor {
                let meshes = &self.meshes;
                let draw = |pass: &mut wgpu::RenderPass<'_>, name: &str| {
                    if let Some(data) = meshes.get(name) {
                        data.draw(pass);
                    }
                };
                floor.throw(&mut encoder, &self.pipelines, &shown.casters, draw);
            }
            let whole = Pass { clear: Some(shown.background), writes_depth: true, last: true };
            if let Some((_, depth)) = self.depth.as_ref().filter(|_| shown.eye_dome) {
                let until = |layer: Layer| shown.order.partition_point(|(of, _)| *of < layer);
                let (meshes, rest) = shown.order.split_at(until(Layer::Points));
                let (points, over) = rest.split_at(until(Layer::Outline) - meshes.len());
                self.draw_layers(&mut target.begin(&mut encoder, Pass { last: false, ..whole }), meshes);
                let shade = |encoder: &mut wgpu::CommandEncoder, pipeline, last| {
                    let mut pass = target.begin(encoder, Pass { clear: None, writes_depth: false, last });
                    pass.set_pipeline(pipeline);
                    pass.set_bind_group(0, &self.view_bindings, &[]);
                    pass.set_bind_group(1, depth, &[]);
                    pass.draw(0..6, 0..1);
                };
                // What moves is drawn without: nobody sees it.
                if !shown.moving && meshes.iter().any(|(layer, _)| *layer == Layer::OpaqueMesh) {
                    shade(&mut encoder, &self.pipelines.hollows, false);
                }
                if !points.is_empty() {
                    self.draw_layers(
                        &mut target.begin(&mut encoder, Pass { clear: None, last: false, ..whole }),
                        points,
                    );
                }
                shade(&mut encoder, &self.pipelines.edl, over.is_empty());
                if !over.is_empty() {
                    self.draw_layers(&mut target.begin(&mut encoder, Pass { clear: None, ..whole }), over);
                }
            } else {
                self.draw_layers(&mut target.begin(&mut encoder, whole), &shown.order);
            }
            gpu.queue.submit([encoder.finish()]);
            self.counters.renders += 1;
            Ok((shown, true))
        });
        match result {
            Ok((shown, drawn)) => {
                self.shown = Some(shown);
                Ok(drawn)
            }
            Err(error) => {
                // Buffers may not hold what their revision says.
                self.clouds.clear();
                self.meshes.clear();
                self.lines.clear();
                self.floor = None;
                Err(error)
            }
        }
    }

    /// Sends what changed; returns whether anything did, and what the picture is drawn from.
    fn update(
        &mut self,
        gpu: &Gpu,
        scene: &SceneData,
        (camera, part): (&Camera, Part),
        target: &Target,
    ) -> Result<(bool, Shown), GpuError> {
        let view = camera.uniform(part, scene.unit_px);
        let eye = Vec4::from_array(view.eye_in_world).as_dvec4();
        let mut done = Counters { uniforms: u64::from(self.view.set(gpu, view)), ..Counters::default() };
        let mut count = |[uploaded, written]: [bool; 2]| {
            done.uploads += u64::from(uploaded);
            done.uniforms += u64::from(written);
        };
        let total: usize = scene.clouds.iter().map(|c| c.points.len()).sum();
        let stride = match scene.moving {
            true => u32::try_from(total.div_ceil(self.moving_points.max(1) as usize)).unwrap_or(u32::MAX),
            false => 1,
        };
        // Each list is rebuilt from the old one, so that what is no longer shown is freed.
        let mut old = std::mem::take(&mut self.clouds);
        for item in &scene.clouds {
            let (data, did) = PointsData::update(gpu, &self.pipelines, old.remove(&item.name), item, stride)?;
            count(did);
            self.clouds.insert(item.name.clone(), data);
        }
        let mut old = std::mem::take(&mut self.meshes);
        for item in &scene.meshes {
            let (data, did) = MeshData::update(gpu, &self.pipelines, old.remove(&item.name), item, eye)?;
            count(did);
            self.meshes.insert(item.name.clone(), data);
        }
        let mut old = std::mem::take(&mut self.lines);
        for item in &scene.lines {
            let (data, did) = LinesData::update(gpu, &self.pipelines, old.remove(&item.name), item)?;
            count(did);
            self.lines.insert(item.name.clone(), data);
        }
        match &scene.floor {
            Some(floor) => {
                let data = self.floor.get_or_insert_with(|| FloorData::new(gpu, &self.pipelines));
                count([false, data.update(gpu, floor)]);
            }
            None => self.floor = None,
        }
        self.counters.uploads += done.uploads;
        self.counters.uniforms += done.uniforms;
        if scene.eye_dome && self.depth.as_ref().is_none_or(|(of, _)| *of != target.generation()) {
            let depth = [wgpu::BindingResource::TextureView(&target.depth_alone)];
            let depth = gpu.bind("Edl::depth", &self.pipelines.depth_layout, &depth);
            self.depth = Some((target.generation(), depth));
        }
        let shown = Shown {
            target: target.generation(),
            background: match (scene.transparent, scene.background) {
                (true, _) => [0.0; 4],
                (false, [r, g, b]) => [r, g, b, 1.0],
            },
            eye_dome: scene.eye_dome,
            moving: scene.moving && scene.eye_dome,
            casters: casters(scene),
            order: order(scene, gpu.software && scene.moving),
        };
        Ok((done != Counters::default(), shown))
    }

    fn draw_layers(&self, pass: &mut wgpu::RenderPass<'_>, order: &[(Layer, String)]) {
        pass.set_bind_group(0, &self.view_bindings, &[]);
        pass.set_stencil_reference(1);
        for (layer, name) in order {
            pass.set_pipeline(match layer {
                Layer::Floor => &self.pipelines.floor,
                Layer::Lines => &self.pipelines.lines,
                Layer::VeilDepth => &self.pipelines.veil[0],
                Layer::VeilBeside => &self.pipelines.veil[1],
                Layer::VeilBefore => &self.pipelines.veil[2],
                Layer::OpaqueMesh | Layer::TranslucentMesh => &self.pipelines.mesh_solid,
                Layer::Edges | Layer::Outline => &self.pipelines.edges,
                Layer::HiddenOutline => &self.pipelines.edges_overlay,
                Layer::Points => &self.pipelines.points,
                Layer::TranslucentPoints => &self.pipelines.points_translucent,
                Layer::XRayMesh => &self.pipelines.mesh_xray,
                Layer::OverlayLines => &self.pipelines.lines_overlay,
            });
            match layer {
                Layer::Floor => self.floor.as_ref().map(|d| d.draw(pass)),
                Layer::Lines | Layer::OverlayLines => self.lines.get(name).map(|d| d.draw(pass)),
                Layer::Points | Layer::TranslucentPoints => self.clouds.get(name).map(|d| d.draw(pass)),
                Layer::Edges | Layer::Outline | Layer::HiddenOutline => {
                    self.meshes.get(name).map(|d| d.draw_edges(pass))
                }
                Layer::OpaqueMesh
                | Layer::VeilDepth
                | Layer::VeilBeside
                | Layer::VeilBefore
                | Layer::TranslucentMesh
                | Layer::XRayMesh => self.meshes.get(name).map(|d| d.draw(pass)),
            };
        }
    }
}

/// The meshes that throw a shadow: solid ones, as they stand.
fn casters(scene: &SceneData) -> Vec<Caster> {
    let solid = scene.meshes.iter().filter(|m| scene.floor.is_some() && m.style.look == Look::Solid);
    solid.map(|m| (m.name.clone(), m.revision, view::matrix(&m.style.world_from_mesh))).collect()
}

/// All items of a scene in the order in which they are drawn; items of one layer keep the order of their list.
/// `hasty`: what is hardly seen is left out, because a program draws and the camera moves.
fn order(scene: &SceneData, hasty: bool) -> Vec<(Layer, String)> {
    let lines = scene.lines.iter().map(|l| {
        let layer = if l.style.overlay { Layer::OverlayLines } else { Layer::Lines };
        (layer, l.name.clone())
    });
    let meshes = scene.meshes.iter().flat_map(|m| {
        let layers: &[Layer] = match (m.style.look, m.style.edges.is_some() && !hasty) {
            (Look::Veil, _) if hasty => &[Layer::VeilDepth, Layer::VeilBeside],
            (Look::Veil, _) => &[Layer::VeilDepth, Layer::VeilBeside, Layer::VeilBefore],
            (Look::XRay, _) => &[Layer::XRayMesh],
            (Look::Outline, _) if hasty => &[Layer::Outline],
            (Look::Outline, _) => &[Layer::Outline, Layer::HiddenOutline],
            (Look::Solid, edges) if m.style.opacity < 1.0 => {
                &[Layer::TranslucentMesh, Layer::Edges][..1 + usize::from(edges)]
            }
            (Look::Solid, edges) => &[Layer::OpaqueMesh, Layer::Edges][..1 + usize::from(edges)],
        };
        layers.iter().map(|layer| (*layer, m.name.clone()))
    });
    let clouds = scene
        .clouds
        .iter()
        .map(|c| (if c.style.opacity < 1.0 { Layer::TranslucentPoints } else { Layer::Points }, c.name.clone()));
    let floor = scene.floor.iter().map(|_| (Layer::Floor, String::new()));
    let mut all: Vec<_> = floor.chain(lines).chain(meshes).chain(clouds).collect();
    all.sort_by_key(|(layer, _)| *layer);
    all
}
