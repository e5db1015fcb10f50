//! Log: the pane with all notes, and the notices that appear once.

use std::path::Path;
use std::time::Duration;

use eframe::egui::{self, Align, Color32, Layout, RichText, ScrollArea, Ui, vec2};

use crate::app::action::Action;
use crate::app::command::{Pane, TasksCommand};
use crate::app::tasks::{Entry, Level};
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{Palette, SMALL, caption};

/// Notices on screen at once.
const MOST: usize = 3;
/// Time that a note stays that is no error, seconds.
const STAYS_S: f64 = 12.0;

fn color(p: &Palette, level: Level) -> Color32 {
    match level {
        Level::Info => p.text,
        Level::Warning => p.caution,
        Level::Error => p.wrong,
    }
}

/// Link to a file that was written.
fn link(cx: &mut Cx<'_>, ui: &mut Ui, place: &Path) {
    let show = ui.link(RichText::new("Open folder").size(12.0));
    if show.on_hover_text(place.display().to_string()).clicked() {
        cx.push(TasksCommand::Reveal(place.to_owned()));
    }
}

fn entry_ui(cx: &mut Cx<'_>, ui: &mut Ui, entry: &Entry) {
    let p = cx.p;
    let count = if entry.count > 1 { format!(" ({} times)", entry.count) } else { String::new() };
    ui.add(egui::Label::new(RichText::new(format!("{}{count}", entry.text)).color(color(p, entry.level))).wrap());
    if let Some(place) = &entry.place {
        ui.horizontal(|ui| link(cx, ui, place));
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
pub(crate) type Memory = ();

/// The pane.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, (): &mut Memory, _: Pane) {
    if cx.state.log.entries.is_empty() {
        ui.label(caption("Nothing happened yet.", cx.p));
    }
    ScrollArea::vertical().stick_to_bottom(true).id_salt("log").show(ui, |ui| {
        for entry in &cx.state.log.entries {
            entry_ui(cx, ui, entry);
        }
    });
}

/// Warnings, errors and what was saved, as far as they were not seen yet: lines above the status bar, over the
/// panes, of which none is moved.
/// All but errors go by themselves, after a while or with their pair.
pub(crate) fn notices(cx: &mut Cx<'_>, ctx: &egui::Context) {
    let (state, now) = (cx.state, ctx.input(|i| i.time));
    let came = &mut cx.shared.notes;
    let mut unseen = Vec::new();
    for entry in state.log.unseen().filter(|e| e.level >= Level::Warning || e.place.is_some() || e.changed.is_some()) {
        let (since, pair) = *came.entry(entry.number).or_insert((now, state.selection.pair));
        let stays = entry.level == Level::Error;
        if stays || (now - since < STAYS_S && (pair.is_none() || pair == state.selection.pair)) {
            unseen.push(entry);
        }
        if !stays && now - since < STAYS_S {
            ctx.request_repaint_after(Duration::from_secs_f64(STAYS_S - (now - since)));
        }
    }
    let Some(last) = unseen.iter().map(|e| e.number).max() else { return };
    let hidden = unseen.len().saturating_sub(MOST);
    let area = egui::Area::new(egui::Id::unique("notices")).anchor(egui::Align2::RIGHT_BOTTOM, vec2(-8.0, -32.0));
    let width = (ctx.content_rect().width() - 32.0).min(640.0);
    let (p, content) = (cx.p, |ui: &mut Ui| {
        ui.set_width(width);
        for (index, entry) in unseen.iter().rev().take(MOST).enumerate() {
            ui.horizontal(|ui| {
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                    if index == 0 && ui.button("Dismiss").on_hover_text("They stay in the log").clicked() {
                        cx.push(TasksCommand::LogSeen(last));
                    }
                    if index == 0 && hidden > 0 {
                        ui.label(caption(format!("and {hidden} more in the log"), cx.p));
                    }
                    if let Some(place) = &entry.place {
                        link(cx, ui, place);
                    }
                    // Only the last change can be taken back first.
                    let last_change = unseen.iter().rev().find(|e| e.changed.is_some()).map(|e| e.number);
                    let here = entry.changed.as_deref() == Some(cx.state.pair_name());
                    let undo = Action::Undo.command(cx.state).filter(|_| here && last_change == Some(entry.number));
                    if undo.is_some() && ui.button("Undo").on_hover_text("Takes this change back").clicked() {
                        cx.act(Action::Undo);
                        cx.push(TasksCommand::LogSeen(entry.number));
                    }
                    ui.with_layout(Layout::left_to_right(Align::Center), |ui| line(cx.p, ui, entry));
                });
            });
        }
    });
    area.show(ctx, |ui| {
        egui::Frame::popup(ui.style()).fill(p.panel).inner_margin(egui::Margin::symmetric(12, 3)).show(ui, content);
    });
}

/// A note in one line: the reason first, then what it is about, then what to do.
fn line(p: &Palette, ui: &mut Ui, entry: &Entry) {
    let reason = entry.detail.as_deref().and_then(|why| why.lines().next()).filter(|_| entry.level == Level::Error);
    let count = if entry.count > 1 { format!(" ({} times)", entry.count) } else { String::new() };
    let first = format!("{}{count}", reason.unwrap_or(&entry.text));
    let about = reason.map(|_| entry.text.as_str());
    let rest: Vec<&str> = about.into_iter().chain(entry.hint.as_deref()).collect();
    let mut text = egui::text::LayoutJob::default();
    let font = egui::FontId::proportional(12.0);
    text.append(&first, 0.0, egui::TextFormat::simple(font.clone(), color(p, entry.level)));
    if !rest.is_empty() {
        text.append(&rest.join(" · "), 10.0, egui::TextFormat::simple(font, p.text));
    }
    let all = [Some(first.as_str()), about, entry.hint.as_deref(), entry.detail.as_deref()];
    let all: Vec<&str> = all.into_iter().flatten().collect();
    ui.add(egui::Label::new(text).truncate()).on_hover_text(all.join("\n"));
}
