//! The 3D panes: cloud, contact points and CAD model, measured and predicted, with linked cameras.

mod build;
mod draw;
mod gizmo;
mod hands;
mod layers;
mod legend;
mod overlay;
mod pick;
mod steps;
mod strip;
mod verdict;

use eframe::egui::{self, Button, Color32, Rect, RichText, Ui, UiBuilder, vec2};
use glam::DVec3;
use strum::IntoEnumIterator as _;

use build::{SceneCloud, SceneMesh, SceneSurface};
use gizmo::Gizmo;
use layers::LayerColors;
use steps::StepLines;

use super::images;
use crate::app::command::{CameraPreset, Command, Hover, Pane, ViewCommand};
use crate::app::keys::{DatasetSeq, ImprintSource};
use crate::app::results;
use crate::app::settings::{SpacePane, prefer};
use crate::app::state::{Lookup, State};
use crate::app::workbench::WorkbenchCommand;
use crate::gpu::pick::nearest_point;
use crate::gpu::scene::SceneData;
use crate::gpu::view::Camera;
use crate::spatial;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::made_with;
use crate::ui::parts::scene_view::{Grip, SceneOutput, SceneView};
use crate::ui::parts::theme::SMALL;
use crate::ui::parts::widget::empty;
use touch2touch_core::rig::PadId;
use touch2touch_core::units;
use touch2touch_pipeline::steps::cloud::Clouds;
use touch2touch_pipeline::still::space::ViewAngles;

pub(crate) use overlay::{error_color, pose_details, pose_time};

/// Height of the row above the views, points.
const HEAD: f32 = 24.0;

/// Distance of the pointer from a point at which it means it, physical pixels.
const PICK_PX: f64 = 9.0;

/// The views of both sides, and what the renderer holds of the results; lists are by [`ImprintSource`].
#[derive(Default)]
pub(crate) struct Memory {
    /// Cameras and pictures.
    views: [SceneView; 2],
    /// Points on the device.
    clouds: [Option<SceneCloud>; 2],
    /// Membranes as surfaces, while they are shown.
    surfaces: [Option<SceneSurface>; 2],
    /// The data set that the views were fitted to.
    fitted: Option<DatasetSeq>,
    /// Colors of the contact points.
    layer_colors: [Option<LayerColors>; 2],
    /// The handles of the pose tool.
    gizmo: Gizmo,
    /// The side whose picture the pen draws on now.
    drawing: Option<ImprintSource>,
    /// The CAD model on the device.
    mesh: Option<SceneMesh>,
    /// Lines of the step that is shown.
    step_lines: Option<StepLines>,
    /// The pass in which a camera was last moved.
    moved: Option<u64>,
    /// Counts what was made for the renderer.
    revision: u64,
}

impl Memory {
    /// Turns the cameras of both sides.
    pub(crate) fn look_from(&mut self, preset: CameraPreset) {
        for view in &mut self.views {
            view.camera.look_from(preset);
        }
    }

    /// Fits the views to their panes when they are drawn next.
    pub(crate) fn fit(&mut self) {
        for view in &mut self.views {
            view.placed = false;
        }
    }

    /// The cameras of both sides as text; empty where a view was not placed yet.
    pub(crate) fn cameras(&self) -> [String; 2] {
        [ImprintSource::Measured, ImprintSource::Predicted].map(|side| match self.views[side as usize].placed {
            true => serde_json::to_string(&self.views[side as usize].camera).unwrap_or_default(),
            false => String::new(),
        })
    }

    /// Looks at a data set from where a text of [`Self::cameras`] says; what is no camera is left to be fitted.
    pub(crate) fn resume(&mut self, seq: DatasetSeq, cameras: &[String; 2]) {
        self.fitted = Some(seq);
        for (view, text) in self.views.iter_mut().zip(cameras) {
            if let Some(camera) = serde_json::from_str::<Camera>(text).ok().filter(Camera::is_valid) {
                view.camera = camera;
                view.placed = true;
            }
        }
    }

    /// Follows the pen no further; whether it was drawing.
    pub(crate) fn lift_pen(&mut self) -> bool {
        self.drawing.take().is_some()
    }

    /// Place of a point of the grasp frame (meters) when a side was last drawn.
    pub(crate) fn on_screen(&self, source: ImprintSource, point: DVec3) -> Option<egui::Pos2> {
        self.views[source as usize].on_screen(point)
    }
}

/// The pane: a view of each side that is chosen, and one strip for them.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory, _: Pane) {
    if let Err(why) = cx.device {
        empty::show(ui, "No 3D views on this graphics device", why, None);
        return;
    }
    let open = cx.state.library.open.as_ref().map(|open| open.seq);
    if memory.fitted != open {
        memory.fitted = open;
        memory.fit();
    }
    for view in &mut memory.views {
        view.camera.orthographic = cx.state.settings.scene.orthographic;
    }
    let full = ui.available_rect_before_wrap();
    ui.advance_cursor_after_rect(full);
    let (area, column) = full.split_left_right_at_x((full.right() - strip::WIDTH).max(full.left()));
    let (head, area) = area.split_top_bottom_at_y((area.top() + HEAD).min(area.bottom()));
    ui.scope_builder(UiBuilder::new().max_rect(head.shrink2(vec2(4.0, 2.0))), |ui| {
        ui.horizontal_centered(|ui| choose_sides(cx, ui));
    });
    let sides = sides_shown(cx.state);
    // The pose in hand stands below the pictures, not on them, and has the width of all.
    let in_hand = sides.iter().copied().find(|side| hands::strip_height(cx.state, *side) > 0.0);
    let footer = in_hand.map_or(0.0, |side| hands::strip_height(cx.state, side).min(area.height() / 2.0));
    let (area, foot) = area.split_top_bottom_at_y(area.bottom() - footer);
    for (side, place) in sides.iter().zip(beside(area, sides.len())) {
        let mut child = ui.new_child(UiBuilder::new().max_rect(place).id_salt(("view", *side as usize)));
        child.set_clip_rect(place.intersect(ui.clip_rect()));
        one_side(cx, &mut child, memory, *side, sides.first() == Some(side));
    }
    if let Some(side) = in_hand {
        hands::strip(cx, ui, side, foot);
    }
    strip::show(cx, ui, column);
}

/// The sides that are chosen, without those that have nothing to show beside one that has.
fn sides_shown(state: &State) -> Vec<ImprintSource> {
    let chosen = state.settings.scene_sides().sides();
    let there = |side: &&ImprintSource| !matches!(results::cloud(state, **side), Lookup::Absent(_));
    let shown: Vec<ImprintSource> = chosen.iter().filter(there).copied().collect();
    if shown.is_empty() { chosen.first().copied().into_iter().collect() } else { shown }
}

/// Places of so many views: beside each other where there is the width for it, else one below the other.
fn beside(area: Rect, count: usize) -> Vec<Rect> {
    const GAP: f32 = 2.0;
    let n = count.max(1) as f32;
    let wide = area.width() >= 0.9 * area.height();
    let size = match wide {
        true => vec2((area.width() - GAP * (n - 1.0)) / n, area.height()),
        false => vec2(area.width(), (area.height() - GAP * (n - 1.0)) / n),
    };
    let step = if wide { vec2(size.x + GAP, 0.0) } else { vec2(0.0, size.y + GAP) };
    (0..count).map(|i| Rect::from_min_size(area.min + step * i as f32, size)).collect()
}

/// Choice of the sides.
fn choose_sides(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.spacing_mut().item_spacing.x = 2.0;
    let now = cx.state.settings.scene_sides();
    for sides in SpacePane::iter() {
        let button =
            Button::selectable(now == sides, RichText::new(sides.name()).size(SMALL)).min_size(vec2(0.0, 18.0));
        let tip =
            "Which sides have a 3D view in this workspace; a side with nothing to show leaves its room to the other";
        let button = ui.add(button).accessible_name(format!("3D: {}", sides.name().to_lowercase()));
        if button.on_hover_text(tip).clicked() {
            cx.push(prefer(move |s| _ = s.sides.insert(s.workspace, sides)));
        }
    }
}

/// The view of one side; the `first` has the legend.
fn one_side(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory, source: ImprintSource, first: bool) {
    let state = cx.state;
    let lookup = results::cloud(state, source);
    match (lookup, lookup.shown().is_some()) {
        (Lookup::Failed(err), _) => return images::failed(cx, ui, err),
        (Lookup::Absent(absent), _) => return images::absent_text(cx, ui, absent),
        // Without any cloud yet, the view itself would be empty: say that it is on its way.
        (Lookup::Waiting, _) if memory.clouds[source as usize].is_none() => {
            empty::show(ui, "Loading…", "", None);
            return;
        }
        _ => {}
    }
    let Ok(device) = cx.device else { return };
    build::update(cx, memory, source);
    let label = match source {
        ImprintSource::Measured => "3D view, measured",
        ImprintSource::Predicted => "3D view, predicted",
    };
    verdict::line(cx, ui, source, first);
    let held = match (draw::is_ready(state), memory.drawing == Some(source)) {
        (true, true) => Grip::Stroke,
        (true, false) => Grip::Pen,
        (false, _) if memory.gizmo.holds(source) => Grip::Primary,
        (false, _) => Grip::Nothing,
    };
    let (picture, made) = made_with::split(cx, ui.available_rect_before_wrap(), source == ImprintSource::Predicted);
    let builder = UiBuilder::new().max_rect(picture);
    let output = ui.scope_builder(builder, |ui| memory.views[source as usize].interact(ui, label, held)).inner;
    if output.pointer.is_some() && state.workbench.side != source && memory.gizmo.is_free() {
        cx.push(Command::Workbench(WorkbenchCommand::SetSide(source)));
    }
    let mut scene = build::scene_of(cx, memory, source);
    place_camera(cx, memory, source, &output, &scene);
    let camera = memory.views[source as usize].camera;
    cx.shared.angles[source as usize] =
        ViewAngles { yaw_deg: camera.yaw_rad.to_degrees(), pitch_deg: camera.pitch_rad.to_degrees() };
    // A camera may be drawn before the one that leads it: it moves in the next frame.
    let pass = ui.ctx().cumulative_pass_nr();
    if output.moved {
        memory.moved = Some(pass);
    }
    scene.moving = memory.moved.is_some_and(|last_pass| pass <= last_pass + 1);
    if scene.moving {
        // Moving views are drawn coarsely: draw all there is once they rest.
        ui.ctx().request_repaint_after(std::time::Duration::from_millis(120));
    }
    let view = &mut memory.views[source as usize];
    view.draw(ui, device, &output, &scene).unwrap_or_else(|err| view.failed(ui, &output, &err));
    // While a stroke is drawn, what is shown is of the move before.
    if matches!(lookup, Lookup::Stale(_) | Lookup::Waiting) && state.document.stroke.is_none() {
        ui.painter().rect_filled(output.response.rect, 0.0, cx.p.canvas.gamma_multiply(0.45));
    }
    if let Some(below) = made {
        made_with::show(cx, ui, label, picture, below);
    }
    if let Lookup::Ready(clouds) = lookup {
        point_at(cx, ui, memory, source, &output, clouds);
        pick::click(cx, memory, source, &output, clouds);
    }
    overlay::show(cx, ui, memory, source, &output, first);
    let rect = output.response.rect;
    gizmo::show(cx, ui, memory, source, &output);
    if let Some(clouds) = lookup.shown() {
        draw::show(cx, ui, memory, source, &output, clouds);
    }
    if let Lookup::Ready(clouds) = lookup {
        pick::card(cx, ui, source, rect, clouds);
    }
}

/// Moves the camera of a side to where it was aimed or fitted to; the other one follows.
fn place_camera(cx: &Cx<'_>, memory: &mut Memory, source: ImprintSource, output: &SceneOutput, scene: &SceneData) {
    let aimed = match (output.fit, output.pointer, results::cloud(cx.state, source)) {
        (true, Some(pointer), Lookup::Ready(clouds)) => aim(memory, source, output, pointer, clouds),
        _ => false,
    };
    let place = (output.fit && !aimed) || !memory.views[source as usize].placed;
    if place {
        let view = &mut memory.views[source as usize];
        view.camera.frame(&spatial::focus(scene), spatial::FILLED);
        // Until the model stands where it belongs, what is shown is not yet what is to be looked at.
        view.placed = !matches!(results::pose(cx.state, source), Lookup::Waiting | Lookup::Stale(_));
    }
    if output.moved || place || aimed {
        let camera = memory.views[source as usize].camera;
        let placed = memory.views[source as usize].placed && memory.clouds[1 - source as usize].is_some();
        let other = &mut memory.views[1 - source as usize];
        other.camera = camera;
        other.placed |= placed;
    }
}

/// Centers a view on the point under the pointer; whether there is one.
fn aim(
    memory: &mut Memory,
    source: ImprintSource,
    output: &SceneOutput,
    pointer: glam::DVec2,
    clouds: &Clouds,
) -> bool {
    let camera = &mut memory.views[source as usize].camera;
    let Some((finger, index)) = nearest(clouds, camera, output.size, pointer) else { return false };
    let Some(point) = clouds.finger(finger).and_then(|cloud| cloud.points.get(index)) else { return false };
    camera.target = *point;
    true
}

/// The point of a cloud that is meant by a position in the picture, physical pixels: finger and index.
fn nearest(clouds: &Clouds, camera: &Camera, size: [u32; 2], pointer: glam::DVec2) -> Option<(PadId, usize)> {
    let hits = clouds
        .fingers
        .entries()
        .filter_map(|(finger, cloud)| Some((finger, nearest_point(&cloud.points, camera, size, pointer, PICK_PX)?)));
    let best = hits.reduce(|best, next| {
        let (old, new) = (best.1, next.1);
        let nearer = new.distance_px < old.distance_px + 1.0 && new.depth_m < old.depth_m;
        if nearer || new.distance_px < old.distance_px - 1.0 { next } else { best }
    });
    best.map(|(finger, hit)| (finger, hit.index))
}

/// The point under the pointer becomes the pixel under the pointer of all images.
fn point_at(cx: &mut Cx<'_>, ui: &Ui, memory: &Memory, source: ImprintSource, output: &SceneOutput, clouds: &Clouds) {
    let Some(pointer) = output.pointer else { return };
    if ui.input(|i| i.pointer.delta() == egui::Vec2::ZERO) || output.moved {
        // At rest, or while the view turns, the mark stays where it is.
        cx.shared.hover_claimed = true;
        let marked = cx.state.selection.hover.filter(|_| cx.state.selection.hover_point.is_some());
        let point = marked.and_then(|hover| {
            let [x, y] = hover.at_px.map(|v| v.round().max(0.0) as usize);
            Some((hover.finger, clouds.finger(hover.finger)?.at_pixel(x, y)?))
        });
        if let Some((finger, index)) = point {
            say(cx, source, finger, index, clouds);
        }
        return;
    }
    let camera = &memory.views[source as usize].camera;
    let Some((finger, index)) = nearest(clouds, camera, output.size, pointer) else {
        if cx.state.selection.hover_point.is_some() {
            cx.push(ViewCommand::HoverPoint(None));
        }
        return;
    };
    let Some((point, pixel)) = point_of(clouds, finger, index) else { return };
    cx.shared.hover_claimed = true;
    let hover = Some(Hover { finger, at_px: [f32::from(pixel[0]), f32::from(pixel[1])] });
    if cx.state.selection.hover != hover {
        cx.push(ViewCommand::HoverPixel(hover));
        cx.push(ViewCommand::HoverPoint(Some(point)));
    }
    say(cx, source, finger, index, clouds);
}

/// A point of a cloud and its pixel.
fn point_of(clouds: &Clouds, finger: PadId, index: usize) -> Option<(DVec3, [u16; 2])> {
    let cloud = clouds.finger(finger)?;
    Some((*cloud.points.get(index)?, *cloud.pixels.get(index)?))
}

/// Puts the figures of a point into the status bar.
fn say(cx: &mut Cx<'_>, source: ImprintSource, finger: PadId, index: usize, clouds: &Clouds) {
    let Some((point, pixel)) = point_of(clouds, finger, index) else { return };
    let off = distance_at(cx, source, finger, index, clouds);
    let off = off.map_or(String::new(), |off| format!("   {} from the model", units::text_mm(off)));
    cx.shared.readout = Some(format!(
        "3D {} ({}, {})   x {:.2}  y {:.2}  z {:.2} mm in the grasp frame{off}",
        cx.state.finger_name(finger),
        pixel[0],
        pixel[1],
        units::mm(point.x),
        units::mm(point.y),
        units::mm(point.z)
    ));
}

/// Distance of a point from the registered model where distances are shown, meters; `None` of one outside the contact.
fn distance_at(cx: &Cx<'_>, source: ImprintSource, finger: PadId, index: usize, clouds: &Clouds) -> Option<f64> {
    let deviation =
        results::deviation(cx.state, source).ready().filter(|_| results::shows_deviation(cx.state, source))?;
    let contact = &clouds.finger(finger)?.contact;
    // Distances are of the contact points alone, in their order.
    let contact_index = contact.get(..index)?.iter().filter(|contact| **contact).count();
    let off = contact[index].then(|| deviation.points[finger].as_ref()?.get(contact_index).copied())??;
    Some(f64::from(off)).filter(|off| off.is_finite())
}

/// A color as the renderer takes it.
pub(crate) fn rgb(c: Color32) -> [f32; 3] {
    [f32::from(c.r()) / 255.0, f32::from(c.g()) / 255.0, f32::from(c.b()) / 255.0]
}
