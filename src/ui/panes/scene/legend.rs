//! The list of what a 3D view draws: what each color means, and switches for it; below it the bar of the color map.

use crate::app::results;
use crate::app::settings::prefer;
use eframe::egui::{
    self, Align2, Button, Color32, DragValue, FontId, Painter, Popup, PopupCloseBehavior, Rect, RichText, Role, Sense,
    Stroke, Ui, UiBuilder, WidgetInfo, pos2, vec2,
};
use strum::IntoEnumIterator as _;

use super::layers::{RESIDUAL_MAP, reason_rgb};
use super::{Memory, build, steps};
use crate::app::keys::ImprintSource;
use crate::app::settings::SceneLayer;
use crate::app::workbench::Layer;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{SMALL, caption};
use crate::ui::parts::widget::colorbar::gradient;
use touch2touch_core::align::reason::Reason;
use touch2touch_core::colormap::ColorMap;
use touch2touch_core::units;
use touch2touch_pipeline::compare::deviation::DISTANCE_MAP;

/// Height of a row, points.
const ROW: f32 = 17.0;
/// Width of the list, points.
const WIDTH: f32 = 152.0;

/// A line of the list.
struct Row {
    /// Layer that it switches; `None` explains a color only.
    layer: Option<SceneLayer>,
    color: Color32,
    text: String,
}

/// The list at the lower left corner of the `first` view; and the bar of the color map at the lower right one.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui, memory: &Memory, source: ImprintSource, rect: Rect, first: bool) {
    if first {
        list(cx, ui, memory, source, rect);
    }
    let painted = memory.layer_colors[source as usize].is_some();
    match cx.state.workbench.layer {
        Layer::Residuals if painted => residuals(cx, &ui.painter_at(rect), source, rect),
        Layer::Distance if painted => distances(cx, ui, source, rect),
        Layer::Distance if results::pose(cx.state, source).shown().is_some() => {
            let font = FontId::proportional(11.0);
            let at = bar(rect).right_top();
            ui.painter_at(rect).text(at, Align2::RIGHT_BOTTOM, "distances: computing…", font, cx.p.text);
        }
        _ => {}
    }
}

/// The colors of what is drawn, in a row; a click opens the list of names with their switches.
fn list(cx: &mut Cx<'_>, ui: &mut Ui, memory: &Memory, source: ImprintSource, rect: Rect) {
    const DOT: f32 = 11.0;
    let rows = rows(cx, memory, source);
    let shown = |row: &&Row| row.layer.is_none_or(|layer| cx.state.settings.scene.shows(layer));
    let drawn: Vec<&Row> = rows.iter().filter(shown).collect();
    let size = vec2(DOT * drawn.len() as f32 + 8.0, 18.0);
    let place = Rect::from_min_size(pos2(rect.left() + 6.0, rect.bottom() - 6.0 - size.y), size);
    let response = ui.interact(place, ui.scope_id().with("legend"), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, "Legend"));
    let fill = if response.hovered() { cx.p.control[1] } else { cx.p.canvas.gamma_multiply(0.6) };
    ui.painter().rect_filled(place, 9.0, fill);
    for (i, row) in drawn.iter().enumerate() {
        let center = place.left_center() + vec2(4.0 + DOT * (i as f32 + 0.5), 0.0);
        ui.painter().circle_filled(center, 3.5, row.color);
    }
    let response = response.on_hover_ui(|ui| {
        ui.label(RichText::new("Click to show or hide things").size(SMALL));
        for row in &drawn {
            ui.label(RichText::new(&row.text).size(SMALL).color(row.color));
        }
    });
    Popup::menu(&response).close_behavior(PopupCloseBehavior::CloseOnClickOutside).show(|ui| {
        ui.spacing_mut().item_spacing.y = 0.0;
        rows.iter().for_each(|row| line(cx, ui, source, row));
    });
}

/// Rows for everything that is drawn, or could be.
fn rows(cx: &Cx<'_>, memory: &Memory, source: ImprintSource) -> Vec<Row> {
    let state = cx.state;
    let mut rows = Vec::new();
    let mut add = |layer: SceneLayer, text: &str| {
        rows.push(Row { layer: Some(layer), color: build::color(cx, source, layer), text: text.to_owned() });
    };
    if memory.clouds[source as usize].is_some() {
        add(SceneLayer::Membrane, "membrane");
        add(SceneLayer::Contact, "contact points");
    }
    if state.workbench.both_clouds {
        let other = if source.other() == ImprintSource::Measured { "measured contact" } else { "predicted contact" };
        add(SceneLayer::OtherContact, other);
    }
    if memory.mesh.is_some() {
        let mut layers: Vec<SceneLayer> = build::models(cx, source).into_iter().map(|(layer, _)| layer).collect();
        layers.dedup();
        for layer in layers {
            add(layer, model_name(cx, source, layer));
        }
    }
    if let Some((color, about)) = steps::legend(cx, memory, source) {
        rows.push(Row { layer: None, color, text: about.to_owned() });
    }
    if state.workbench.layer == Layer::Reasons
        && memory.layer_colors[source as usize].is_some()
        && let Some(layers) = results::layers(state, source).ready()
    {
        // The reasons of the points that are drawn, with their counts.
        for reason in Reason::iter().filter(|r| !matches!(r, Reason::OutsideMask | Reason::InvalidDepth)) {
            let count: usize = layers.counts.iter().flatten().map(|counts| counts[reason as usize]).sum();
            if count > 0 {
                let [r, g, b] = reason_rgb(reason);
                rows.push(Row { layer: None, color: Color32::from_rgb(r, g, b), text: format!("{reason}: {count}") });
            }
        }
    }
    rows.push(Row { layer: Some(SceneLayer::Guides), color: cx.p.weak, text: "grid and axes".into() });
    rows
}

fn model_name(cx: &Cx<'_>, source: ImprintSource, layer: SceneLayer) -> &'static str {
    match layer {
        SceneLayer::Cad if cx.state.workbench.hand(source).is_some() => "CAD, being moved",
        SceneLayer::Cad if results::by_hand(cx.state, source).is_some() => "CAD, pose by hand",
        SceneLayer::TrueCad => "CAD, true pose",
        SceneLayer::Answers => "CAD, other answers",
        SceneLayer::OtherCad if source == ImprintSource::Measured => "CAD, predicted side",
        SceneLayer::OtherCad => "CAD, measured side",
        _ => "CAD, registered",
    }
}

/// A swatch and the name; a click shows or hides it.
fn line(cx: &mut Cx<'_>, ui: &mut Ui, source: ImprintSource, row: &Row) {
    let shown = row.layer.is_none_or(|layer| cx.state.settings.scene.shows(layer));
    let color = if shown { cx.p.text } else { cx.p.weak };
    let text = Button::new(RichText::new(format!("      {}", row.text)).size(SMALL).color(color)).frame(false);
    let button = ui.add(text.min_size(vec2(WIDTH, ROW)));
    let dot = pos2(button.rect.left() + 8.0, button.rect.center().y);
    if shown {
        ui.painter().circle_filled(dot, 4.5, row.color);
    } else {
        ui.painter().circle_stroke(dot, 4.0, Stroke::new(1.5, row.color));
    }
    let Some(layer) = row.layer else { return };
    let name = format!("Show {}, {}", row.text, source.name().to_lowercase());
    button.widget_info(|| WidgetInfo::selected(Role::CheckBox, true, shown, &name));
    if button.on_hover_text("Show or hide").clicked() {
        cx.push(prefer(move |s| s.scene.toggle(layer)));
    }
}

/// The place of the bar.
fn bar(rect: Rect) -> Rect {
    Rect::from_min_size(pos2(rect.right() - 160.0, rect.bottom() - 62.0), vec2(148.0, 9.0))
}

fn ends(painter: &Painter, bar: Rect, texts: [String; 3], color: Color32) {
    let anchors = [(0.0, Align2::LEFT_TOP), (0.5, Align2::CENTER_TOP), (1.0, Align2::RIGHT_TOP)];
    for ((share, anchor), text) in anchors.into_iter().zip(texts) {
        let below = pos2(bar.left() + bar.width() * share, bar.bottom() + 1.0);
        painter.text(below, anchor, text, FontId::proportional(10.0), color);
    }
}

fn colors(painter: &Painter, bar: Rect, map: ColorMap) {
    gradient(painter, bar, 32, |share| {
        let [r, g, b] = map.rgb8(share);
        Color32::from_rgb(r, g, b)
    });
}

/// Bar of the residuals' colors, with the width of the kernel.
fn residuals(cx: &Cx<'_>, painter: &Painter, source: ImprintSource, rect: Rect) {
    let Some(layers) = results::layers(cx.state, source).ready() else { return };
    let bar = bar(rect);
    colors(painter, bar, RESIDUAL_MAP);
    let end = units::mm(layers.range_m);
    ends(painter, bar, ["0".into(), format!("{:.0}", end / 2.0), format!("{end:.0} mm")], cx.p.text);
    let font = FontId::proportional(10.0);
    painter.text(bar.right_top() - vec2(0.0, 3.0), Align2::RIGHT_BOTTOM, "residual", font, cx.p.text);
    if let Some(kernel) = layers.kernel_m {
        let x = bar.left() + bar.width() * (kernel / layers.range_m) as f32;
        painter.vline(x, bar.top() - 3.0..=bar.bottom(), Stroke::new(1.5, cx.p.strong));
    }
}

/// Bar of the signed distances' colors; the reach is one for all views, and can be changed.
fn distances(cx: &mut Cx<'_>, ui: &mut Ui, source: ImprintSource, rect: Rect) {
    let (bar, view) = (bar(rect), source.name().to_lowercase());
    let painter = ui.painter_at(rect);
    colors(&painter, bar, DISTANCE_MAP);
    let mut mm = units::mm(f64::from(cx.state.settings.scene.distance_m));
    let texts = [format!("inside -{mm:.2}"), "0".into(), format!("+{mm:.2} mm")];
    ends(&painter, bar, texts, cx.p.text);
    let place = Rect::from_min_max(pos2(bar.left(), bar.top() - 20.0), pos2(bar.right(), bar.top() - 2.0));
    let builder = UiBuilder::new().max_rect(place).id_salt(("distances", &view));
    ui.scope_builder(builder, |ui| {
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let drag =
                DragValue::new(&mut mm).speed(0.02).range(0.01..=50.0).fixed_decimals(2).prefix("± ").suffix(" mm");
            let drag = ui.add(drag).accessible_name(format!("End of the distance scale, {view}"));
            let drag = drag.on_hover_text("Distance at the end of the color bar, in all views; double-click: 1 mm");
            let mut changed = drag.changed();
            if drag.double_clicked() {
                (mm, changed) = (1.0, true);
            }
            if changed {
                cx.push(prefer(move |s| s.scene.distance_m = (mm * 1e-3) as f32));
            }
            ui.label(caption("distance", cx.p));
        });
    });
}
