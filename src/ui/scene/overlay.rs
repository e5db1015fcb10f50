//! What is written over a 3D picture: angle, stop reason, legend, scale bar, names of the axes, buttons.

use eframe::egui::{self, Align2, Color32, FontId, Rect, Stroke, Ui, pos2, vec2};
use glam::DVec3;

use strum::IntoEnumIterator as _;

use super::Memory;
use super::build::{AXIS, axes_origin};
use super::hands;
use crate::app::action::Action;
use crate::app::keys::ImprintSource;
use crate::app::state::{Absent, Lookup};
use crate::app::workbench::Layer;
use crate::domain::align::Rung;
use crate::domain::align::reason::Reason;
use crate::domain::hand::PoseDifference;
use crate::domain::units;
use crate::gpu::guides;
use crate::gpu::view::Camera;
use crate::ui::cx::{Cx, side_color};
use crate::ui::images::CONTACT;
use crate::ui::layers::{RESIDUAL_MAP, reason_rgb};
use crate::ui::scene_view::SceneOutput;
use crate::ui::theme::Palette;
use crate::work::pose::PoseResult;

/// What is written over the picture: angle, stop reason, legend, scale bar, names of the axes.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui, memory: &Memory, source: ImprintSource, output: &SceneOutput) {
    let rect = output.response.rect;
    let painter = ui.painter_at(rect);
    let camera = memory.views[source as usize].camera;
    axes_and_scale(cx.p, &painter, &camera, output, rect);
    let mut y = rect.top() + 8.0;
    let x = rect.left() + 10.0;
    // The buttons at the right edge stay free.
    let width = rect.width() - 52.0;
    let mut write = |text: String, size: f32, color: Color32| {
        let font = FontId::proportional(size);
        let galley = painter.layout(text, font, color, width);
        let height = galley.size().y;
        let back = Rect::from_min_size(pos2(x, y), galley.size()).expand2(vec2(4.0, 1.0));
        painter.rect_filled(back, 3.0, cx.p.canvas.gamma_multiply(0.75));
        painter.galley(pos2(x, y), galley, color);
        y += height + 3.0;
    };
    let step = step_text(cx, source);
    let stepping = step.is_some();
    if let Some((text, color, details)) = step {
        write(text, 16.0, color);
        write(details, 11.0, cx.p.weak);
    } else {
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
    }
    if let Some(pose) = cx.state.by_hand(source) {
        let mut text = format!("Accepted by hand: {}", hands::place_text(pose));
        if let Some(off) = hands::off_truth(cx.state, pose) {
            text += &format!(", {} off the truth", units::text_deg(off.angle_rad));
        }
        write(text, 11.0, cx.p.good);
    }
    // The poses of both sides against each other and against the truth, in the picture.
    // Not while another pose than the registered one is shown.
    if let Some(apart) = cx.state.sides_apart().filter(|_| !stepping) {
        let mut text = difference("Measured and predicted", "apart", apart);
        if let (Some(truth), Some(pose)) = (cx.state.truth(), cx.state.pose(source).ready()) {
            let off = PoseDifference::between(pose.grasp_from_object, truth);
            text = format!("{} · {text}", difference("This pose", "off the truth", off));
        }
        write(text, 11.0, cx.p.weak);
    }
    legend(cx, ui, memory, source, rect);
    super::steps::show_legend(cx, ui, memory, source, rect);
    sides(cx, ui, source, rect);
}

/// Angle and figures of the step shown, where that is not the registered pose.
fn step_text(cx: &Cx<'_>, source: ImprintSource) -> Option<(String, Color32, String)> {
    let shown = cx.state.inspected_in(source)?;
    if shown.is_last() && cx.state.inspect.start.is_none() && shown.run == shown.inspection.report().winner {
        return None;
    }
    let angle = units::wrap_angle(-shown.step.grasp_from_object.theta_rad);
    let (mut text, mut color) = (units::text_deg(angle), cx.p.strong);
    if let Some(truth) = cx.state.truth() {
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

/// `Measured and predicted 1.2° and 0.85 mm apart`.
fn difference(what: &str, how: &str, d: PoseDifference) -> String {
    format!("{what} {} and {} {how}", units::text_deg(d.angle_rad), units::text_mm(d.position_m))
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

/// The color of an angle error.
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
    let report = &pose.report;
    let found = if report.rung == Rung::Fixed { String::new() } else { format!(" · {}", report.rung) };
    let beyond = if report.within_prior { "" } else { " · beyond what the gripper can hold (±22.5°, ±5 mm)" };
    let open = if report.is_degenerate() { " · not fully determined" } else { "" };
    format!(
        "{} points · residual {} · {}{found}{open}{beyond} · {ms:.1}\u{a0}ms",
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

/// The colors of residuals with their range, beside the scale bar.
fn residual_bar(cx: &Cx<'_>, painter: &egui::Painter, source: ImprintSource, rect: Rect) {
    let Some(layers) = cx.state.layers(source).ready() else { return };
    let bar = Rect::from_min_size(pos2(rect.right() - 132.0, rect.bottom() - 62.0), vec2(120.0, 9.0));
    let steps = 30;
    for i in 0..steps {
        let [r, g, b] = RESIDUAL_MAP.rgb8((i as f32 + 0.5) / steps as f32);
        let x = bar.left() + bar.width() * i as f32 / steps as f32;
        let part = Rect::from_min_size(pos2(x, bar.top()), vec2(bar.width() / steps as f32 + 0.5, bar.height()));
        painter.rect_filled(part, 0.0, Color32::from_rgb(r, g, b));
    }
    let font = FontId::proportional(10.0);
    for (share, anchor) in [(0.0, Align2::LEFT_TOP), (0.5, Align2::CENTER_TOP), (1.0, Align2::RIGHT_TOP)] {
        let mm = units::mm(layers.range_m) * f64::from(share);
        let text = if share == 1.0 { format!("{mm:.0} mm") } else { format!("{mm:.0}") };
        painter.text(pos2(bar.left() + bar.width() * share, bar.bottom() + 1.0), anchor, text, font.clone(), cx.p.text);
    }
    painter.text(bar.right_top() - vec2(0.0, 3.0), Align2::RIGHT_BOTTOM, "residual", font, cx.p.text);
    if let Some(kernel) = layers.kernel_m {
        let x = bar.left() + bar.width() * (kernel / layers.range_m) as f32;
        painter.vline(x, bar.top() - 3.0..=bar.bottom(), Stroke::new(1.5, cx.p.strong));
    }
}

/// What the colors mean, and buttons for the sides.
fn legend(cx: &Cx<'_>, ui: &Ui, memory: &Memory, source: ImprintSource, rect: Rect) {
    let p = cx.p;
    let painter = ui.painter_at(rect);
    let mut entries = vec![(side_color(p, source), "membrane")];
    match memory.layer_colors[source as usize].as_ref().map(|_| cx.state.workbench.layer) {
        Some(Layer::Reasons) => {}
        Some(_) => residual_bar(cx, &painter, source, rect),
        None => entries.push((CONTACT, "contact")),
    }
    if cx.state.workbench.both_clouds {
        let other = super::other_side(source);
        let text = if other == ImprintSource::Measured { "measured contact" } else { "predicted contact" };
        entries.push((side_color(p, other), text));
    }
    if cx.state.workbench.hand(source).is_some() {
        entries.push((p.accent, "CAD, in hand"));
    } else if cx.state.by_hand(source).is_some() {
        entries.push((p.good, "CAD, accepted by hand"));
    }
    if cx.state.pose(source).shown().is_some() {
        entries.push((p.cad, "CAD, aligned"));
    }
    if cx.state.sample().ready().is_some_and(|s| s.grasp_from_object.is_some()) && memory.mesh.is_some() {
        entries.push((p.truth, "CAD, true pose"));
    }
    let mut entries: Vec<(Color32, String)> = entries.into_iter().map(|(c, text)| (c, text.to_owned())).collect();
    if cx.state.workbench.layer == Layer::Reasons
        && memory.layer_colors[source as usize].is_some()
        && let Some(layers) = cx.state.layers(source).ready()
    {
        // The reasons of the points that are drawn, with their counts.
        for reason in Reason::iter().filter(|r| !matches!(r, Reason::OutsideMask | Reason::InvalidDepth)) {
            let count: usize = layers.counts.iter().flatten().map(|counts| counts[reason as usize]).sum();
            if count > 0 {
                let [r, g, b] = reason_rgb(reason);
                entries.push((Color32::from_rgb(r, g, b), format!("{reason}: {count}")));
            }
        }
    }
    entries.extend(super::steps::legend_entries(cx, source).into_iter().map(|(c, text)| (c, text.to_owned())));
    let mut y = rect.bottom() - 14.0;
    for (color, text) in entries.into_iter().rev() {
        painter.circle_filled(pos2(rect.left() + 14.0, y), 4.0, color);
        painter.text(pos2(rect.left() + 24.0, y), Align2::LEFT_CENTER, text, FontId::proportional(11.0), p.weak);
        y -= 15.0;
    }
}
