//! One 3D picture in a pane: its camera, its target on the graphics card, and what the pointer does to it.

use std::sync::Arc;

use eframe::egui::{
    self, PointerButton, Pos2, Rect, Response, Role, Sense, TextureId, Ui, Vec2, WidgetInfo, pos2, vec2,
};
use eframe::egui_wgpu::RenderState;
use glam::{DVec2, DVec3};

use super::frame_cache::FrameCache;
use crate::gpu::pipelines::Pipelines;
use crate::gpu::scene::{SceneData, SceneRenderer};
use crate::gpu::target::Target;
use crate::gpu::view::{Camera, Part};
use crate::gpu::{Gpu, GpuError, wgpu};

/// The graphics device as all 3D panes share it.
pub(crate) struct Device {
    pub gpu: Gpu,
    pipelines: Arc<Pipelines>,
    state: RenderState,
}

impl Device {
    /// Takes the window's device.
    ///
    /// # Errors
    /// The error that keeps the shaders from being built: shown in place of the 3D views.
    pub(crate) fn new(state: &RenderState) -> Result<Self, GpuError> {
        let gpu = Gpu::new(&state.adapter, state.device.clone(), state.queue.clone());
        let pipelines = Arc::new(Pipelines::new(&gpu)?);
        Ok(Self { gpu, pipelines, state: state.clone() })
    }
}

/// Factor by which a notch of the wheel brings the scene nearer.
const ZOOM_PER_NOTCH: f64 = 1.15;

/// One view.
#[derive(Default)]
pub(crate) struct SceneView {
    /// Camera of the view.
    pub camera: Camera,
    /// True where the camera was placed by a fit or by a person.
    pub placed: bool,
    drawn: Option<Drawn>,
    /// Rectangle in which it was last drawn, points, and its size in physical pixels.
    last: Option<(Rect, [u32; 2])>,
    error: Option<String>,
}

struct Drawn {
    target: Target,
    renderer: SceneRenderer,
    texture: TextureId,
}

/// Use of the pointer's buttons besides the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Grip {
    /// Nothing: the primary button turns the camera, the others move it.
    Nothing,
    /// The primary button is somebody else's.
    Primary,
    /// A pen draws with the primary and the secondary button; with Shift the primary one turns the camera.
    Pen,
    /// A stroke is being drawn: the camera rests.
    Stroke,
}

/// Events in a view.
pub(crate) struct SceneOutput {
    /// The pane's response.
    pub response: Response,
    /// The picture's size, physical pixels.
    pub size: [u32; 2],
    /// The pointer in physical pixels of the picture.
    pub pointer: Option<DVec2>,
    /// True where the camera was moved by the pointer.
    pub moved: bool,
    /// True where a fit was asked for (double-click).
    pub fit: bool,
    rect: Rect,
}

impl SceneOutput {
    /// Place of a point of the world on the screen.
    pub(crate) fn on_screen(&self, camera: &Camera, p_in_world: DVec3) -> Option<Pos2> {
        place_on_screen(camera, self.rect, self.size, p_in_world)
    }
}

/// Place of a point of the world in `rect`, which shows a picture of `size` physical pixels.
fn place_on_screen(camera: &Camera, rect: Rect, size: [u32; 2], p_in_world: DVec3) -> Option<Pos2> {
    let (px, _) = camera.project(p_in_world, size)?;
    let scale = vec2(rect.width() / size[0].max(1) as f32, rect.height() / size[1].max(1) as f32);
    Some(rect.min + vec2(px.x as f32, px.y as f32) * scale)
}

impl SceneView {
    /// Takes the space left in `ui` and moves the camera by what the pointer does, as far as its buttons are not `held` by
    /// something else. Call [`Self::draw`] next, with the scene that belongs to the new camera.
    pub(crate) fn interact(&mut self, ui: &mut Ui, label: &str, held: Grip) -> SceneOutput {
        let space = ui.available_size().max(Vec2::splat(16.0));
        let (rect, response) = ui.allocate_exact_size(space, Sense::click_and_drag());
        response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, label));
        let ppp = ui.pixels_per_point();
        let size = [rect.width(), rect.height()].map(|s| (s * ppp).round().max(1.0) as u32);
        let mut moved = false;
        let delta = response.drag_delta() * ppp;
        let delta = DVec2::new(f64::from(delta.x), f64::from(delta.y));
        if delta != DVec2::ZERO && held != Grip::Stroke {
            if response.dragged_by(PointerButton::Primary) {
                if held == Grip::Nothing || (held == Grip::Pen && ui.input(|i| i.modifiers.shift)) {
                    self.camera.orbit(delta);
                    moved = true;
                }
            } else if response.dragged() && (held != Grip::Pen || response.dragged_by(PointerButton::Middle)) {
                self.camera.pan(delta, size);
                moved = true;
            }
        }
        let pointer = response.hover_pos().map(|pos| (pos - rect.min) * ppp);
        let pointer = pointer.map(|p| DVec2::new(f64::from(p.x), f64::from(p.y)));
        if response.contains_pointer() && held != Grip::Stroke {
            let (scroll, pinch) = ui.input(|i| (i.smooth_scroll_delta().y, i.zoom_delta()));
            let notches = f64::from(scroll) / f64::from(ui.ctx().options(|o| o.input_options.line_scroll_speed));
            let factor = f64::from(pinch) * ZOOM_PER_NOTCH.powf(notches);
            if factor != 1.0 {
                self.camera.zoom(factor, pointer, size);
                moved = true;
            }
        }
        self.placed |= moved;
        self.last = Some((rect, size));
        // Where a pen draws, two quick dabs are no double-click.
        let fit = response.double_clicked() && matches!(held, Grip::Nothing | Grip::Primary);
        SceneOutput { response, size, pointer, moved, fit, rect }
    }

    /// Place of a point of the world on the screen when the view was last shown.
    pub(crate) fn on_screen(&self, p_in_world: DVec3) -> Option<Pos2> {
        let (rect, size) = self.last?;
        place_on_screen(&self.camera, rect, size, p_in_world)
    }

    /// Brings the picture up to date and paints it. Nothing is drawn on the device when nothing changed.
    ///
    /// # Errors
    /// [`GpuError`], for [`Self::failed`].
    pub(crate) fn draw(
        &mut self,
        ui: &Ui,
        device: &Device,
        output: &SceneOutput,
        scene: &SceneData,
    ) -> Result<(), GpuError> {
        let gpu = &device.gpu;
        // A program that draws gets a quarter of the pixels to do while the camera moves.
        let size = if scene.moving && gpu.software { output.size.map(|s| s.div_ceil(2)) } else { output.size };
        let drawn = match &mut self.drawn {
            Some(drawn) => drawn,
            None => {
                let target = Target::new(gpu, size)?;
                let renderer = SceneRenderer::new(gpu, device.pipelines.clone())?;
                let texture = device.state.renderer.write().register_native_texture(
                    &gpu.device,
                    target.view(),
                    wgpu::FilterMode::Linear,
                );
                self.drawn.insert(Drawn { target, renderer, texture })
            }
        };
        if drawn.target.resize(gpu, size)? {
            device.state.renderer.write().update_egui_texture_from_wgpu_texture(
                &gpu.device,
                drawn.target.view(),
                wgpu::FilterMode::Linear,
                drawn.texture,
            );
        }
        let part = Part::whole(drawn.target.size());
        if drawn.renderer.render(gpu, scene, (&self.camera, part), &drawn.target)? {
            let (texture, view) = (drawn.texture, drawn.target.view());
            ui.ctx().with_plugin(|cache: &mut FrameCache| cache.show(texture, view));
        }
        let uv = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        ui.painter().image(drawn.texture, output.rect, uv, egui::Color32::WHITE);
        self.error = None;
        Ok(())
    }

    /// Says in place of the picture why it cannot be drawn.
    pub(crate) fn failed(&mut self, ui: &Ui, output: &SceneOutput, error: &GpuError) {
        // Logged once per cause: the same view fails in every frame.
        let text = error.to_string();
        if self.error.as_ref() != Some(&text) {
            log::error!("3D view: {text}");
        }
        let (said, font) = (format!("This view cannot be drawn.\n{text}"), egui::FontId::proportional(12.0));
        let (middle, color) = (output.rect.center(), ui.visuals().error_fg_color);
        ui.painter().text(middle, egui::Align2::CENTER_CENTER, said, font, color);
        self.error = Some(text);
    }
}
