//! The depth chain: what is implausible, every stage with picture and figures, the result against the truth, and the
//! other ways to read the same picture.

mod plots;

use crate::app::results;
use crate::app::settings::prefer;
use eframe::egui::{
    self, Align, Align2, FontId, Layout, Rect, RichText, Role, ScrollArea, Sense, Stroke, Ui, UiBuilder, WidgetInfo,
    pos2, vec2,
};
use strum::IntoEnumIterator as _;

use super::images;
use crate::app::action::Action;
use crate::app::command::{Pane, ViewCommand};
use crate::app::keys::{ImprintSource, ShiftMode, shift_tooltip};
use crate::app::state::Lookup;
use crate::app::tasks::TaskKind;
use crate::ui::parts::cx::{Cx, side_color};
use crate::ui::parts::theme::{SMALL, caption, medium, pane_frame, section};
use crate::ui::parts::widget::texture::depth_image;
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::postprocess::{
    ChainReading, CorrectionPart, CorrectionParts, Flag, Severity, Stage, StageRecord,
};
use touch2touch_core::rig::PadId;
use touch2touch_core::units::{fixed, mm};
use touch2touch_work::ledger::LedgerResult;

/// From this width on the stages stand beside the plots.
const WIDE: f32 = 620.0;
/// From this width on a stage's histogram stands beside its figures.
const BESIDE: f32 = 330.0;
/// Size of a stage's picture.
const THUMB: egui::Vec2 = vec2(60.0, 48.0);
/// Width of a column of figures.
const FIGURE: f32 = 46.0;

/// Nothing is kept between frames.
pub(crate) type Memory = ();

/// The pane.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, (): &mut Memory, _: Pane) {
    let finger = cx.state.selection.finger;
    let lookup = results::ledger(cx.state, finger);
    let Some(chain) = lookup.shown() else {
        return match lookup {
            Lookup::Failed(err) => images::failed(cx, ui, err),
            Lookup::Absent(absent) => images::absent_text(cx, ui, absent),
            _ => {
                pane_frame(cx.p).show(ui, |ui| {
                    ui.set_min_size(ui.available_size());
                    ui.label(caption("…", cx.p));
                });
            }
        };
    };
    pane_frame(cx.p).show(ui, |ui| {
        ui.set_min_size(ui.available_size());
        ScrollArea::vertical().id_salt("depth chain").show(ui, |ui| {
            ui.spacing_mut().item_spacing.y = 2.0;
            head(cx, ui, finger);
            fit_parts(cx, ui, chain);
            flags(cx, ui, &chain.ledger.flags);
            let width = ui.available_width();
            if width >= WIDE {
                let left = (width * 0.58).floor();
                let top = ui.cursor().min;
                let column = |ui: &mut Ui, x: f32, w: f32, add: &mut dyn FnMut(&mut Ui)| {
                    let rect = Rect::from_min_size(pos2(top.x + x, top.y), vec2(w, f32::INFINITY));
                    ui.scope_builder(UiBuilder::new().max_rect(rect).layout(Layout::top_down(Align::Min)), |ui| {
                        ui.set_width(w);
                        add(ui);
                    });
                };
                column(ui, 0.0, left - 12.0, &mut |ui| stages(cx, ui, chain, finger));
                let bottom = ui.min_rect().bottom();
                column(ui, left, width - left - 4.0, &mut |ui| against(cx, ui, chain, finger));
                let bottom = bottom.max(ui.min_rect().bottom());
                ui.advance_cursor_after_rect(Rect::from_min_max(top, pos2(top.x + width, bottom)));
            } else {
                stages(cx, ui, chain, finger);
                against(cx, ui, chain, finger);
            }
        });
    });
}

/// Choice of the finger and of the mapping.
fn head(cx: &mut Cx<'_>, ui: &mut Ui, finger: PadId) {
    ui.horizontal_wrapped(|ui| {
        for of in cx.state.rig().pads() {
            let name = cx.state.finger_name(of);
            let text = RichText::new(&*name).size(SMALL);
            let button = ui.add(egui::Button::selectable(of == finger, text).min_size(vec2(0.0, 20.0)));
            let button = button.accessible_name(format!("Depth chain of the {name} finger"));
            if button.on_hover_text("The finger that the chain is of").clicked() {
                cx.push(ViewCommand::SelectFinger(of));
            }
        }
        ui.label(caption("Shift", cx.p));
        let current = cx.state.settings.shift;
        let combo = egui::ComboBox::from_id_salt("chain shift")
            .width((ui.available_width() - 12.0).clamp(60.0, 170.0))
            .truncate()
            .selected_text(current.label());
        let response = combo.show_ui(ui, |ui| {
            let own = cx.state.settings.refit.map(ShiftMode::Refit);
            for mode in ShiftMode::iter().chain(own) {
                let label = ui.selectable_label(mode == current, mode.label());
                if label.on_hover_text(shift_tooltip(mode)).clicked() {
                    cx.out.push(prefer(move |s| s.shift = mode).into());
                }
            }
        });
        response.response.accessible_name("Shift of the depth chain").on_hover_text(shift_tooltip(current));
    });
    match cx.state.tasks.of_kind(TaskKind::Refit) {
        Some((_, task)) => cx.under_way(ui, task, &task.progress.text),
        None => {
            cx.action_button(ui, Action::Refit, "Refit on this data set");
        }
    }
}

/// The parts of a model's fit to a rig, each with a switch; nothing for a model without one.
fn fit_parts(cx: &mut Cx<'_>, ui: &mut Ui, chain: &LedgerResult) {
    let current = cx.state.settings.shift;
    let parts = match current {
        ShiftMode::Parts(parts) => parts,
        _ if chain.ledger.stages.iter().any(|stage| matches!(stage.stage, Stage::Corrected(_))) => CorrectionParts::ALL,
        _ => return,
    };
    ui.horizontal_wrapped(|ui| {
        ui.label(caption("Fit", cx.p))
            .on_hover_text("What the model's fit to a rig adds; switch a part off to see what it does");
        for part in CorrectionPart::iter() {
            let mut on = parts.has(part);
            if ui.checkbox(&mut on, RichText::new(part.label()).size(SMALL)).on_hover_text(part.tip()).changed() {
                let next = parts.with(part, on);
                let mode = if next == CorrectionParts::ALL { ShiftMode::ExactInverse } else { ShiftMode::Parts(next) };
                cx.out.push(prefer(move |s| s.shift = mode).into());
            }
        }
    });
}

fn flags(cx: &Cx<'_>, ui: &mut Ui, flags: &[Flag]) {
    if flags.is_empty() {
        let response = ui.label(RichText::new("Nothing implausible").size(SMALL).color(cx.p.good));
        response.on_hover_text("Range, orientation, clamping, constancy and the line against the truth were checked");
        return;
    }
    for flag in flags {
        let color = match flag.severity {
            Severity::Wrong => cx.p.wrong,
            Severity::Caution => cx.p.caution,
            Severity::Info => cx.p.weak,
        };
        let response = ui.horizontal(|ui| {
            ui.add_space(8.0);
            ui.vertical(|ui| {
                ui.spacing_mut().item_spacing.y = 0.0;
                ui.add(egui::Label::new(RichText::new(&flag.what).size(SMALL).color(cx.p.strong)).wrap());
                let rest = format!("{} {}", flag.why, flag.action);
                ui.add(egui::Label::new(RichText::new(rest).size(SMALL).color(cx.p.weak)).wrap());
            });
        });
        let rect = response.response.rect;
        let bar = Rect::from_min_max(rect.left_top(), pos2(rect.left() + 3.0, rect.bottom()));
        ui.painter().rect_filled(bar, 1.0, color);
        response.response.on_hover_text(format!("Shows at the stage \"{}\"", flag.stage));
        ui.add_space(2.0);
    }
}

fn stages(cx: &mut Cx<'_>, ui: &mut Ui, chain: &LedgerResult, finger: PadId) {
    ui.add_space(2.0);
    ui.label(section("Stages", cx.p)).on_hover_text(
        "From the decoder (no unit, -1 to 1) to meters. Pictures and histograms span each stage's own values",
    );
    for record in &chain.ledger.stages {
        stage(cx, ui, record, finger);
    }
}

fn stage(cx: &mut Cx<'_>, ui: &mut Ui, record: &StageRecord, finger: PadId) {
    let width = ui.available_width();
    let (rect, response) = ui.allocate_exact_size(vec2(width, THUMB.y + 4.0), Sense::hover());
    let meters = record.stage.is_meters();
    let (unit, scale, digits) = if meters { ("mm", 1e3, 2) } else { ("", 1.0, 2) };
    let s = &record.stats;
    let number = |v: f64| if v.is_finite() { fixed(v * scale, digits) } else { "–".to_owned() };
    let figures = [("min", s.min), ("mean", s.mean), ("std", s.std), ("max", s.max)].map(|(n, v)| (n, number(v)));
    let name = record.stage.name();
    response.widget_info(|| {
        let all: Vec<String> = figures.iter().map(|(n, v)| format!("{n} {v}")).collect();
        WidgetInfo::labeled(Role::Image, true, format!("Stage {name}: {} {unit}", all.join(" ")))
    });

    let thumb = Rect::from_min_size(rect.min + vec2(0.0, 2.0), THUMB);
    let key = (results::chosen(cx.state, finger), cx.state.settings.shift, record.stage);
    let range = Range { lo: s.min as f32, hi: s.max as f32 };
    let picture = cx.shared.textures.get(ui.ctx(), ("stage", record.stage), key, false, || {
        (depth_image(&record.image, ColorMap::Viridis, range), None)
    });
    let painter = ui.painter_at(rect);
    let uv = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    // In its own proportions: the decoder's picture is square.
    let [w, h] = record.image.size().map(|n| n.max(1) as f32);
    let fit = (thumb.width() / w).min(thumb.height() / h);
    painter.rect_filled(thumb, 0.0, cx.p.canvas);
    let inside = Rect::from_center_size(thumb.center(), vec2(w, h) * fit);
    painter.image(picture.texture.id(), inside, uv, egui::Color32::WHITE);

    let small = FontId::proportional(SMALL);
    let x = thumb.right() + 8.0;
    let plot = width >= BESIDE;
    let right = if plot { rect.right() - 4.0 - ((width - BESIDE) * 0.5 + 64.0).min(200.0) } else { rect.right() };
    let text = ui.painter_at(Rect::from_min_max(rect.min, pos2(right - 6.0, rect.bottom())));
    let color = if record.stage == Stage::Turned { side_color(cx.p, ImprintSource::Predicted) } else { cx.p.strong };
    text.text(pos2(x, rect.top() + 1.0), Align2::LEFT_TOP, &name, FontId::new(12.0, medium()), color);
    text.text(pos2(x, rect.top() + 15.0), Align2::LEFT_TOP, &record.how, FontId::proportional(10.0), cx.p.weak);
    // Room for the unit after the last.
    let column = ((right - 6.0 - x - 18.0) / 4.0).min(FIGURE + 6.0);
    for (i, (label, value)) in figures.iter().enumerate() {
        let right_x = x + column * (i as f32 + 1.0) - 4.0;
        text.text(pos2(right_x, rect.top() + 27.0), Align2::RIGHT_TOP, label, FontId::proportional(9.0), cx.p.weak);
        text.text(pos2(right_x, rect.top() + 37.0), Align2::RIGHT_TOP, value, small.clone(), cx.p.strong);
    }
    text.text(
        pos2(x + 4.0 * column - 2.0, rect.top() + 38.0),
        Align2::LEFT_TOP,
        unit,
        FontId::proportional(9.0),
        cx.p.weak,
    );
    if plot {
        let area = Rect::from_min_max(pos2(right, rect.top() + 3.0), pos2(rect.right() - 2.0, rect.bottom() - 3.0));
        let color = if meters { side_color(cx.p, ImprintSource::Predicted) } else { cx.p.weak };
        plots::histogram(&painter, area, &record.histogram, scale, color, cx.p);
    }
    painter.hline(rect.x_range(), rect.bottom() + 0.5, Stroke::new(1.0, cx.p.line));
    let [w, h] = record.image.size();
    let mut tip = format!("{name}: {}. {w} x {h} pixels", record.how);
    if record.invalid > 0 {
        tip += &format!(", {} without a number", record.invalid);
    }
    if let Some(note) = &record.note {
        tip += &format!(". {note}");
    }
    response.on_hover_text(tip);
}

fn against(cx: &mut Cx<'_>, ui: &mut Ui, chain: &LedgerResult, finger: PadId) {
    ui.add_space(2.0);
    ui.label(section("Prediction against truth", cx.p)).on_hover_text(
        "How many pixels have which measured and which predicted depth; brighter is more. Dashed: equal. Solid: the \
         line that the depths agree with, every depth counting alike",
    );
    match &chain.ledger.against {
        Some(against) => {
            let side = ui.available_width().clamp(96.0, 220.0);
            let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), side), Sense::hover());
            let joint = &against.joint;
            let line = joint.line;
            let text = match line {
                Some(l) => format!("slope {}, offset {} mm", fixed(l.slope, 3), fixed(mm(l.offset), 2)),
                None => "no slope: the truth is flat".to_owned(),
            };
            response.widget_info(|| WidgetInfo::labeled(Role::Image, true, format!("Joint histogram: {text}")));
            let key = (results::chosen(cx.state, finger), cx.state.settings.shift, cx.p.canvas);
            let canvas = cx.p.canvas;
            let picture = cx
                .shared
                .textures
                .get(ui.ctx(), "joint", key, true, || (plots::joint_image(&joint.counts, canvas), None))
                .texture
                .id();
            plots::joint(ui, rect, picture, joint, cx.p);
            ui.label(RichText::new(text).size(SMALL).color(cx.p.strong))
                .on_hover_text("Prediction = slope · truth + offset; 1 and 0 are right");
            let o = &against.orientation;
            let r = |v: Option<f64>| v.map_or("–".to_owned(), |v| fixed(v, 2));
            let text = format!(
                "correlation {}   turned 180° {}   mirrored {}",
                r(o.as_is),
                r(o.turned_180),
                r(o.rows_reversed)
            );
            ui.add(egui::Label::new(caption(text, cx.p)).wrap())
                .on_hover_text("With the truth as it lies, turned by 180°, and with its rows reversed");
        }
        None => {
            ui.label(caption("No measured imprint to compare with.", cx.p));
        }
    }
    readings(cx, ui, &chain.readings);
}

/// Readings of the decoder's picture in every way; a click takes that way.
fn readings(cx: &mut Cx<'_>, ui: &mut Ui, readings: &[ChainReading]) {
    ui.add_space(4.0);
    ui.label(section("Readings", cx.p))
        .on_hover_text("The same decoder picture with every mapping and shift: click one to use it");
    ui.spacing_mut().item_spacing.y = 0.0;
    let width = ui.available_width();
    let column = ((width - 118.0) / 4.0).clamp(30.0, 56.0);
    let row = |ui: &mut Ui, name: &str, cells: [String; 4], on: bool, clickable: bool, head: bool| {
        let sense = if clickable { Sense::click() } else { Sense::hover() };
        let (rect, response) = ui.allocate_exact_size(vec2(width, 16.0), sense);
        response.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("Reading {name}")));
        if on || (clickable && response.hovered()) {
            ui.painter().rect_filled(rect, 2.0, if on { cx.p.selected } else { cx.p.control[0] });
        }
        let painter = ui.painter_at(rect);
        let color = if head { cx.p.weak } else { cx.p.text };
        let font = FontId::proportional(SMALL);
        painter.text(pos2(rect.left() + 2.0, rect.center().y), Align2::LEFT_CENTER, name, font.clone(), color);
        for (i, cell) in cells.iter().rev().enumerate() {
            let end = pos2(rect.right() - 2.0 - column * i as f32, rect.center().y);
            painter.text(end, Align2::RIGHT_CENTER, cell, font.clone(), if head { cx.p.weak } else { cx.p.strong });
        }
        response
    };
    row(ui, "", ["mean mm", "slope", "off. mm", "dB"].map(str::to_owned), false, false, true);
    let current = cx.state.settings.shift;
    let mut chosen = None;
    for reading in readings {
        let number = |v: Option<f64>, digits: usize| v.map_or("–".to_owned(), |v| fixed(v, digits));
        let own = cx.state.settings.refit.map(ShiftMode::Refit);
        let mode = ShiftMode::iter().chain(own).find(|mode| mode.label() == reading.name);
        let cells = [
            fixed(mm(reading.stats.mean), 2),
            number(reading.line.map(|l| l.slope), 2),
            number(reading.line.map(|l| mm(l.offset)), 2),
            number(reading.psnr_db, 1),
        ];
        let response = row(ui, &reading.name, cells, mode == Some(current), mode.is_some(), false);
        if response.clicked() {
            chosen = mode;
        }
        let [gain, offset] = reading.shift;
        response.on_hover_text(format!(
            "{}: {gain:.3} · value {} {} mm after the {} mapping. Mean, slope and offset against the truth, PSNR (peak \
             22.5 mm)",
            reading.name,
            if offset < 0.0 { "-" } else { "+" },
            fixed(mm(offset.abs()), 2),
            match reading.mapping {
                touch2touch_core::postprocess::Mapping::Correct => "correct",
                touch2touch_core::postprocess::Mapping::Doubled => "doubled",
            }
        ));
    }
    if let Some(mode) = chosen {
        cx.push(prefer(move |s| s.shift = mode));
    }
}
