//! Drawing on masks in a 3D view: the mask tools, on the points under the pointer.

use eframe::egui::{FontId, Ui, vec2};

use super::{Memory, nearest};
use crate::app::command::LabelsCommand;
use crate::app::keys::ImprintSource;
use crate::app::labels;
use crate::app::labels::StrokeIn3d;
use crate::app::settings::MaskTool;
use crate::app::state::State;
use crate::app::workbench::SceneTool;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::pen::{self, Easel};
use crate::ui::parts::scene_view::SceneOutput;
use crate::ui::parts::widget::image_canvas::CanvasMap;
use touch2touch_core::label::DrawTool;
use touch2touch_core::units;
use touch2touch_pipeline::steps::cloud::Clouds;

/// True where the pointer draws on masks in the 3D views.
pub(super) fn is_ready(state: &State) -> bool {
    let drawn = state.workbench.tool == SceneTool::Paint && state.settings.mask.tool != MaskTool::Pan;
    drawn && state.document.is_editable(state.pair_name())
}

/// Follows the pointer, and says what it draws with and what that reaches.
pub(super) fn show(
    cx: &mut Cx<'_>,
    ui: &Ui,
    memory: &mut Memory,
    source: ImprintSource,
    output: &SceneOutput,
    clouds: &Clouds,
) {
    let state = cx.state;
    if !is_ready(state) {
        return;
    }
    let camera = memory.views[source as usize].camera;
    let layers = state.settings.mask.layers;
    let sight = camera.sight(output.size, layers);
    let drawn = state.document.stroke.as_ref().filter(|_| memory.drawing == Some(source));
    let drawn = drawn.and_then(|stroke| stroke.drawing.sight.as_deref().map(|sight| (stroke, sight)));
    if drawn.is_some_and(|(_, before)| before.clip_from_grasp != sight.clip_from_grasp) {
        // Turned by a key: the stroke is of the picture before.
        memory.drawing = None;
        return cx.push(LabelsCommand::EndStroke);
    }
    let meant = output.pointer.and_then(|pointer| nearest(clouds, &camera, output.size, pointer));
    let point = meant.and_then(|(finger, index)| clouds.finger(finger)?.points.get(index).copied());
    let size_at = point.unwrap_or(camera.target);
    let (finger, radius_px) = match drawn.map(|(stroke, _)| (stroke.place.pad, stroke.drawing.tool)) {
        Some((pad, DrawTool::Brush { radius_px })) => (pad, radius_px),
        Some((pad, _)) => (pad, 0.0),
        None => (meant.map_or(state.selection.finger, |(finger, _)| finger), labels::brush_px(state, &sight, size_at)),
    };
    let rect = output.response.rect;
    let painter = ui.painter_at(rect);
    let [width, height] = output.size;
    let map = CanvasMap {
        image_rect: rect,
        scale: rect.width() / width.max(1) as f32,
        rotated: false,
        size: [width as usize, height as usize],
    };
    let response = &output.response;
    let on_top = response.hovered() || response.is_pointer_button_down_on();
    let easel = Easel { map, painter: &painter, response, on_top, source, finger, in_3d: true, radius_px };
    pen::follow(cx, ui, (&mut memory.drawing, source), &easel, |at_px, erase, modifiers| {
        let begin = StrokeIn3d { finger, source, sight: sight.clone(), at_px, size_at, erase };
        (!modifiers.shift).then(|| LabelsCommand::BeginIn3d(Box::new(begin)))
    });
    let reach = format!("draws on {}", layers.name());
    let row = state.settings.mask.tool.row(&state.settings.mask);
    let tool = match row.draws {
        Some(DrawTool::Brush { radius_px }) => {
            let radius_mm = f64::from(radius_px) / state.rig().depth_px_per_mm();
            format!("{}, radius {}", row.name, units::text_mm(radius_mm * 1e-3))
        }
        _ => row.name.to_owned(),
    };
    let text = format!("{tool} {reach}\nShift + drag turns, the middle button moves");
    let galley = painter.layout(text, FontId::proportional(11.0), cx.p.strong, (rect.width() - 16.0).max(40.0));
    let back = eframe::egui::Rect::from_min_size(rect.min + vec2(8.0, 6.0), galley.size());
    painter.rect_filled(back.expand2(vec2(4.0, 1.0)), 3.0, cx.p.canvas.gamma_multiply(0.8));
    painter.galley(back.min, galley, cx.p.strong);
    if output.pointer.is_some() {
        let point = cx.shared.readout.take().filter(|_| meant.is_some());
        let reach = format!("{} {reach}", row.name);
        cx.shared.readout = Some(point.map_or(reach.clone(), |point| format!("{point}   {reach}")));
    }
}
