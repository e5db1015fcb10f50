//! The bar at the top (workspaces, search, theme, help) and the one at the bottom (finger, read-out, jobs).

use crate::app::pane::Workspace;
use crate::app::settings::prefer;
use eframe::egui::{self, Align, Layout, Panel, RichText, Sense, Stroke, Ui, pos2, vec2};
use egui_tiles::Tree;
use strum::IntoEnumIterator as _;

use crate::app::action::{Action, with_keys};
use crate::app::command::{LibraryCommand, Pane, TasksCommand, ViewCommand};
use crate::app::library::Place;
use crate::app::settings::Theme;
use crate::app::tasks::{RunningTask, Ticket};
use crate::app::view::Purpose;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{SMALL, caption, medium};
use crate::ui::parts::widget::progress;

/// The bar at the top; whether it showed or hid a pane of `tree`.
pub(crate) fn top(cx: &mut Cx<'_>, ui: &mut Ui, tree: &mut Tree<Pane>) -> bool {
    let mut edited = false;
    let frame = egui::Frame::new().fill(cx.p.frame).inner_margin(egui::Margin::symmetric(12, 4));
    Panel::top("top").frame(frame).exact_size(36.0).resizable(false).show(ui, |ui| {
        ui.horizontal_centered(|ui| {
            ui.label(RichText::new("Touch2Touch").family(medium()).size(15.0).color(cx.p.strong));
            ui.add_space(8.0);
            open_menu(cx, ui);
            ui.add_space(12.0);
            for workspace in Workspace::iter() {
                tab(cx, ui, workspace);
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                ui.spacing_mut().item_spacing.x = 4.0;
                cx.action_button(ui, Action::ShortcutSheet, "?");
                edited = view_menu(cx, ui, tree);
                let width = 190.0;
                let text = RichText::new("Find anything").color(cx.p.weak);
                let button = egui::Button::new(text)
                    .right_text(caption(Action::Palette.key_text(), cx.p))
                    .min_size(vec2(width, 24.0));
                let response = ui.add(button).accessible_name("Command palette");
                if response.on_hover_text(Action::Palette.help()).clicked() {
                    cx.push(ViewCommand::SetPalette(true));
                }
            });
        });
    });
    edited
}

fn open_menu(cx: &mut Cx<'_>, ui: &mut Ui) {
    let (response, _) = egui::containers::menu::MenuButton::new("Open").ui(ui, |ui| {
        if ui.button("Demo").on_hover_text(Action::OpenDemo.tooltip()).clicked() {
            cx.push(LibraryCommand::Open(Place::Demo));
        }
        let tip = "Simulated, never trained on: 46 grasps of each of 12 tools, 3 of them new to the models";
        if ui.button("Test set").on_hover_text(tip).clicked() {
            cx.push(LibraryCommand::Open(Place::Path("test-set".into())));
        }
        let button = ui.add(egui::Button::new("Folder…").shortcut_text(Action::OpenFolder.key_text()));
        if button.on_hover_text(Action::OpenFolder.tooltip()).clicked() {
            cx.act(Action::OpenFolder);
        }
        if ui.button("Path…").on_hover_text("Type or paste a path").clicked() {
            cx.shared.dialogs.type_path(Purpose::Folder, "");
        }
        recent(cx, ui);
        ui.separator();
        for action in [
            Action::AboutData,
            Action::ExportMeasured,
            Action::ExportPredicted,
            Action::ExportMasks,
            Action::ImportMasks,
            Action::TrainMasks,
            Action::Save,
            Action::Reload,
            Action::Follow,
        ] {
            let on = action == Action::Follow && cx.state.library.follow.is_some();
            cx.menu_row(ui, action, on);
        }
    });
    response.on_hover_text("Open a data set, export and import masks, train on them");
}

/// The places that were open before.
fn recent(cx: &mut Cx<'_>, ui: &mut Ui) {
    let recent: Vec<_> = cx.state.settings.recent.iter().filter(|place| **place != Place::Demo).cloned().collect();
    if recent.is_empty() {
        return;
    }
    ui.menu_button("Recent", |ui| {
        for place in recent {
            let text = place.to_string();
            let short = text.rsplit('/').next().unwrap_or(&text).to_owned();
            if ui.button(short).on_hover_text(text).clicked() {
                cx.push(LibraryCommand::Open(place));
            }
        }
    });
}

/// Shows and hides panes of the workspace, each once; whether it did.
fn view_menu(cx: &mut Cx<'_>, ui: &mut Ui, tree: &mut Tree<Pane>) -> bool {
    let mut edited = false;
    let (response, _) = egui::containers::menu::MenuButton::new("View").ui(ui, |ui| {
        ui.set_min_width(220.0);
        ui.label(caption("Panes of this workspace", cx.p));
        for pane in Pane::of(cx.state.settings.workspace) {
            let Some(id) = tree.tiles.find_pane(&pane) else { continue };
            let mut open = tree.is_visible(id);
            ui.horizontal(|ui| {
                if ui.checkbox(&mut open, pane.title()).on_hover_text(pane.tip()).changed() {
                    tree.set_visible(id, open);
                    if open {
                        tree.make_active(|tile, _| tile == id);
                    }
                    edited = true;
                }
            });
        }
        ui.separator();
        let (settings, selection) = (&cx.state.settings, &cx.state.selection);
        let dark = settings.theme == Theme::Dark;
        for (action, on) in [
            (Action::BothFingers, selection.both_fingers),
            (Action::Footprint, settings.footprint_visible),
            (Action::MaskVisible, settings.mask_visible),
            (Action::SwitchTheme, dark),
        ] {
            cx.action_switch(ui, action, action.name(), on);
        }
        ui.separator();
        for action in [Action::ResetWorkspace, Action::Fullscreen] {
            cx.action_button(ui, action, action.name());
        }
    });
    response.on_hover_text("Show or hide panes, fingers and overlays; light or dark");
    edited
}

/// A workspace's tab.
fn tab(cx: &mut Cx<'_>, ui: &mut Ui, workspace: Workspace) {
    let on = cx.state.settings.workspace == workspace;
    let color = if on { cx.p.strong } else { cx.p.weak };
    let text = RichText::new(workspace.name()).family(medium()).color(color);
    let response = ui.add(egui::Button::new(text).frame(false).min_size(vec2(64.0, 28.0)));
    let response = response.accessible_name(workspace.name());
    if on {
        let r = response.rect;
        ui.painter().hline(r.left() + 4.0..=r.right() - 4.0, r.bottom() + 1.0, Stroke::new(2.0, cx.p.accent));
    }
    if response.on_hover_text(workspace.tooltip()).clicked() {
        cx.push(prefer(move |s| s.workspace = workspace));
    }
}

/// The bar at the bottom.
pub(crate) fn bottom(cx: &mut Cx<'_>, ui: &mut Ui) {
    let frame = egui::Frame::new().fill(cx.p.frame).inner_margin(egui::Margin::symmetric(12, 2));
    Panel::bottom("bottom").frame(frame).exact_size(28.0).resizable(false).show(ui, |ui| {
        ui.horizontal_centered(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            fingers(cx, ui);
            ui.add_space(12.0);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                following(cx, ui);
                jobs(cx, ui);
                ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                    let (text, color) = match &cx.shared.readout {
                        Some(text) => (text.clone(), cx.p.text),
                        None => (cx.state.pair_name().to_owned(), cx.p.weak),
                    };
                    let label = egui::Label::new(RichText::new(text).size(12.0).color(color)).truncate();
                    ui.add(label);
                });
            });
        });
    });
}

fn fingers(cx: &mut Cx<'_>, ui: &mut Ui) {
    let fingers = cx.state.fingers_with_data();
    if fingers == [cx.state.selection.finger] {
        return;
    }
    for finger in fingers {
        let on = cx.state.selection.finger == finger;
        let name = cx.state.rig().pad_name(finger).to_owned();
        let button = ui.add(egui::Button::selectable(on, RichText::new(&name).size(12.0)).min_size(vec2(44.0, 20.0)));
        let button = button.accessible_name(format!("{name} finger"));
        let tip = format!("Show the {} finger ([[other_finger]] switches)", cx.state.finger_name(finger));
        if button.on_hover_text(with_keys(&tip)).clicked() {
            cx.push(ViewCommand::SelectFinger(finger));
        }
    }
    let both = cx.state.selection.both_fingers;
    let button = ui.add(egui::Button::selectable(both, RichText::new("Both").size(12.0)).min_size(vec2(44.0, 20.0)));
    let button = button.accessible_name("Both fingers");
    if button.on_hover_text(Action::BothFingers.help()).clicked() {
        cx.push(ViewCommand::ShowBothFingers(!both));
    }
}

/// The running jobs, the first with its progress and a way to stop it, the rest in a menu: the one place for these.
fn jobs(cx: &mut Cx<'_>, ui: &mut Ui) {
    let tasks = &cx.state.tasks;
    let mut running = tasks.running.iter();
    if let Some((ticket, task)) = running.next() {
        job(cx, ui, *ticket, task);
        let more: Vec<_> = running.collect();
        if !more.is_empty() {
            let name = format!("and {} more", more.len());
            let (response, _) = egui::containers::menu::MenuButton::new(name).ui(ui, |ui| {
                for (ticket, task) in more {
                    ui.horizontal(|ui| job(cx, ui, *ticket, task));
                }
            });
            response.on_hover_text("The other running jobs");
        }
    } else if !tasks.demanded.is_empty() {
        // A dot, not a spinner: a spinner would draw frames as long as it turns.
        let (rect, response) = ui.allocate_exact_size(vec2(8.0, 8.0), Sense::hover());
        ui.painter().circle_filled(pos2(rect.center().x, rect.center().y), 3.5, cx.p.accent);
        response.on_hover_text("Computing what the panes show");
        ui.label(caption("computing", cx.p));
    }
}

/// A running job, with its progress and a way to stop it.
fn job(cx: &mut Cx<'_>, ui: &mut Ui, ticket: Ticket, task: &RunningTask) {
    let cancel = ui.add_enabled(!task.cancelling, egui::Button::new(RichText::new("Cancel").size(SMALL)));
    let cancel = cancel.accessible_name(format!("Cancel: {}", task.title));
    if cancel.on_hover_text(Action::CancelJobs.behind(task.kind.kept())).clicked() {
        cx.push(TasksCommand::Cancel(ticket));
    }
    let text = if task.cancelling { "stopping…" } else { &task.progress.text };
    progress::bar(ui, 220.0, task.progress.fraction(), text);
    ui.label(RichText::new(&task.title).size(12.0).color(cx.p.text));
}

/// That the folder is followed, what arrived, and a way to stop it.
fn following(cx: &mut Cx<'_>, ui: &mut Ui) {
    let Some(follow) = &cx.state.library.follow else { return };
    let mut text = format!("Following: {} arrived", follow.arrived);
    if follow.broken > 0 {
        text += &format!(", {} unreadable", follow.broken);
    }
    let newest = follow.newest.as_ref().map_or(String::new(), |name| format!("Newest: {name}. "));
    let text = RichText::new(text).size(12.0).color(cx.p.accent);
    let button = ui.add(egui::Button::new(text).min_size(vec2(0.0, 20.0))).accessible_name("Stop following");
    if button.on_hover_text(Action::Follow.behind(&format!("{newest}Stops following the folder"))).clicked() {
        cx.act(Action::Follow);
    }
    ui.add_space(8.0);
}

/// Advice on the first start; gone for good when dismissed.
pub(crate) fn hint(cx: &mut Cx<'_>, ctx: &egui::Context) {
    let demo = cx.state.library.open.as_ref().is_some_and(|open| open.place == Place::Demo);
    if cx.state.settings.hint_dismissed || !demo {
        return;
    }
    // Whoever has gone on to another pair needs it no longer.
    if cx.state.selection.pair.is_some_and(|pair| cx.state.library.order.first() != Some(&pair)) {
        return cx.push(prefer(|s| s.hint_dismissed = true));
    }
    let area = egui::Area::new(egui::Id::unique("hint")).anchor(egui::Align2::CENTER_BOTTOM, vec2(0.0, -44.0));
    area.show(ctx, |ui| {
        egui::Frame::popup(ui.style()).fill(cx.p.panel).inner_margin(12).show(ui, |ui| {
            ui.set_max_width(520.0);
            ui.horizontal(|ui| {
                ui.vertical(|ui| {
                    let first = "Simulated data: the predicted imprint next to the measured one.";
                    ui.label(RichText::new(first).color(cx.p.strong));
                    let steps = "[[next_pair]] and [[previous_pair]] step through the pairs, [[generate]] predicts the one \
                                 on screen, [[palette]] finds everything else. Drop a folder here to open your own data.";
                    ui.label(with_keys(steps));
                });
                ui.add_space(8.0);
                if ui.button("Got it").on_hover_text("Do not show this again").clicked() {
                    cx.push(prefer(|s| s.hint_dismissed = true));
                }
            });
        });
    });
}

/// Overlay that says what a folder dragged over the window would do.
pub(crate) fn drop_overlay(cx: &Cx<'_>, ctx: &egui::Context) {
    if ctx.input(|i| i.raw.hovered_files.is_empty()) {
        return;
    }
    let painter = ctx.layer_painter(egui::LayerId::new(egui::Order::Foreground, egui::Id::unique("drop")));
    let rect = ctx.content_rect();
    painter.rect_filled(rect, 0.0, cx.p.canvas.gamma_multiply(0.85));
    painter.rect_stroke(rect.shrink(24.0), 12.0, Stroke::new(2.0, cx.p.accent), egui::StrokeKind::Inside);
    let font = egui::FontId::new(20.0, medium());
    painter.text(rect.center(), egui::Align2::CENTER_CENTER, "Drop to open this folder", font, cx.p.strong);
}
