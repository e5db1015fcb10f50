//! What is written over a 3D picture: angle, stop reason, legend, scale bar, names of the axes, buttons.

use eframe::egui::{self, Align2, Color32, FontId, Rect, Stroke, Ui, pos2, vec2};
use glam::DVec3;

use super::build::{AXIS, axes_origin};
use crate::app::action::Action;
use crate::app::keys::ImprintSource;
use crate::app::results::PoseResult;
use crate::app::state::{Absent, Lookup};
use crate::domain::units;
use crate::gpu::guides;
use crate::gpu::view::Camera;
use crate::ui::cx::{Cx, side_color};
use crate::ui::images::CONTACT;
use crate::ui::scene_view::SceneOutput;
use crate::ui::theme::Palette;

/// What is written over the picture: angle, stop reason, legend, scale bar, names of the axes.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui, source: ImprintSource, output: &SceneOutput) {
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
pub(in crate::ui) fn angle_text(p: &Palette, pose: &PoseResult) -> (String, Color32) {
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
pub(in crate::ui) fn error_color(p: &Palette, error_rad: f64) -> Color32 {
    match error_rad.to_degrees() {
        e if e <= 5.0 => p.good,
        e if e <= 10.0 => p.caution,
        _ => p.wrong,
    }
}

/// Points, residual, stop reason, time.
pub(in crate::ui) fn pose_details(pose: &PoseResult) -> String {
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
