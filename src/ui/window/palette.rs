//! The command palette: finds actions, panes, samples and tools.

use eframe::egui::text::{LayoutJob, TextWrapping};
use eframe::egui::{self, Align2, FontId, Key, Role, ScrollArea, Sense, Ui, WidgetInfo, pos2, vec2};
use strum::IntoEnumIterator as _;

use super::fuzzy::score;
use crate::app::action::Action;
use crate::app::command::{LibraryCommand, Pane, UiRequest, ViewCommand};
use crate::app::pane::Workspace;
use crate::app::settings::prefer;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::SMALL;
use touch2touch_core::dataset::PairId;

/// Entries shown at most: nobody reads further, and a list of 32,000 pairs stays quick.
const MOST: usize = 60;
/// Score of another word for an action: less than its name in one piece, more than scattered letters.
const OTHER_WORD: i32 = 45;
/// Height of an entry, points.
const ROW: f32 = 28.0;

/// Something that can be chosen.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Entry {
    Action(Action),
    Workspace(Workspace),
    Pane(Pane),
    Pair(PairId, String),
    Tool(String),
}

/// Query being typed, with its entries.
#[derive(Debug, Default)]
pub(crate) struct Memory {
    query: String,
    selected: usize,
    /// The entries for a query, made again when it changes.
    found: Option<(String, Vec<Entry>)>,
    open: bool,
}

/// The palette, if it is open.
pub(crate) fn show(cx: &mut Cx<'_>, ctx: &egui::Context, memory: &mut Memory) {
    if !cx.state.selection.palette {
        memory.open = false;
        return;
    }
    if !std::mem::replace(&mut memory.open, true) {
        *memory = Memory { open: true, ..Memory::default() };
    }
    let area = egui::Modal::default_area(egui::Id::unique("palette")).anchor(Align2::CENTER_TOP, vec2(0.0, 72.0));
    let mut chosen = None;
    let modal = egui::Modal::new(egui::Id::unique("palette")).area(area).show(ctx, |ui| {
        ui.set_width(520.0);
        let (down, up, enter) = ui.input_mut(|i| {
            (
                i.count_and_consume_key(egui::Modifiers::NONE, Key::ArrowDown),
                i.count_and_consume_key(egui::Modifiers::NONE, Key::ArrowUp),
                i.consume_key(egui::Modifiers::NONE, Key::Enter),
            )
        });
        let edit = egui::TextEdit::singleline(&mut memory.query)
            .hint_text("Find an action, a pane, a pair or a tool")
            .font(FontId::proportional(15.0))
            .desired_width(520.0);
        let response = ui.add(edit).accessible_name("Find anything");
        response.request_focus();
        if response.changed() {
            memory.selected = 0;
        }
        // After the text: Enter that comes with the last letter means what that letter found.
        search(cx, memory);
        let count = memory.found.as_ref().map_or(0, |f| f.1.len());
        let selected = (memory.selected + down).saturating_sub(up).min(count.saturating_sub(1));
        let moved = selected != memory.selected;
        memory.selected = selected;
        ui.add_space(4.0);
        let entries = memory.found.as_ref().map(|f| f.1.clone()).unwrap_or_default();
        ScrollArea::vertical().max_height(ROW * 12.0).show(ui, |ui| {
            ui.spacing_mut().item_spacing.y = 0.0;
            for (i, entry) in entries.iter().enumerate() {
                let response = entry_ui(cx, ui, entry, i == selected);
                if i == selected && moved {
                    response.scroll_to_me(None);
                }
                if response.clicked() || (enter && i == selected) {
                    chosen = Some(entry.clone());
                }
            }
            if entries.is_empty() {
                ui.label(crate::ui::parts::theme::caption("No match", cx.p));
            }
        });
    });
    if let Some(entry) = chosen {
        cx.push(ViewCommand::SetPalette(false));
        match entry {
            Entry::Action(action) if action != Action::Palette => cx.act(action),
            Entry::Action(_) => {}
            Entry::Workspace(workspace) => cx.push(prefer(move |s| s.workspace = workspace)),
            Entry::Pane(pane) => cx.push(ViewCommand::Ui(UiRequest::ShowPane(pane))),
            Entry::Pair(pair, _) => cx.push(LibraryCommand::Select(pair)),
            Entry::Tool(tool) => cx.push(LibraryCommand::SetToolFilter(Some(tool))),
        }
    } else if modal.should_close() {
        cx.push(ViewCommand::SetPalette(false));
    }
}

/// Fills the list for the query, if it is another one.
fn search(cx: &Cx<'_>, memory: &mut Memory) {
    let query = memory.query.clone();
    if memory.found.as_ref().is_some_and(|(q, _)| *q == query) {
        return;
    }
    let mut ranked: Vec<(i32, Entry)> = Vec::new();
    for action in Action::iter() {
        let name = score(&query, action.name());
        let help = score(&query, action.tooltip()).map(|s| s - 30).filter(|_| query.len() >= 3);
        let word = query.trim().to_lowercase();
        let other = action.words().filter(|w| word.len() >= 2 && w.starts_with(&word)).map(|_| OTHER_WORD).next();
        if let Some(s) = name.max(help).max(other) {
            // Actions before samples: there are few of them.
            ranked.push((s + 4, Entry::Action(action)));
        }
    }
    if !query.trim().is_empty() {
        ranked.extend(Workspace::iter().filter_map(|w| Some((score(&query, w.name())? + 8, Entry::Workspace(w)))));
        ranked.extend(Pane::iter().filter_map(|pane| Some((score(&query, pane.title())? + 6, Entry::Pane(pane)))));
        if let Some(open) = &cx.state.library.open {
            ranked.extend(open.tools.iter().filter_map(|t| Some((score(&query, t)?, Entry::Tool(t.clone())))));
        }
        let pairs = (0u32..).zip(cx.state.library.pairs());
        ranked.extend(
            pairs.filter_map(|(i, e)| Some((score(&query, &e.name)? - 2, Entry::Pair(PairId(i), e.name.clone())))),
        );
        ranked.sort_by_key(|(s, _)| std::cmp::Reverse(*s));
    }
    ranked.truncate(MOST);
    memory.found = Some((query, ranked.into_iter().map(|(_, e)| e).collect()));
}

fn entry_ui(cx: &Cx<'_>, ui: &mut Ui, entry: &Entry, selected: bool) -> egui::Response {
    let p = cx.p;
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    let (name, kind, tip) = match entry {
        Entry::Action(action) => (action.name(), action.key_text(), action.tooltip()),
        Entry::Workspace(workspace) => (workspace.name(), "workspace".to_owned(), workspace.tooltip()),
        Entry::Pane(pane) => (pane.title(), "pane".to_owned(), pane.tip()),
        Entry::Pair(_, name) => (name.as_str(), "pair".to_owned(), ""),
        Entry::Tool(tool) => (tool.as_str(), "tool".to_owned(), ""),
    };
    let enabled = !matches!(entry, Entry::Action(action) if action.command(cx.state).is_none());
    response.widget_info(|| WidgetInfo::labeled(Role::Button, enabled, name));
    if ui.is_rect_visible(rect) {
        ui.painter().rect_filled(rect, 4.0, p.row(selected, response.hovered()));
        let color = if enabled { p.strong } else { p.weak };
        let y = rect.center().y;
        let place =
            ui.painter().text(pos2(rect.left() + 8.0, y), Align2::LEFT_CENTER, name, FontId::proportional(13.0), color);
        let small = FontId::proportional(SMALL);
        let right = ui.painter().text(pos2(rect.right() - 8.0, y), Align2::RIGHT_CENTER, kind, small.clone(), p.weak);
        if !tip.is_empty() {
            let left = place.right() + 12.0;
            let mut job = LayoutJob::simple_singleline(tip.to_owned(), small, p.weak);
            job.wrap = TextWrapping::truncate_at_width((right.left() - 12.0 - left).max(0.0));
            let galley = ui.painter().layout_job(job);
            ui.painter().galley(pos2(left, y - 0.5 * galley.size().y), galley, p.weak);
        }
    }
    response
}
