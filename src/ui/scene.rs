//! The 3D panes: cloud, contact points and CAD model, measured and predicted, with linked cameras.

use std::sync::Arc;

use eframe::egui::{self, Align2, Color32, FontId, Rect, Stroke, Ui, pos2, vec2};
use glam::{DAffine3, DVec3};

use super::cx::{Cx, SceneCloud, SceneMesh, side_color};
use super::images::{self, CONTACT};
use super::scene_view::SceneOutput;
use super::theme::Palette;
use super::widget::empty;
use crate::app::action::Action;
use crate::app::command::{CameraPreset, Command, Hover};
use crate::app::keys::ImprintSource;
use crate::app::results::{Clouds, FingerCloud, PoseResult};
use crate::app::state::{Absent, Lookup};
use crate::domain::sensor::Finger;
use crate::domain::units;
use crate::gpu::guides;
use crate::gpu::lines::{LinesItem, LinesStyle};
use crate::gpu::mesh::{Look, MeshItem, MeshStyle, Shading};
use crate::gpu::pick::nearest_point;
use crate::gpu::points::{CloudItem, CloudStyle, PointColors, PointSize};
use crate::gpu::scene::SceneData;
use crate::gpu::view::{Camera, Preset};

/// How near the pointer must be to a point to mean it, physical pixels.
const PICK_PX: f64 = 9.0;

/// The pane of one side.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui, source: ImprintSource) {
    let device = match cx.device {
        Ok(device) => device,
        Err(why) => {
            empty::show(ui, "No 3D views on this graphics device", why, None);
            return;
        }
    };
    let state = cx.state;
    let lookup = state.cloud(source);
    match (lookup, lookup.shown().is_some()) {
        (Lookup::Failed(err), _) => return images::failed(cx, ui, err),
        (Lookup::Absent(absent), _) => return images::absent_text(cx, ui, absent),
        // Without any cloud yet, the view itself would be empty: say that it is on its way.
        (Lookup::Waiting, _) if cx.local.scene_clouds[source as usize].is_none() => {
            empty::show(ui, "Loading…", "", None);
            return;
        }
        _ => {}
    }
    if let (Lookup::Ready(clouds), Ok(Some(key))) = (lookup, state.cloud_key(source)) {
        update_cloud(cx, source, key, clouds);
    }
    update_mesh(cx);
    let label = match source {
        ImprintSource::Measured => "3D view, measured",
        ImprintSource::Predicted => "3D view, predicted",
    };
    let output = cx.local.scenes[source as usize].interact(ui, label);
    let mut scene = scene_of(cx, source);
    let place = output.fit || !cx.local.scenes[source as usize].placed;
    if place && let Some(bounds) = scene.bounds() {
        let view = &mut cx.local.scenes[source as usize];
        view.camera.fit(bounds, output.size);
        view.placed = true;
    }
    if (output.moved || place) && state.settings.cameras_linked {
        let camera = cx.local.scenes[source as usize].camera;
        let other = &mut cx.local.scenes[1 - source as usize];
        other.camera = camera;
        other.placed |= cx.local.scene_clouds[1 - source as usize].is_some();
    }
    scene.moving = output.moved;
    if output.moved {
        // Points were thinned out while moving: draw all of them once it rests.
        ui.ctx().request_repaint_after(std::time::Duration::from_millis(120));
    }
    cx.local.scenes[source as usize].draw(ui, device, &output, &scene);
    if matches!(lookup, Lookup::Stale(_) | Lookup::Waiting) {
        ui.painter().rect_filled(output.response.rect, 0.0, cx.p.canvas.gamma_multiply(0.45));
    }
    if let Lookup::Ready(clouds) = lookup {
        pick(cx, ui, source, &output, clouds);
    }
    overlay(cx, ui, source, &output);
}

fn rgb(c: Color32) -> [f32; 3] {
    [f32::from(c.r()) / 255.0, f32::from(c.g()) / 255.0, f32::from(c.b()) / 255.0]
}

/// Points for the renderer, made again only for another cloud.
fn update_cloud(cx: &mut Cx<'_>, source: ImprintSource, key: crate::app::keys::CloudKey, clouds: &Clouds) {
    let held = &mut cx.local.scene_clouds[source as usize];
    if held.as_ref().is_some_and(|h| h.key == key) {
        return;
    }
    let part = |f: &FingerCloud, contact: bool| {
        let indices: Vec<usize> = (0..f.points.len()).filter(|i| f.contact.get(*i) == Some(&contact)).collect();
        // The membrane only has to be seen, and seen through: every other pixel of every other row.
        let kept = |i: &usize| contact || f.pixels.get(*i).is_some_and(|p| p[0] % 2 == 0 && p[1] % 2 == 0);
        indices.into_iter().filter(kept).filter_map(|i| f.points.get(i).copied()).collect::<Arc<[DVec3]>>()
    };
    let convert = |f: &FingerCloud| [part(f, false), part(f, true)];
    cx.local.revision += 1;
    let fingers = [clouds.fingers[0].as_ref().map(convert), clouds.fingers[1].as_ref().map(convert)];
    *held = Some(SceneCloud { key, revision: cx.local.revision, fingers });
}

fn update_mesh(cx: &mut Cx<'_>) {
    let Some(tool) = cx.state.tool().shown() else { return };
    let Some(open) = &cx.state.library.open else { return };
    if cx.local.mesh.as_ref().is_some_and(|m| m.key.0 == open.seq && m.key.1 == tool.name) {
        return;
    }
    cx.local.revision += 1;
    let key = (open.seq, tool.name.clone());
    cx.local.mesh = Some(SceneMesh { key, revision: cx.local.revision, mesh: Arc::new(tool.model.mesh.clone()) });
}

fn scene_of(cx: &Cx<'_>, source: ImprintSource) -> SceneData {
    let state = cx.state;
    let mut scene = SceneData { background: rgb(cx.p.canvas), ..SceneData::default() };
    let hover = state.selection.hover;
    if let Some(cloud) = &cx.local.scene_clouds[source as usize] {
        for finger in Finger::BOTH {
            let Some(parts) = &cloud.fingers[finger.index()] else { continue };
            // The membrane recedes, the contact stands out.
            let rest = super::theme::mix(cx.p.canvas, side_color(cx.p, source), 0.6);
            let looks = [(PointSize::Px(1.2), rest, "membrane"), (PointSize::Metres(0.000_3), CONTACT, "contact")];
            for (part, (size, color, name)) in parts.iter().zip(looks) {
                scene.clouds.push(CloudItem {
                    name: format!("{name} {}", finger.name()),
                    revision: cloud.revision,
                    points: part.clone(),
                    colors: PointColors::One,
                    style: CloudStyle { color: rgb(color), size, ..CloudStyle::default() },
                });
            }
        }
    }
    // The pixel under the pointer, as a point of its own: it must not drown among the others.
    let pointed = hover.and_then(|h| {
        let cloud = state.cloud(source).ready()?.finger(h.finger)?;
        let (x, y) = (h.at_px[0].round().max(0.0) as usize, h.at_px[1].round().max(0.0) as usize);
        cloud.points.get(cloud.at_pixel(x, y)?).copied()
    });
    if let Some(point) = pointed {
        let bits = point.to_array().map(f64::to_bits);
        scene.clouds.push(CloudItem {
            name: "pointer".into(),
            revision: bits[0] ^ bits[1].rotate_left(21) ^ bits[2].rotate_left(42),
            points: [point].into(),
            colors: PointColors::One,
            style: CloudStyle { color: rgb(cx.p.strong), size: PointSize::Px(9.0), ..CloudStyle::default() },
        });
    }
    let tool_now = state.tool().ready().map(|t| t.name.as_str());
    if let Some(mesh) = cx.local.mesh.as_ref().filter(|m| Some(m.key.1.as_str()) == tool_now) {
        let item = |name: &str, style: MeshStyle| MeshItem {
            name: name.into(),
            revision: mesh.revision,
            mesh: mesh.mesh.clone(),
            shading: Shading::Smooth,
            style,
        };
        if let Some(pose) = state.pose(source).shown() {
            scene.meshes.push(item(
                "CAD",
                MeshStyle {
                    world_from_mesh: pose.grasp_from_object.to_affine(),
                    color: rgb(cx.p.cad),
                    opacity: 0.9,
                    look: Look::Solid,
                },
            ));
        }
        if let Some(truth) = state.sample().ready().and_then(|s| s.grasp_from_object) {
            scene.meshes.push(item(
                "CAD at the true pose",
                MeshStyle {
                    world_from_mesh: truth.to_affine(),
                    color: rgb(cx.p.truth),
                    opacity: 0.6,
                    look: Look::XRay,
                },
            ));
        }
    }
    scene.lines.push(LinesItem {
        name: "grid".into(),
        revision: u64::from(*cx.p == super::theme::DARK),
        segments: grid(cx.p).into(),
        style: LinesStyle { world_from_lines: DAffine3::IDENTITY, width_px: 1.0, opacity: 1.0, overlay: false },
    });
    scene.lines.push(LinesItem {
        name: "axes".into(),
        revision: 1,
        segments: guides::axes(axes_origin(), AXIS).into(),
        style: LinesStyle { world_from_lines: DAffine3::IDENTITY, width_px: 2.0, opacity: 1.0, overlay: true },
    });
    scene
}

/// Length of the drawn axes, metres.
const AXIS: f64 = 0.01;

/// A corner of the floor grid: in the middle the axes would hide the contact.
fn axes_origin() -> DVec3 {
    DVec3::new(-0.05, -0.05, FLOOR)
}

/// Height of the floor grid, metres along +z (down).
const FLOOR: f64 = 0.045;

fn grid(p: &Palette) -> Vec<crate::gpu::lines::Segment> {
    let c = super::theme::mix(p.canvas, p.weak, 0.45);
    guides::grid(DVec3::new(0.0, 0.0, FLOOR), [DVec3::X, DVec3::Y], 0.01, 5, [c.r(), c.g(), c.b()])
}

/// The point under the pointer becomes the pixel under the pointer of all images.
fn pick(cx: &mut Cx<'_>, ui: &Ui, source: ImprintSource, output: &SceneOutput, clouds: &Clouds) {
    let Some(pointer) = output.pointer else { return };
    if ui.input(|i| i.pointer.delta() == egui::Vec2::ZERO) || output.moved {
        // At rest, or while the view turns, the mark stays where it is.
        cx.local.hover_claimed = true;
        return;
    }
    let camera = &cx.local.scenes[source as usize].camera;
    let mut best: Option<(Finger, usize, f64, f64)> = None;
    for finger in Finger::BOTH {
        let Some(cloud) = clouds.finger(finger) else { continue };
        let hit = nearest_point(&cloud.points, &DAffine3::IDENTITY, camera, output.size, pointer, PICK_PX);
        if let Some(hit) = hit {
            let better = best.is_none_or(|(_, _, px, depth)| {
                hit.distance_px < px - 1.0 || (hit.distance_px < px + 1.0 && hit.depth_m < depth)
            });
            if better {
                best = Some((finger, hit.index, hit.distance_px, hit.depth_m));
            }
        }
    }
    let Some((finger, index, _, _)) = best else {
        if cx.state.selection.hover_point.is_some() {
            cx.push(Command::HoverPoint(None));
        }
        return;
    };
    let Some((point, pixel)) = clouds.finger(finger).and_then(|c| Some((*c.points.get(index)?, *c.pixels.get(index)?)))
    else {
        return;
    };
    cx.local.hover_claimed = true;
    let hover = Some(Hover { finger, at_px: [f32::from(pixel[0]), f32::from(pixel[1])] });
    if cx.state.selection.hover != hover {
        cx.push(Command::HoverPixel(hover));
        cx.push(Command::HoverPoint(Some(point)));
    }
    cx.local.readout = Some(format!(
        "3D {} ({}, {})   x {:.2}  y {:.2}  z {:.2} mm in the grasp frame",
        finger.name(),
        pixel[0],
        pixel[1],
        units::mm(point.x),
        units::mm(point.y),
        units::mm(point.z)
    ));
}

/// What is written over the picture: angle, stop reason, legend, scale bar, names of the axes.
fn overlay(cx: &mut Cx<'_>, ui: &mut Ui, source: ImprintSource, output: &SceneOutput) {
    let rect = output.response.rect;
    let painter = ui.painter_at(rect);
    let camera = cx.local.scenes[source as usize].camera;
    axes_and_scale(cx.p, &painter, &camera, output, rect);
    let mut y = rect.top() + 8.0;
    let x = rect.left() + 10.0;
    let width = rect.width() - 20.0;
    let mut write = |text: String, size: f32, color: Color32| {
        let font = FontId::proportional(size);
        let galley = painter.layout(text, font, color, width);
        let height = galley.size().y;
        let back = Rect::from_min_size(pos2(x, y), galley.size()).expand2(vec2(4.0, 1.0));
        painter.rect_filled(back, 3.0, cx.p.canvas.gamma_multiply(0.75));
        painter.galley(pos2(x, y), galley, color);
        y += height + 3.0;
    };
    match cx.state.pose(source) {
        Lookup::Ready(pose) | Lookup::Stale(pose) => {
            let (text, color) = angle_text(cx.p, pose);
            write(text, 16.0, color);
            write(pose_details(pose), 11.0, cx.p.weak);
        }
        Lookup::Waiting => write("Pose: computing…".into(), 12.0, cx.p.weak),
        Lookup::Failed(err) => write(format!("No pose: {}", err.why), 12.0, cx.p.wrong),
        Lookup::Absent(absent) => write(format!("No pose: {}", lower_first(absent)), 12.0, cx.p.weak),
    }
    legend(cx, ui, source, rect);
    sides(cx, ui, source, rect);
}

/// Buttons that turn the view, at the right edge.
fn sides(cx: &mut Cx<'_>, ui: &mut Ui, source: ImprintSource, rect: Rect) {
    let place =
        Rect::from_min_max(pos2(rect.right() - 28.0, rect.top() + 52.0), pos2(rect.right() - 4.0, rect.bottom()));
    if place.height() < 160.0 {
        return;
    }
    let builder = egui::UiBuilder::new().max_rect(place).id_salt(("sides", source as usize));
    ui.scope_builder(builder, |ui| {
        ui.spacing_mut().item_spacing.y = 2.0;
        let side = if source == ImprintSource::Measured { "measured" } else { "predicted" };
        for action in [Action::CameraLeft, Action::CameraRight, Action::CameraFront, Action::CameraTop, Action::Fit] {
            let letter = match action {
                Action::CameraLeft => "L",
                Action::CameraRight => "R",
                Action::CameraFront => "F",
                Action::CameraTop => "T",
                _ => "0",
            };
            let text = egui::RichText::new(letter).size(11.0).color(cx.p.weak);
            let button = ui.add(egui::Button::new(text).min_size(vec2(22.0, 18.0)).fill(cx.p.panel));
            let button = button.accessible_name(format!("{}, {side}", action.name()));
            if button.on_hover_text(action.help()).clicked() {
                cx.act(action);
            }
        }
    });
}

fn lower_first(absent: Absent) -> String {
    let text = absent.text().trim_end_matches('.');
    let mut chars = text.chars();
    chars.next().map_or(String::new(), |c| c.to_lowercase().chain(chars).collect())
}

/// `11.9° (true 12.3°, error 0.4°)`, green, amber or red by the usual limits of 5 and 10 degrees.
pub(super) fn angle_text(p: &Palette, pose: &PoseResult) -> (String, Color32) {
    let angle = units::text_deg(pose.angle_rad);
    match (pose.truth_rad, pose.error_rad) {
        (Some(truth), Some(error)) => {
            let text = format!("{angle} (true {}, error {})", units::text_deg(truth), units::text_deg(error));
            (text, error_color(p, error))
        }
        _ => (angle, p.strong),
    }
}

/// The colour of an angle error.
pub(super) fn error_color(p: &Palette, error_rad: f64) -> Color32 {
    match error_rad.to_degrees() {
        e if e <= 5.0 => p.good,
        e if e <= 10.0 => p.caution,
        _ => p.wrong,
    }
}

/// Points, residual, stop reason, time.
pub(super) fn pose_details(pose: &PoseResult) -> String {
    // The unit stays with its number where the line wraps.
    let ms = pose.ms;
    format!("{} points · residual {} · {} · {ms:.1}\u{a0}ms", pose.num_points, units::text_mm(pose.rms_m), pose.stop)
}

fn axes_and_scale(p: &Palette, painter: &egui::Painter, camera: &Camera, output: &SceneOutput, rect: Rect) {
    for (axis, name, color) in [
        (DVec3::X, "x", guides::AXIS_COLORS[0]),
        (DVec3::Y, "y", guides::AXIS_COLORS[1]),
        (DVec3::Z, "z", guides::AXIS_COLORS[2]),
    ] {
        if let Some(at) = output.on_screen(camera, axes_origin() + axis * (AXIS * 1.25)) {
            let color = Color32::from_rgb(color[0], color[1], color[2]);
            painter.text(at, Align2::CENTER_CENTER, name, FontId::proportional(11.0), color);
        }
    }
    // In the plane of the target, as all perspective scale bars.
    let per_m = camera.px_per_m(output.size) * f64::from(rect.height()) / f64::from(output.size[1].max(1));
    let Some(length) = [0.05, 0.02, 0.01, 0.005, 0.002, 0.001].into_iter().find(|l| l * per_m <= 110.0) else {
        return;
    };
    let width = (length * per_m) as f32;
    let (right, y) = (rect.right() - 12.0, rect.bottom() - 12.0);
    let stroke = Stroke::new(1.5, p.text);
    painter.hline(right - width..=right, y, stroke);
    for x in [right - width, right] {
        painter.vline(x, y - 3.0..=y + 3.0, stroke);
    }
    let text = format!("{:.0} mm", length * 1e3);
    painter.text(pos2(right - width * 0.5, y - 4.0), Align2::CENTER_BOTTOM, text, FontId::proportional(11.0), p.text);
}

/// What the colours mean, and buttons for the sides.
fn legend(cx: &mut Cx<'_>, ui: &mut Ui, source: ImprintSource, rect: Rect) {
    let p = cx.p;
    let painter = ui.painter_at(rect);
    let mut entries = vec![(side_color(p, source), "membrane"), (CONTACT, "contact")];
    if cx.state.pose(source).shown().is_some() {
        entries.push((p.cad, "CAD, aligned"));
    }
    if cx.state.sample().ready().is_some_and(|s| s.grasp_from_object.is_some()) && cx.local.mesh.is_some() {
        entries.push((p.truth, "CAD, true pose"));
    }
    let mut y = rect.bottom() - 14.0;
    for (color, text) in entries.into_iter().rev() {
        painter.circle_filled(pos2(rect.left() + 14.0, y), 4.0, color);
        painter.text(pos2(rect.left() + 24.0, y), Align2::LEFT_CENTER, text, FontId::proportional(11.0), p.weak);
        y -= 15.0;
    }
}

/// The side that a request of the action table means.
pub(super) fn preset(preset: CameraPreset) -> Preset {
    match preset {
        CameraPreset::Left => Preset::Left,
        CameraPreset::Right => Preset::Right,
        CameraPreset::Front => Preset::Front,
        CameraPreset::Top => Preset::Top,
    }
}
