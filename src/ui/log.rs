//! What happened: the log pane, and the notices that appear once.

use eframe::egui::{self, Align2, Color32, RichText, ScrollArea, Ui, vec2};

use super::cx::Cx;
use super::theme::{Palette, SMALL, caption};
use crate::app::command::{Pane, TasksCommand};
use crate::app::tasks::{Entry, Level};

/// Notices on screen at once.
const MOST: usize = 3;

fn color(p: &Palette, level: Level) -> Color32 {
    match level {
        Level::Info => p.text,
        Level::Warning => p.caution,
        Level::Error => p.wrong,
    }
}

fn entry_ui(cx: &mut Cx<'_>, ui: &mut Ui, entry: &Entry) {
    let p = cx.p;
    let count = if entry.count > 1 { format!(" ({} times)", entry.count) } else { String::new() };
    ui.add(egui::Label::new(RichText::new(format!("{}{count}", entry.text)).color(color(p, entry.level))).wrap());
    if let Some(place) = &entry.place {
        ui.horizontal(|ui| {
            let show = ui.link(RichText::new("Show in its folder").size(12.0));
            if show.on_hover_text(place.display().to_string()).clicked() {
                cx.push(TasksCommand::Reveal(place.clone()));
            }
            let copy = ui.link(RichText::new("Copy the path").size(12.0));
            if copy.on_hover_text(place.display().to_string()).clicked() {
                ui.copy_text(place.display().to_string());
            }
        });
    }
    if let Some(hint) = &entry.hint {
        ui.add(egui::Label::new(RichText::new(hint).size(12.0).color(p.text)).wrap());
    }
    if let Some(detail) = &entry.detail {
        egui::CollapsingHeader::new(RichText::new("Details").size(SMALL).color(p.weak))
            .id_salt(("details", entry.number))
            .show(ui, |ui| ui.add(egui::Label::new(caption(detail.as_str(), p)).wrap()));
    }
}

/// Nothing is kept between frames.
pub(super) type Memory = ();

/// The pane.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui, (): &mut Memory, _: Pane) {
    super::theme::pane_frame(cx.p).show(ui, |ui| {
        ui.set_min_size(ui.available_size());
        if cx.state.log.entries.is_empty() {
            ui.label(caption("Nothing happened yet.", cx.p));
        }
        ScrollArea::vertical().stick_to_bottom(true).id_salt("log").show(ui, |ui| {
            for entry in &cx.state.log.entries {
                entry_ui(cx, ui, entry);
            }
        });
    });
}

/// Warnings, errors and what was saved, as far as they were not seen yet, over the lower right corner. They never block anything.
pub(super) fn notices(cx: &mut Cx<'_>, ctx: &egui::Context) {
    let unseen: Vec<Entry> =
        cx.state.log.unseen().filter(|e| e.level >= Level::Warning || e.place.is_some()).cloned().collect();
    if unseen.is_empty() {
        return;
    }
    let hidden = unseen.len().saturating_sub(MOST);
    let last = unseen.iter().map(|e| e.number).max().unwrap_or(0);
    egui::Area::new(egui::Id::unique("notices")).anchor(Align2::RIGHT_BOTTOM, vec2(-12.0, -40.0)).show(ctx, |ui| {
        egui::Frame::popup(ui.style()).fill(cx.p.panel).inner_margin(12).show(ui, |ui| {
            ui.set_width(340.0);
            for entry in unseen.iter().rev().take(MOST) {
                entry_ui(cx, ui, entry);
                ui.add_space(4.0);
            }
            ui.horizontal(|ui| {
                if ui.button("Dismiss").on_hover_text("They stay in the log").clicked() {
                    cx.push(TasksCommand::LogSeen(last));
                }
                if hidden > 0 {
                    ui.label(caption(format!("and {hidden} more in the log"), cx.p));
                }
            });
        });
    });
}
