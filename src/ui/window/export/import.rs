//! The form of an import of masks: what would change is said before anything does.

use eframe::egui::{self, RichText, vec2};

use crate::app::command::ExportCommand;
use crate::app::keys::ImportForm;
use crate::app::results;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::caption;

use crate::app::state::Lookup;

/// The form, where it is open. It blocks nothing.
pub(crate) fn form(cx: &mut Cx<'_>, ctx: &egui::Context) {
    let Some(form) = cx.state.export.importing.clone() else { return };
    let mut open = true;
    let window = egui::Window::new("Import masks").id(egui::Id::unique("mask import form")).open(&mut open);
    let middle = ctx.content_rect().center();
    let window = window.collapsible(false).resizable(false).pivot(egui::Align2::CENTER_CENTER).default_pos(middle);
    window.show(ctx, |ui| {
        ui.set_width(400.0);
        ui.spacing_mut().item_spacing = vec2(8.0, 6.0);
        content(cx, ui, &form);
    });
    if !open {
        cx.push(ExportCommand::AskImport(None));
    }
}

fn content(cx: &mut Cx<'_>, ui: &mut egui::Ui, form: &ImportForm) {
    ui.add(egui::Label::new(caption(form.from.display().to_string(), cx.p)).wrap());
    let mut over_drawn = form.over_drawn;
    let tip = "Off: hand-drawn pixels stay, and so do the masks of pairs that are done, flagged or skipped. Can be undone, \
               pair by pair";
    let tick = ui.checkbox(&mut over_drawn, "also replace hand-drawn masks and reviewed pairs").on_hover_text(tip);
    if tick.changed() {
        cx.push(ExportCommand::ImportOverHand(over_drawn));
    }
    ui.separator();
    let ready = plan(cx, ui);
    ui.horizontal(|ui| {
        let import = ui.add_enabled(ready, egui::Button::new("Import")).accessible_name("Import these masks");
        let tip = "Makes them the masks of the measured imprints. No pair is marked done";
        if import.on_hover_text(tip).clicked() {
            cx.push(ExportCommand::Import);
        }
        if ui.button("Close").on_hover_text("Changes nothing").clicked() {
            cx.push(ExportCommand::AskImport(None));
        }
    });
}

/// Changes that the import would make; true where there are any.
fn plan(cx: &Cx<'_>, ui: &mut egui::Ui) -> bool {
    let Some(key) = results::import_plan_key(cx.state) else { return false };
    let mut line = |text: String, color| {
        ui.add(egui::Label::new(RichText::new(text).size(12.0).color(color)).wrap());
    };
    match cx.state.look(key) {
        Lookup::Ready(plan) | Lookup::Stale(plan) => {
            line(format!("Format: {}", plan.format.name()), cx.p.text);
            plan.lines().into_iter().for_each(|text| line(text, cx.p.text));
            if plan.total() == 0 {
                line("Nothing would change.".into(), cx.p.caution);
            }
            plan.total() > 0
        }
        Lookup::Failed(err) => {
            line(err.to_string(), cx.p.wrong);
            false
        }
        Lookup::Waiting | Lookup::Absent(_) => {
            line("Reading the masks…".into(), cx.p.weak);
            false
        }
    }
}
