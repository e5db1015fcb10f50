//! The question about labels that are not on the disk.

use eframe::egui::{self, RichText};

use crate::app::command::{LabelsCommand, UnsavedCommand};
use crate::app::labels::Question;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::caption;
use touch2touch_core::units::counted;

/// The question, where there is one; it blocks everything else.
pub(crate) fn question(cx: &mut Cx<'_>, ctx: &egui::Context) {
    let Some(question) = cx.state.document.question else { return };
    // Closing waits a moment for what is being written: that is no question yet.
    let doc = &cx.state.document;
    if question == Question::Closing && doc.failed.is_empty() && doc.unsaved.is_empty() {
        return;
    }
    let mut answer = None;
    let modal = egui::Modal::new(egui::Id::unique("unsaved labels")).show(ctx, |ui| {
        ui.set_width(480.0);
        let heading = match question {
            Question::Closing if cx.state.document.failed.is_empty() => "Labels are being saved",
            Question::Closing => "Close without saving?",
            Question::Lost => "The data set is gone: nothing can be saved to it",
        };
        ui.label(RichText::new(heading).heading());
        said(cx, ui);
        ui.add_space(4.0);
        ui.horizontal(|ui| {
            let mut button = |text: &str, tip: &str, command| {
                if ui.button(text).on_hover_text(tip).clicked() {
                    answer = Some(command);
                }
            };
            button("Try again", "Saves again; this is also tried every few seconds", UnsavedCommand::Retry);
            let tip = "Saves them to a folder of your choice, to be taken in later";
            button("Save elsewhere…", tip, UnsavedCommand::AskFolder);
            match question {
                Question::Closing => {
                    button("Discard and close", "Closes the window and loses these labels", UnsavedCommand::Discard);
                    button("Stay open", "Changes nothing (Esc)", UnsavedCommand::Stay);
                }
                Question::Lost => {
                    let tip = "Keeps them in memory and keeps trying (Esc)";
                    button("Continue unsaved", tip, UnsavedCommand::Stay);
                }
            }
        });
    });
    // The path box comes above it, and has Escape first.
    if modal.should_close() && !cx.shared.dialogs.is_path_box_open() {
        answer = Some(UnsavedCommand::Stay);
    }
    if let Some(command) = answer {
        cx.push(LabelsCommand::Unsaved(command));
    }
}

/// Pairs that are not saved, and why.
fn said(cx: &Cx<'_>, ui: &mut egui::Ui) {
    let doc = &cx.state.document;
    let first = doc.unsaved.first().map_or("", String::as_str);
    let pairs = match doc.unsaved.len() {
        0 => "Everything is saved by now.".to_owned(),
        1 => format!("Not saved: the labels of {first}"),
        n => format!("Not saved: the labels of {}, starting with {first}", counted(n, "pair")),
    };
    ui.add(egui::Label::new(pairs).wrap());
    if let Some(err) = doc.failed.values().next() {
        ui.add(egui::Label::new(RichText::new(err.why.as_str()).color(cx.p.wrong)).wrap());
        if let Some(hint) = &err.hint {
            ui.add(egui::Label::new(caption(hint.as_str(), cx.p)).wrap());
        }
    }
}
