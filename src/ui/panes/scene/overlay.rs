//! Overlay of a 3D picture: scale bar, names of the axes; and how poses are put in words.

use eframe::egui::{self, Align2, Color32, FontId, Rect, Stroke, Ui, pos2};
use glam::DVec3;

use super::{Memory, legend};
use crate::app::keys::ImprintSource;
use crate::app::results;
use crate::app::settings::SceneLayer;
use crate::app::state::Absent;
use crate::gpu::guides;
use crate::gpu::view::Camera;
use crate::spatial::items;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::scene_view::SceneOutput;
use crate::ui::parts::theme::{Palette, grade_color};
use touch2touch_core::align::Rung;
use touch2touch_core::manual::PoseDifference;
use touch2touch_core::units;
use touch2touch_core::verdict::Grade;
use touch2touch_pipeline::steps::pose::PoseResult;

/// Scale bar, names of the axes, bar of the colors; in the `first` view the legend.
pub(super) fn show(
    cx: &mut Cx<'_>,
    ui: &mut Ui,
    memory: &Memory,
    source: ImprintSource,
    output: &SceneOutput,
    first: bool,
) {
    let rect = output.response.rect;
    let camera = memory.views[source as usize].camera;
    if cx.state.settings.scene.shows(SceneLayer::Guides) {
        axes_and_scale(cx.p, &ui.painter_at(rect), &camera, output, rect);
    }
    legend::show(cx, ui, memory, source, rect, first);
}

/// Angle and figures of the step shown, where that is not the registered pose.
pub(super) fn step_text(cx: &Cx<'_>, source: ImprintSource) -> Option<(String, Color32, String)> {
    let shown = results::inspected_in(cx.state, source)?;
    if shown.is_last() && cx.state.inspect.start.is_none() && shown.run == shown.inspection.report().winner {
        return None;
    }
    let angle = units::wrap_angle(-shown.step.grasp_from_object.theta_rad);
    let (mut text, mut color) = (units::text_deg(angle), cx.p.strong);
    if let Some(off) = results::off_truth(cx.state, shown.step.grasp_from_object) {
        text += &format!(" (error {})", units::text_deg(off.angle_rad));
        color = error_color(cx.p, off.angle_rad);
    }
    let last = shown.inspection.num_steps(shown.run).saturating_sub(1);
    let details = format!(
        "step {} of {last}, start {} · {:.0} % of the points fit",
        shown.at,
        shown.run + 1,
        shown.step.inlier_share * 100.0
    );
    Some((text, color, details))
}

/// `Measured vs predicted: 1.2° and 0.85 mm apart`.
pub(super) fn difference(what: &str, how: &str, d: PoseDifference) -> String {
    format!("{what} {} and {} {how}", units::text_deg(d.angle_rad), units::text_mm(d.position_m)).trim_end().to_owned()
}

pub(super) fn lower_first(absent: Absent) -> String {
    let text = absent.text().trim_end_matches('.');
    let mut chars = text.chars();
    chars.next().map_or(String::new(), |c| c.to_lowercase().chain(chars).collect())
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
    let beyond = if report.within_prior { "" } else { " · outside the search range" };
    let open = if report.is_degenerate() { " · not fully determined" } else { "" };
    let refused =
        if report.refused().is_some() { " · a better fit outside the search range was rejected" } else { "" };
    let who = report.joint.map_or(String::new(), |fit| format!(" · from {}", fit.basis));
    format!(
        "{} points · residual {} · {}{rung}{who}{open}{beyond}{refused}",
        pose.num_points,
        units::text_mm(pose.rms_m),
        pose.stop
    )
}

fn axes_and_scale(p: &Palette, painter: &egui::Painter, camera: &Camera, output: &SceneOutput, rect: Rect) {
    for ((axis, name), [r, g, b, _]) in DVec3::AXES.into_iter().zip(["x", "y", "z"]).zip(guides::AXIS_COLORS) {
        if let Some(tip) = output.on_screen(camera, items::axes_origin() + axis * (items::AXIS_M * 1.25)) {
            let color = Color32::from_rgb(r, g, b);
            painter.text(tip, Align2::CENTER_CENTER, name, FontId::proportional(11.0), color);
        }
    }
    // In the plane of the target, as all perspective scale bars.
    let per_m = camera.px_per_m(output.size) * f64::from(rect.height()) / f64::from(output.size[1].max(1));
    // Beside the legend.
    let room = f64::from((rect.width() - 110.0).min(110.0));
    let Some(length) = [0.05, 0.02, 0.01, 0.005, 0.002, 0.001].into_iter().find(|l| l * per_m <= room) else {
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
