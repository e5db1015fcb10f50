//! The form of an export of masks: what goes where is said before anything is written.

use eframe::egui::{self, DragValue, RichText, vec2};
use strum::IntoEnumIterator as _;

use crate::app::action::Action;
use crate::app::command::ExportCommand;
use crate::app::export::Output;
use crate::app::results;
use crate::app::state::Lookup;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::caption;
use touch2touch_pipeline::export::{ExportChoice, Which};
use touch2touch_pipeline::io::exchange::Format;

/// The form, where it is open. It blocks nothing: pairs can be drawn and marked beside it.
pub(crate) fn form(cx: &mut Cx<'_>, ctx: &egui::Context) {
    if !cx.state.export.asking_masks {
        return;
    }
    let mut open = true;
    let mut choice = cx.state.export.masks;
    let window = egui::Window::new("Export masks").id(egui::Id::unique("mask export form")).open(&mut open);
    let middle = ctx.content_rect().center();
    let window = window.collapsible(false).resizable(false).pivot(egui::Align2::CENTER_CENTER).default_pos(middle);
    window.show(ctx, |ui| {
        ui.set_width(400.0);
        ui.spacing_mut().item_spacing = vec2(8.0, 6.0);
        choices(cx, ui, &mut choice);
        ui.separator();
        let ready = plan(cx, ui);
        ui.horizontal(|ui| {
            let write = ui.add_enabled(ready, egui::Button::new("Choose folder…"));
            let write = write.accessible_name("Choose the folder of the export");
            let tip = format!(
                "A new or empty folder, or a previous export. {}. Everything written is read back and checked.",
                choice.format.text()
            );
            if write.on_hover_text(tip).clicked() {
                cx.push(ExportCommand::Place(Output::Masks));
            }
            if ui.button("Close").on_hover_text("Writes nothing").clicked() {
                cx.push(ExportCommand::AskMasks(false));
            }
        });
    });
    if choice != cx.state.export.masks {
        cx.push(ExportCommand::SetMasks(choice));
    }
    if !open {
        cx.push(ExportCommand::AskMasks(false));
    }
}

fn choices(cx: &Cx<'_>, ui: &mut egui::Ui, choice: &mut ExportChoice) {
    ui.horizontal(|ui| {
        ui.label(caption("Masks", cx.p));
        for (which, text, tip) in [
            (Which::Done, "done", "Pairs marked \"done\" that have a mask drawn by hand"),
            (Which::Begun, "done and in progress", "Also pairs whose mask was begun"),
        ] {
            let radio = ui.radio(choice.which == which, text);
            if radio.on_hover_text(format!("{tip}. Never skipped or flagged pairs")).clicked() {
                choice.which = which;
            }
        }
    });
    ui.horizontal(|ui| {
        ui.label(caption("Format", cx.p));
        for format in Format::iter() {
            if ui.radio(choice.format == format, format.name()).on_hover_text(format.text()).clicked() {
                choice.format = format;
            }
        }
    });
    let tip =
        "Off: pairs reserved for tests (test_only) go to test, so that no model is scored on what it was trained on";
    ui.checkbox(&mut choice.test_in_train, "train on pairs reserved for tests").on_hover_text(tip);
    let tip = "So that scores are on tools the model was not trained on. Off: pairs are split one by one";
    ui.checkbox(&mut choice.by_tool, "keep each tool in one split").on_hover_text(tip);
    let tip = "All other pixels are written as ignored";
    ui.checkbox(&mut choice.manual_checked, "only pixels painted by hand").on_hover_text(tip);
    ui.horizontal(|ui| {
        ui.label(caption("Split seed", cx.p));
        let drag = ui.add(DragValue::new(&mut choice.seed).range(0..=999_999)).accessible_name("Split seed");
        drag.on_hover_text("The same seed always gives the same split, also when pairs are added");
    });
}

/// Division of the export; true where there is something to write.
fn plan(cx: &Cx<'_>, ui: &mut egui::Ui) -> bool {
    let Some(key) = results::mask_plan_key(cx.state) else { return false };
    match cx.state.look(key) {
        Lookup::Ready(plan) | Lookup::Stale(plan) => {
            for line in plan.lines() {
                ui.add(egui::Label::new(RichText::new(line).size(12.0).color(cx.p.text)).wrap());
            }
            if plan.total() == 0 {
                let what = Action::DoneAndNext.behind("Nothing to write yet: edit a mask and mark its pair done");
                ui.label(RichText::new(what).size(12.0).color(cx.p.caution));
            }
            plan.total() > 0
        }
        Lookup::Failed(err) => {
            ui.label(RichText::new(err.to_string()).size(12.0).color(cx.p.wrong));
            false
        }
        Lookup::Waiting | Lookup::Absent(_) => {
            ui.label(caption("…", cx.p));
            false
        }
    }
}
