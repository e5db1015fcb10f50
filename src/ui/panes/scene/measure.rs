//! Clicks in a 3D view: a point is read, or measured to.

use crate::app::action::with_keys;
use eframe::egui::{Color32, FontId, Pos2, Rect, Stroke, Ui, UiBuilder, pos2, vec2};
use glam::DVec3;

use super::layers::reason_rgb;
use super::{Memory, distance_at, nearest};
use crate::app::command::{Command, TasksCommand};
use crate::app::keys::ImprintSource;
use crate::app::results;
use crate::app::workbench::{Picked, SceneTool, WorkbenchCommand};
use crate::ui::parts::cx::Cx;
use crate::ui::parts::scene_view::SceneOutput;
use crate::ui::parts::theme::{SMALL, caption};
use crate::ui::parts::widget::line::Line;
use touch2touch_core::units;
use touch2touch_pipeline::steps::cloud::Clouds;

/// Does what a click means with the tool in hand.
pub(super) fn click(cx: &mut Cx<'_>, memory: &Memory, source: ImprintSource, output: &SceneOutput, clouds: &Clouds) {
    let tool = cx.state.workbench.tool;
    if !output.response.clicked() || matches!(tool, SceneTool::Pose | SceneTool::Paint) {
        return;
    }
    let Some(pointer) = output.pointer else { return };
    let camera = &memory.views[source as usize].camera;
    let hit = nearest(clouds, camera, output.size, pointer).and_then(|(finger, index)| {
        let cloud = clouds.finger(finger)?;
        Some((finger, *cloud.points.get(index)?, *cloud.pixels.get(index)?))
    });
    match (tool, hit) {
        (SceneTool::Look, hit) => {
            let picked = hit.map(|(finger, _, pixel)| Picked { source, finger, pixel });
            if picked != cx.state.workbench.picked {
                cx.push(Command::Workbench(WorkbenchCommand::Pick(picked)));
            }
        }
        (_, Some((_, point, _))) => cx.push(Command::Workbench(WorkbenchCommand::Mark(source, point))),
        (_, None) => cx.push(TasksCommand::Notice("No point under the pointer".into())),
    }
}

/// The measurement: its points, the lines between them, and the number.
pub(super) fn marks(cx: &Cx<'_>, ui: &Ui, memory: &Memory, source: ImprintSource, output: &SceneOutput) {
    let bench = &cx.state.workbench;
    let rect = output.response.rect;
    let painter = ui.painter_at(rect);
    let font = FontId::proportional(12.0);
    let label = |place: Pos2, text: String, color: Color32| {
        let galley = painter.layout_no_wrap(text, font.clone(), color);
        let back = Rect::from_min_size(place + vec2(8.0, -8.0), galley.size());
        painter.rect_filled(back.expand2(vec2(4.0, 2.0)), 3.0, cx.p.canvas.gamma_multiply(0.85));
        painter.galley(back.min, galley, color);
    };
    if bench.tool.marks() > 0 && bench.marks.len() < bench.tool.marks() {
        let text = format!("Click point {} of {} · [[cancel_jobs]] to stop", bench.marks.len() + 1, bench.tool.marks());
        let text = with_keys(&text);
        label(pos2(rect.center().x - 90.0, rect.bottom() - 34.0), text, cx.p.text);
    }
    let points: Vec<DVec3> = bench.marks.iter().filter(|(of, _)| *of == source).map(|(_, p)| *p).collect();
    let camera = &memory.views[source as usize].camera;
    let places: Vec<Option<Pos2>> = points.iter().map(|p| output.on_screen(camera, *p)).collect();
    let color = cx.p.strong;
    for pair in places.windows(2) {
        if let [Some(a), Some(b)] = pair {
            painter.line_segment([*a, *b], Stroke::new(3.0, cx.p.canvas));
            painter.line_segment([*a, *b], Stroke::new(1.5, color));
        }
    }
    for place in places.iter().flatten() {
        painter.circle(*place, 4.0, cx.p.accent, Stroke::new(1.0, color));
    }
    if let Some(text) = result(bench.tool, &points)
        && let Some(Some(middle)) = places.get(places.len() / 2)
    {
        label(*middle, text, color);
    }
}

/// The number of a complete measurement.
pub(super) fn result(tool: SceneTool, points: &[DVec3]) -> Option<String> {
    match (tool, points) {
        (SceneTool::Distance, [a, b]) => Some(units::text_mm(a.distance(*b))),
        (SceneTool::Angle, [a, b, c]) => {
            let (u, v) = (*a - *b, *c - *b);
            let angle = u.angle_between(v);
            Some(if angle.is_finite() { units::text_deg(angle) } else { "no angle: two points coincide".into() })
        }
        _ => None,
    }
}

/// Everything known about the point that was clicked.
pub(super) fn card(cx: &mut Cx<'_>, ui: &mut Ui, source: ImprintSource, rect: Rect, clouds: &Clouds) {
    let Some(picked) = cx.state.workbench.picked.filter(|p| p.source == source) else { return };
    let state = cx.state;
    let Some(cloud) = clouds.finger(picked.finger) else { return };
    let (x, y) = (usize::from(picked.pixel[0]), usize::from(picked.pixel[1]));
    let imprint = results::imprint(state, source, picked.finger).shown().and_then(|i| i.get(x, y).copied());
    let camera = results::touch(state, picked.finger).ready().and_then(|t| t.camera());
    let depth = camera.and_then(|c| c.depth_reference.get(x, y).copied()).zip(imprint).map(|(r, i)| r - i);
    let layer = results::layers(state, source).ready().and_then(|layers| layers.at(picked.finger, cloud, picked.pixel));
    let mm = |v: Option<f32>| v.filter(|v| v.is_finite()).map_or("–".to_owned(), |v| units::text_mm(f64::from(v)));
    let fit = layer.and_then(|(_, fit)| fit);
    let off = cloud.at_pixel(x, y).and_then(|index| distance_at(cx, source, picked.finger, index, clouds));
    let lines = [
        ("Pixel", format!("{} ({x}, {y})", state.finger_name(picked.finger))),
        ("Depth", mm(depth)),
        ("Imprint", mm(imprint)),
        ("From the CAD", off.map_or_else(|| with_keys("[[distances]]"), units::text_mm)),
        ("Residual", mm(fit.map(|f| f.residual_m))),
        ("Weight", fit.map_or("–".to_owned(), |f| format!("{:.2}", f.weight))),
    ];
    let size = vec2(168.0, 137.0);
    let place = Rect::from_min_size(rect.right_bottom() - size - vec2(36.0, 30.0), size);
    let builder = UiBuilder::new().max_rect(place).id_salt(("picked", source as usize));
    ui.scope_builder(builder, |ui| {
        ui.painter().rect(place, 4.0, cx.p.panel, Stroke::new(1.0, cx.p.line), eframe::egui::StrokeKind::Inside);
        let inner = place.shrink2(vec2(8.0, 5.0));
        ui.scope_builder(UiBuilder::new().max_rect(inner), |ui| {
            ui.spacing_mut().item_spacing.y = 0.0;
            ui.horizontal(|ui| {
                ui.label(caption("Point", cx.p));
                ui.with_layout(eframe::egui::Layout::right_to_left(eframe::egui::Align::Center), |ui| {
                    let close = ui.add(eframe::egui::Button::new("×").frame(false).min_size(vec2(14.0, 14.0)));
                    let close = close
                        .accessible_name("Close the read-out")
                        .on_hover_text(with_keys("Closes it ([[cancel_jobs]])"));
                    if close.clicked() {
                        cx.push(Command::Workbench(WorkbenchCommand::Pick(None)));
                    }
                });
            });
            let line = Line { height: 15.0, size: SMALL, column: 0.0, swatch: None };
            for (name, value) in lines {
                line.show(ui, (name, cx.p.weak), &[(value, cx.p.strong)]);
            }
            let reason = layer.map_or(("…".to_owned(), cx.p.weak), |(reason, _)| {
                let [r, g, b] = reason_rgb(reason);
                (reason.to_string(), Color32::from_rgb(r, g, b))
            });
            line.show(ui, ("Reason", cx.p.weak), &[reason]);
        });
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measurements_have_units_and_wait_for_their_points() {
        let p = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        assert_eq!(result(SceneTool::Distance, &[p(0.0, 0.0)]), None);
        assert_eq!(result(SceneTool::Distance, &[p(0.0, 0.0), p(0.003, 0.004)]).unwrap(), "5.00 mm");
        assert_eq!(result(SceneTool::Angle, &[p(1.0, 0.0), p(0.0, 0.0), p(0.0, 2.0)]).unwrap(), "90.0°");
        assert!(result(SceneTool::Angle, &[p(1.0, 0.0), p(1.0, 0.0), p(0.0, 2.0)]).unwrap().contains("no angle"));
        assert_eq!(result(SceneTool::Look, &[]), None);
    }
}
