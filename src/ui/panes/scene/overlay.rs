//! Overlay of a 3D picture: scale bar, names of the axes, buttons; and how poses are put in words.

use eframe::egui::{self, Align2, Color32, FontId, Rect, Stroke, Ui, pos2, vec2};
use glam::DVec3;

use super::Memory;
use super::build::{AXIS, axes_origin};
use super::legend;
use crate::app::action::Action;
use crate::app::keys::ImprintSource;
use crate::app::results;
use crate::app::settings::SceneLayer;
use crate::app::state::Absent;
use crate::gpu::guides;
use crate::gpu::view::Camera;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::scene_view::SceneOutput;
use crate::ui::parts::theme::{Palette, grade_color};
use touch2touch_core::align::Rung;
use touch2touch_core::manual::PoseDifference;
use touch2touch_core::units;
use touch2touch_core::verdict::Grade;
use touch2touch_work::pose::PoseResult;

/// Scale bar, names of the axes, legend, buttons.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui, memory: &Memory, source: ImprintSource, output: &SceneOutput) {
    let rect = output.response.rect;
    let camera = memory.views[source as usize].camera;
    if cx.state.settings.scene.layer(SceneLayer::Guides).shown {
        axes_and_scale(cx.p, &ui.painter_at(rect), &camera, output, rect);
    }
    legend::show(cx, ui, memory, source, rect);
    super::steps::show_legend(cx, ui, memory, source, rect);
}

/// Angle and figures of the step shown, where that is not the registered pose.
pub(super) fn step_text(cx: &Cx<'_>, source: ImprintSource) -> Option<(String, Color32, String)> {
    let shown = results::inspected_in(cx.state, source)?;
    if shown.is_last() && cx.state.inspect.start.is_none() && shown.run == shown.inspection.report().winner {
        return None;
    }
    let angle = units::wrap_angle(-shown.step.grasp_from_object.theta_rad);
    let (mut text, mut color) = (units::text_deg(angle), cx.p.strong);
    if let Some(truth) = results::truth(cx.state) {
        let truth = units::wrap_angle(-truth.theta_rad);
        let error = units::angle_error(angle, truth);
        text += &format!(" (true {}, error {})", units::text_deg(truth), units::text_deg(error));
        color = error_color(cx.p, error);
    }
    let last = shown.inspection.num_steps(shown.run).saturating_sub(1);
    let details = format!(
        "step {} of {last}, start {} · {:.0} % inliers",
        shown.at,
        shown.run + 1,
        shown.step.inlier_share * 100.0
    );
    Some((text, color, details))
}

/// Height of the buttons that turn the view, points.
pub(super) const SIDES: f32 = 138.0;

/// Buttons that turn the view, in the column beside it.
pub(super) fn sides(cx: &mut Cx<'_>, ui: &mut Ui, source: ImprintSource, column: Rect) {
    let place = column.shrink2(vec2(2.0, 4.0)).with_max_y((column.top() + SIDES).min(column.bottom()));
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
            if button.on_hover_text(cx.keys().help(action)).clicked() {
                cx.act(action);
            }
        }
    });
}

/// `Measured and predicted 1.2° and 0.85 mm apart`.
pub(super) fn difference(what: &str, how: &str, d: PoseDifference) -> String {
    format!("{what} {} and {} {how}", units::text_deg(d.angle_rad), units::text_mm(d.position_m))
}

pub(super) fn lower_first(absent: Absent) -> String {
    let text = absent.text().trim_end_matches('.');
    let mut chars = text.chars();
    chars.next().map_or(String::new(), |c| c.to_lowercase().chain(chars).collect())
}

/// `11.9° ± 0.3° (true 12.3°, error 0.4°)`.
pub(crate) fn angle_text(pose: &PoseResult) -> String {
    let angle = pose.angle_text();
    match (pose.truth_rad, pose.error_rad) {
        (Some(truth), Some(error)) => {
            format!("{angle} (true {}, error {})", units::text_deg(truth), units::text_deg(error))
        }
        _ => angle,
    }
}

/// The color of an angle error.
pub(crate) fn error_color(p: &Palette, error_rad: f64) -> Color32 {
    grade_color(p, Grade::of_angle_error(error_rad))
}

/// Time that a registration took. On a line of its own: no other text wraps elsewhere because a machine was busy.
pub(crate) fn pose_time(pose: &PoseResult) -> String {
    if pose.ms < 9.95 { format!("in {:.1} ms", pose.ms) } else { format!("in {:.0} ms", pose.ms) }
}

/// Points, residual, stop reason.
pub(crate) fn pose_details(pose: &PoseResult) -> String {
    let report = &pose.report;
    let rung = if report.rung == Rung::Fixed { String::new() } else { format!(" · {}", report.rung) };
    let beyond = if report.within_prior { "" } else { " · beyond what the gripper can hold (±22.5°, ±5 mm)" };
    let open = if report.is_degenerate() { " · not fully determined" } else { "" };
    let refused =
        if report.refused().is_some() { " · a cheaper place was refused: no gripper holds it so" } else { "" };
    let who = report.joint.map_or(String::new(), |fit| format!(" · by {}", fit.basis));
    format!(
        "{} points · residual {} · {}{rung}{who}{open}{beyond}{refused}",
        pose.num_points,
        units::text_mm(pose.rms_m),
        pose.stop
    )
}

fn axes_and_scale(p: &Palette, painter: &egui::Painter, camera: &Camera, output: &SceneOutput, rect: Rect) {
    for (axis, name, color) in [
        (DVec3::X, "x", guides::AXIS_COLORS[0]),
        (DVec3::Y, "y", guides::AXIS_COLORS[1]),
        (DVec3::Z, "z", guides::AXIS_COLORS[2]),
    ] {
        if let Some(tip) = output.on_screen(camera, axes_origin() + axis * (AXIS * 1.25)) {
            let color = Color32::from_rgb(color[0], color[1], color[2]);
            painter.text(tip, Align2::CENTER_CENTER, name, FontId::proportional(11.0), color);
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
