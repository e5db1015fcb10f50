//! The mask tools: what draws, what was done, the review state, where masks come from, clean-ups.

mod progress;
mod source;

use crate::app::results;
use crate::app::settings::prefer;
use eframe::egui::{self, Align, Layout, RichText, ScrollArea, Ui, vec2};
use strum::IntoEnumIterator as _;

use super::browser::review_color;
use crate::app::action::{Action, with_keys};
use crate::app::command::{LabelsCommand, Pane, ViewCommand};
use crate::app::keys::ImprintSource;
use crate::app::labels::Review;
use crate::app::settings::{BRUSH_RADIUS_PX, CLEAN_MM, MaskSettings, MaskTool, ToolRow};
use crate::app::state::Lookup;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{CONTACT, IGNORED, PROPOSED, SMALL, caption, section};
use crate::ui::parts::widget::choice::choose;
use crate::ui::parts::widget::icon::{self, Icon};
use crate::ui::parts::widget::scroll_to_focus;
use touch2touch_core::label::{DrawTool, Paint};
use touch2touch_core::units;
use touch2touch_pipeline::labels::MAX_NOTE;

/// The note being typed.
#[derive(Default)]
pub(crate) struct Memory {
    /// The pair that it is of.
    pair: String,
    /// The text.
    note: String,
    /// True while it is being typed.
    typing: bool,
}

/// The pane.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory, _: Pane) {
    if let Some(err) = cx.state.document.blocked(cx.state.pair_name()) {
        ui.label(RichText::new("The stored labels of this pair cannot be read.").color(cx.p.wrong));
        ui.label(caption(format!("{err} They are left untouched, and this pair cannot be edited."), cx.p));
        return;
    }
    ScrollArea::vertical().id_salt("masks").show(ui, |ui| {
        // What every mask takes comes first, each line in a place of its own: nothing moves under the pointer.
        tools(cx, ui);
        paints(cx, ui);
        said(cx, ui);
        review(cx, ui);
        source::show(cx, ui);
        fold(ui, "Clean up", "One-click clean-ups of the mask", |ui| clean_ups(cx, ui));
        note(cx, ui, memory);
        fold(ui, "More", "Opacity, which mask is edited", |ui| {
            opacity(cx, ui);
            correct(cx, ui);
        });
        progress::show(cx, ui);
        scroll_to_focus(ui);
    });
}

/// A row that unfolds.
fn fold(ui: &mut Ui, name: &str, tip: &str, add: impl FnOnce(&mut Ui)) {
    let header = egui::CollapsingHeader::new(RichText::new(name).size(SMALL)).id_salt(name);
    header.show(ui, add).header_response.on_hover_text(tip);
}

fn sign(tool: MaskTool) -> Icon {
    match tool {
        MaskTool::Brush => Icon::Brush,
        MaskTool::Eraser => Icon::Eraser,
        MaskTool::Lasso => Icon::Lasso,
        MaskTool::Polygon => Icon::Polygon,
        MaskTool::Rectangle => Icon::Rectangle,
        MaskTool::Wand => Icon::Wand,
        MaskTool::Pan => Icon::Hand,
    }
}

/// Height of a line that may have a number to drag or none, points: what lies below stays where it is.
const LINE: f32 = 24.0;

/// The tools in a row; below them the number of the one in hand, and the way back.
fn tools(cx: &mut Cx<'_>, ui: &mut Ui) {
    const GAP: f32 = 2.0;
    let count = MaskTool::iter().count() as f32;
    // In a narrow window they are narrower.
    let wide = ((ui.available_width() - 4.0) / count - GAP).clamp(18.0, icon::SIZE.x);
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = GAP;
        for tool in MaskTool::iter() {
            let (mask, row) = (&cx.state.settings.mask, tool.row(&cx.state.settings.mask));
            let key = row.action.key_text();
            let button =
                icon::Button { icon: sign(tool), key: &key, name: row.name, enabled: true, on: mask.tool == tool };
            let help = format!("{}: {}", row.name, row.action.help());
            if button.show(ui, vec2(wide, icon::SIZE.y)).on_hover_text(help).clicked() {
                cx.act(row.action);
            }
        }
    });
    ui.horizontal(|ui| {
        ui.set_height(LINE);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.spacing_mut().item_spacing.x = GAP;
            undo(cx, ui);
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                ui.spacing_mut().item_spacing.x = 4.0;
                let mask = &cx.state.settings.mask;
                match mask.tool.row(mask) {
                    ToolRow { draws: Some(DrawTool::Brush { .. }), .. } => radius(cx, ui),
                    ToolRow { draws: Some(DrawTool::Wand { .. }), .. } => wand(cx, ui),
                    row => _ = ui.add(egui::Label::new(caption(row.hint, cx.p)).truncate()),
                }
            });
        });
    });
}

/// Choice of what the tools make of the pixels.
fn paints(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let now = cx.state.settings.mask.paint;
        for (paint, text, tip, color) in [
            (Paint::Contact, "contact", "The tools add contact; the right button removes it".to_owned(), CONTACT),
            (Paint::Ignore, "ignore", Action::PaintIgnore.help(), IGNORED),
            (Paint::LetThrough, "proposal", "The tools accept the suggestion where they paint".to_owned(), PROPOSED),
        ] {
            if paint == Paint::LetThrough && now != paint && !results::proposes(cx.state) {
                continue;
            }
            let text = RichText::new(text).color(if now == paint { color } else { cx.p.text });
            if ui.add(egui::Button::selectable(now == paint, text)).on_hover_text(tip).clicked() {
                cx.push(prefer(move |s| s.mask.paint = paint));
            }
        }
    });
}

/// Redo and undo, with what they would take back.
fn undo(cx: &mut Cx<'_>, ui: &mut Ui) {
    let (name, shown) = (cx.state.pair_name(), results::mask_places(cx.state));
    let undo = cx.state.history.next_undo(name, &shown).map(|g| g.name.clone());
    let redo = cx.state.history.next_redo(name, &shown).map(|g| g.name.clone());
    for (action, icon, what) in [(Action::Redo, Icon::Redo, redo), (Action::Undo, Icon::Undo, undo)] {
        let enabled = action.command(cx.state).is_some();
        let button = icon::Button { icon, key: "", name: action.name(), enabled, on: false };
        let what = what.map_or(String::new(), |what| format!(" {what}"));
        let tip = action.behind(&format!("{}{what}", action.name()));
        if button.show(ui, vec2(24.0, LINE)).on_hover_text(tip).clicked() {
            cx.act(action);
        }
    }
}

/// Room for two lines about what was done last: the proposal where one is shown, else the effect of the last change.
fn said(cx: &Cx<'_>, ui: &mut Ui) {
    const LINES: f32 = 28.0;
    let size = vec2(ui.available_width(), LINES);
    let (place, _) = ui.allocate_exact_size(size, egui::Sense::hover());
    // A child of its own: what it holds does not move what lies below.
    let mut ui = ui.new_child(egui::UiBuilder::new().max_rect(place));
    ui.set_clip_rect(place.intersect(ui.clip_rect()));
    ui.spacing_mut().item_spacing.y = 0.0;
    if results::proposes(cx.state) {
        source::said(cx, &mut ui);
    } else {
        effect(cx, &mut ui);
    }
}

fn radius(cx: &mut Cx<'_>, ui: &mut Ui) {
    let mut radius = cx.state.settings.mask.radius_px;
    let drag = egui::DragValue::new(&mut radius).speed(0.1).range(BRUSH_RADIUS_PX).fixed_decimals(1);
    let drag = drag.prefix("radius ").suffix(" px");
    let response = ui.add(drag).accessible_name("Brush radius");
    if response.double_clicked() {
        radius = MaskSettings::default().radius_px;
    }
    if response.changed() || response.double_clicked() {
        cx.push(prefer(move |s| s.mask.radius_px = radius));
    }
    let mm = f64::from(radius) / cx.state.rig().depth_px_per_mm();
    ui.label(caption(format!("{mm:.2} mm"), cx.p));
    let tip = "Radius of brush and eraser, image pixels: drag or type; [[brush_smaller]] and [[brush_larger]], Shift + wheel \
               or Alt + move over the image. Double-click resets";
    response.on_hover_text(with_keys(tip));
}

/// A slider over millimeters of a length in meters; whether it changed.
fn slider_mm(ui: &mut Ui, name: &str, meters: &mut f32, range: std::ops::RangeInclusive<f32>, tip: &str) -> bool {
    let mut mm = *meters * 1e3;
    let slider = egui::Slider::new(&mut mm, range).fixed_decimals(2).suffix(" mm");
    let changed = ui.add(slider).accessible_name(name).on_hover_text(tip).changed();
    if changed {
        *meters = mm * 1e-3;
    }
    changed
}

fn wand(cx: &mut Cx<'_>, ui: &mut Ui) {
    let mut new = cx.state.settings.mask.clone();
    ui.spacing_mut().slider_width = (ui.available_width() - 76.0).max(30.0);
    let tip = "How much the depth may differ from that of the clicked point; drag right to double it, left to halve it";
    if slider_mm(ui, "Wand tolerance", &mut new.wand_m, 0.01..=5.0, tip) {
        cx.push(prefer(move |s| s.mask = new.clone()));
    }
}

fn correct(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.add_space(2.0);
    let finger = cx.state.selection.finger;
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        ui.label(section(&format!("Edit, {}", cx.state.finger_name(finger)), cx.p));
        let worked_on = results::worked_on(cx.state, finger);
        for source in ImprintSource::iter() {
            let there = results::imprint(cx.state, source, finger).ready().is_some();
            let button = ui.add_enabled(there, egui::Button::selectable(worked_on == source, source.name()));
            let button = button.accessible_name(format!("Correct the {} imprint's mask", source.key()));
            let tip = "The imprint whose mask the buttons below change: the last one you painted on";
            if button.on_hover_text(tip).on_disabled_hover_text("No such imprint yet").clicked() {
                cx.push(ViewCommand::SelectImprint(source));
            }
        }
    });
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        cx.action_button(ui, Action::AdoptAutomatic, "Copy automatic");
        cx.action_button(ui, Action::ResetMask, "Reset");
    });
}

/// Effect of the last change of a mask on the pose, as soon as that is registered again.
fn effect(cx: &Cx<'_>, ui: &mut Ui) {
    let Some(changed) = cx.state.document.changed.as_ref().filter(|c| c.pair == cx.state.pair_name()) else { return };
    let deg = |rad: f64| units::text_deg(rad);
    let before = changed.before.as_ref().and_then(|key| results::pose_of(cx.state, key));
    let (text, color) = match (results::pose(cx.state, changed.source), before) {
        (Lookup::Ready(pose), Some(before)) => {
            let (from, to) = (before.angle_rad, pose.angle_rad);
            let change = units::wrap_angle(to - from).to_degrees();
            let mut text = format!("Angle {} (was {}, {change:+.1}°)", deg(to), deg(from));
            let mut color = cx.p.text;
            if let (Some(from), Some(to)) = (before.error_rad, pose.error_rad) {
                let [before, now] = [from, to].map(deg);
                text += &format!(", error {now} (was {before})");
                color = match before == now {
                    true => cx.p.text,
                    false if to < from => cx.p.good,
                    false => cx.p.caution,
                };
            }
            (text, color)
        }
        (Lookup::Stale(_) | Lookup::Waiting, _) => (format!("{}: registering…", changed.name), cx.p.weak),
        (Lookup::Failed(err), _) => (format!("{}: no pose: {}", changed.name, err.why), cx.p.caution),
        (Lookup::Absent(_), _) | (Lookup::Ready(_), None) => return,
    };
    let label = egui::Label::new(RichText::new(text).size(SMALL).color(color)).wrap();
    ui.add(label).on_hover_text(format!("Effect of the last change ({}) on the angle", changed.name));
}

/// `saved 12:03:11`, or what is not saved yet.
pub(crate) fn save_state(cx: &Cx<'_>, ui: &mut Ui) {
    let (text, color) = if cx.state.document.stroke.is_some() {
        ("unsaved stroke".to_owned(), cx.p.caution)
    } else {
        crate::ui::parts::saved::text(&cx.shared.saved, &cx.state.document, cx.state.pair_name(), cx.p)
    };
    if !text.is_empty() {
        ui.label(RichText::new(text).size(SMALL).color(color)).on_hover_text("Labels are saved after every change");
    }
}

fn clean_ups(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(4.0, 4.0);
        for (action, text) in [
            (Action::FillHoles, "Fill holes"),
            (Action::LargestIsland, "Largest"),
            (Action::SmoothMask, "Smooth"),
            (Action::GrowMask, "Grow"),
            (Action::ShrinkMask, "Shrink"),
        ] {
            cx.action_button(ui, action, text);
        }
    });
    ui.horizontal(|ui| {
        ui.label(caption("by", cx.p));
        let mut new = cx.state.settings.mask.clone();
        ui.spacing_mut().slider_width = (ui.available_width() - 76.0).max(40.0);
        let slider = egui::Slider::new(&mut new.clean_mm, CLEAN_MM).logarithmic(true).fixed_decimals(2).suffix(" mm");
        let slider = ui.add(slider).accessible_name("Clean-up size");
        let tip = "Radius of Smooth, Grow and Shrink; below one pixel nothing changes";
        if slider.on_hover_text(tip).changed() {
            cx.push(prefer(move |s| s.mask = new.clone()));
        }
    });
}

/// The review state, and the way on.
fn review(cx: &mut Cx<'_>, ui: &mut Ui) {
    let current = cx.state.document.review(cx.state.pair_name());
    let editable = cx.state.document.is_editable(cx.state.pair_name());
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let text = RichText::new(current.name()).color(review_color(cx.p, current));
        ui.add_enabled_ui(editable, |ui| {
            let combo = egui::ComboBox::from_id_salt("review")
                .width((ui.available_width() - 110.0).clamp(48.0, 100.0))
                .selected_text(text)
                .truncate();
            let (name, said) = (("Review state", "The review state of this pair"), |r: &Review| (r.name(), ""));
            if let Some(review) = choose(ui, combo, name, Some(&current), Review::iter(), said) {
                cx.push(LabelsCommand::SetReview(review));
            }
        });
        cx.action_button(ui, Action::DoneAndNext, "Done and next");
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| save_state(cx, ui));
    });
}

/// The note of the pair: what is typed becomes part of the document when the field is left, as one change.
fn note(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory) {
    let name = cx.state.pair_name();
    let closing = ui.input(|i| i.viewport().close_requested());
    // Another pair was chosen meanwhile, or the window closes: the text is of the pair it was typed for.
    if memory.typing && (memory.pair != name || closing) {
        memory.typing = false;
        cx.out.push(LabelsCommand::SetNote(memory.pair.clone(), memory.note.clone()).into());
    }
    if !memory.typing {
        name.clone_into(&mut memory.pair);
        cx.state.document.note(name).clone_into(&mut memory.note);
    }
    let editable = cx.state.document.is_editable(name);
    let edit = egui::TextEdit::singleline(&mut memory.note)
        .hint_text("Note")
        .char_limit(MAX_NOTE)
        .desired_width(ui.available_width() - 8.0);
    let response = ui.add_enabled(editable, edit).accessible_name("Note");
    memory.typing |= response.has_focus();
    if memory.typing && response.lost_focus() {
        memory.typing = false;
        cx.push(LabelsCommand::SetNote(memory.pair.clone(), memory.note.clone()));
    }
    let tip = "A note about this pair. The list marks pairs with notes, and its filter searches them";
    response.on_hover_text(tip);
}

fn opacity(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.label(caption("Opacity", cx.p));
        let mut opacity = cx.state.settings.mask_opacity;
        ui.spacing_mut().slider_width = (ui.available_width() - 76.0).max(40.0);
        let response =
            ui.add(egui::Slider::new(&mut opacity, 0.0..=1.0).fixed_decimals(2)).accessible_name("Mask opacity");
        if response.changed() {
            cx.push(prefer(move |s| s.mask_opacity = opacity));
        }
        response.on_hover_text("How strongly the mask covers the image (- and =). Hold X to hide it");
    });
}
