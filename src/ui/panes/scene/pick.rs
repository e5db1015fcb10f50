//! A click in a 3D view reads a point.

use crate::app::action::with_keys;
use eframe::egui::{Color32, Rect, Stroke, Ui, UiBuilder, vec2};

use super::layers::reason_rgb;
use super::{Memory, distance_at, nearest};
use crate::app::command::Command;
use crate::app::keys::ImprintSource;
use crate::app::results;
use crate::app::workbench::{Picked, SceneTool, WorkbenchCommand};
use crate::ui::parts::cx::Cx;
use crate::ui::parts::scene_view::SceneOutput;
use crate::ui::parts::theme::{SMALL, caption};
use crate::ui::parts::widget::line::Line;
use touch2touch_core::units;
use touch2touch_pipeline::steps::cloud::Clouds;

/// A click reads the point under it, or closes the read-out.
pub(super) fn click(cx: &mut Cx<'_>, memory: &Memory, source: ImprintSource, output: &SceneOutput, clouds: &Clouds) {
    if !output.response.clicked() || cx.state.workbench.tool != SceneTool::Look {
        return;
    }
    let Some(pointer) = output.pointer else { return };
    let camera = &memory.views[source as usize].camera;
    let picked = nearest(clouds, camera, output.size, pointer).and_then(|(finger, index)| {
        let pixel = *clouds.finger(finger)?.pixels.get(index)?;
        Some(Picked { source, finger, pixel })
    });
    if picked != cx.state.workbench.picked {
        cx.push(Command::Workbench(WorkbenchCommand::Pick(picked)));
    }
}

/// Everything known about the point that was clicked.
pub(super) fn card(cx: &Cx<'_>, ui: &mut Ui, source: ImprintSource, rect: Rect, clouds: &Clouds) {
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
            ui.label(caption(with_keys("Point ([[cancel_jobs]] closes)"), cx.p));
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
