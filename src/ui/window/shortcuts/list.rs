//! The list of all actions and their keys: what works here first, then the rest by group.

use eframe::egui::{self, Layout, RichText, Ui, vec2};
use strum::IntoEnumIterator as _;

use crate::app::action::{Action, Group};
use crate::app::command::ViewCommand;
use crate::app::pane::Pane;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{SMALL, caption, section};

/// Least width of a column, points.
const COLUMN: f32 = 370.0;
/// Height of a row, points.
const ROW: f32 = 18.0;

/// State of the list.
#[derive(Debug, Default)]
pub(crate) struct Memory {
    open: bool,
    filter: String,
    /// The pane that the pointer was over last, before the list covered it.
    over: Option<Pane>,
}

impl Memory {
    /// Remembers which pane the pointer is over.
    pub(crate) fn observe(&mut self, over: Option<Pane>) {
        if !self.open && over.is_some() {
            self.over = over;
        }
    }
}

/// The list, if it is open.
pub(crate) fn list(cx: &mut Cx<'_>, ctx: &egui::Context, memory: &mut Memory) {
    if !cx.state.selection.shortcut_sheet {
        *memory = Memory { over: memory.over, ..Memory::default() };
        return;
    }
    let first = !std::mem::replace(&mut memory.open, true);
    let size = ctx.content_rect().size();
    let modal = egui::Modal::new(egui::Id::unique("shortcut sheet")).show(ctx, |ui| {
        ui.set_width((size.x - 64.0).min(1200.0));
        ui.horizontal(|ui| {
            ui.label(RichText::new("Shortcuts").heading());
            ui.add_space(12.0);
            let edit = egui::TextEdit::singleline(&mut memory.filter).hint_text("Filter").desired_width(220.0);
            let edit = ui.add(edit).accessible_name("Filter shortcuts");
            if first {
                edit.request_focus();
            }
            edit.on_hover_text("A name or a key such as Ctrl+J");
            ui.with_layout(Layout::right_to_left(egui::Align::Center), |ui| {
                if ui.button("Close").on_hover_text("Esc").clicked() {
                    cx.push(ViewCommand::SetShortcutSheet(false));
                }
            });
        });
        ui.add_space(4.0);
        let height = (size.y - 180.0).max(120.0);
        let scroll = egui::ScrollArea::vertical().max_height(height).min_scrolled_height(height);
        // The list stays as large as it is when a filter leaves little of it.
        scroll.auto_shrink(false).show(ui, |ui| body(cx, ui, memory));
    });
    if modal.should_close() {
        cx.push(ViewCommand::SetShortcutSheet(false));
    }
}

/// All actions that fit the filter, in columns of about the same length.
fn body(cx: &Cx<'_>, ui: &mut Ui, memory: &Memory) {
    let filter = memory.filter.trim().to_lowercase();
    let fits = |action: Action| {
        let keys = action.keys();
        filter.is_empty()
            || action.name().to_lowercase().contains(&filter)
            || action.tooltip().to_lowercase().contains(&filter)
            || action.words().any(|word| word.starts_with(&filter))
            || keys.iter().any(|key| key.to_string().to_lowercase() == filter)
    };
    let workspace = cx.state.settings.workspace;
    let over = memory.over.filter(|pane| cx.state.selection.panes.contains(pane));
    let fits_place = |action: Action| action.is_of(workspace, over) && action.command(cx.state).is_some();
    let place = over.map_or(String::new(), |pane| format!(", {}", pane.title()));
    let mut parts = vec![(
        format!("Here: {}{place}", workspace.name()),
        Action::iter().filter(|action| fits_place(*action) && fits(*action)).collect::<Vec<_>>(),
    )];
    for group in Group::iter() {
        let rest = group.actions().filter(|action| !fits_place(*action) && fits(*action)).collect();
        parts.push((group.name().to_owned(), rest));
    }
    parts.retain(|(_, actions)| !actions.is_empty());
    if parts.is_empty() {
        ui.label(caption("No match", cx.p));
        return;
    }
    let columns = ((ui.available_width() / COLUMN) as usize).clamp(1, 3);
    let total: usize = parts.iter().map(|(_, actions)| actions.len() + 2).sum();
    let each = total.div_ceil(columns);
    ui.columns(columns, |uis| {
        let mut filled = 0;
        for (title, actions) in &parts {
            let mut column = usize::MAX;
            for action in actions {
                let next = (filled / each).min(columns - 1);
                let ui = &mut uis[next];
                if next != column {
                    // A part that goes on in the next column says again what it is.
                    ui.label(section(title, cx.p));
                    column = next;
                    filled += 1;
                }
                row(cx, ui, *action);
                filled += 1;
            }
            uis[column].add_space(8.0);
            filled += 1;
        }
    });
}

/// An action with its keys.
fn row(cx: &Cx<'_>, ui: &mut Ui, action: Action) {
    let name = action.name();
    ui.spacing_mut().interact_size.y = ROW;
    ui.horizontal(|ui| {
        let left = Layout::left_to_right(egui::Align::Center);
        ui.allocate_ui_with_layout(vec2(158.0, ROW), left, |ui| {
            ui.set_min_width(158.0);
            ui.add(egui::Label::new(RichText::new(name).size(12.0)).truncate()).on_hover_text(action.tooltip());
        });
        let keys: Vec<String> = action.keys().iter().map(ToString::to_string).collect();
        if !keys.is_empty() {
            let text = RichText::new(keys.join("  ")).size(SMALL).monospace().color(cx.p.weak);
            ui.label(text);
        }
    });
}
