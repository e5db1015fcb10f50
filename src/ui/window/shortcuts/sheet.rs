//! The sheet of all actions and their keys: what works here first, then the rest by group. A click on a key waits for
//! another one.

use crate::app::settings::prefer;
use eframe::egui::{self, Button, Event, Key as EKey, Layout, RichText, Ui, vec2};
use strum::IntoEnumIterator as _;

use super::key_named;
use crate::app::action::{Action, Group, Shortcut};
use crate::app::command::ViewCommand;
use crate::app::pane::Pane;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{SMALL, caption, section};

/// Least width of a column, points.
const COLUMN: f32 = 370.0;
/// Height of a row, points.
const ROW: f32 = 18.0;

/// State of the sheet.
#[derive(Debug, Default)]
pub(crate) struct Memory {
    open: bool,
    filter: String,
    /// The pane that the pointer was over last, before the sheet covered it.
    over: Option<Pane>,
    asking: Asking,
}

/// State of the choice of a key.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Asking {
    #[default]
    Nothing,
    /// For this key of an action.
    Key(Action, usize),
    /// Another action has what was pressed.
    Held(Action, usize, Shortcut, Action),
    /// Something that is no action has it.
    Used(Action, Shortcut, &'static str),
    /// It is none that actions can have.
    Unknown(Action),
}

impl Memory {
    /// True where the next key is an action's new one, and means nothing else.
    pub(crate) fn waits(&self) -> bool {
        matches!(self.asking, Asking::Key(..))
    }

    /// Remembers which pane the pointer is over.
    pub(crate) fn observe(&mut self, over: Option<Pane>) {
        if !self.open && over.is_some() {
            self.over = over;
        }
    }
}

/// The sheet, if it is open.
pub(crate) fn sheet(cx: &mut Cx<'_>, ctx: &egui::Context, memory: &mut Memory) {
    if !cx.state.selection.shortcut_sheet {
        *memory = Memory { over: memory.over, ..Memory::default() };
        return;
    }
    let first = !std::mem::replace(&mut memory.open, true);
    listen(cx, ctx, memory);
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
            edit.on_hover_text("A name, another word for it, or a key such as Ctrl+J");
            ui.with_layout(Layout::right_to_left(egui::Align::Center), |ui| {
                if ui.button("Close").on_hover_text("Esc").clicked() {
                    cx.push(ViewCommand::SetShortcutSheet(false));
                }
                let changed = Action::iter().any(|action| cx.keys().is_changed(action));
                let all = ui.add_enabled(changed, Button::new("All defaults"));
                if all.on_hover_text("Gives all actions their default keys back").clicked() {
                    cx.push(prefer(move |s| s.keys.reset(None)));
                    memory.asking = Asking::Nothing;
                }
            });
        });
        question(cx, ui, memory);
        ui.add_space(4.0);
        let height = (size.y - 180.0).max(120.0);
        let scroll = egui::ScrollArea::vertical().max_height(height).min_scrolled_height(height);
        // The sheet stays as large as it is when a filter leaves little of it.
        scroll.auto_shrink(false).show(ui, |ui| body(cx, ui, memory));
    });
    if modal.should_close() {
        cx.push(ViewCommand::SetShortcutSheet(false));
    }
}

/// Takes the key that is waited for.
fn listen(cx: &mut Cx<'_>, ctx: &egui::Context, memory: &mut Memory) {
    let Asking::Key(action, place) = memory.asking else { return };
    let mut heard = None;
    ctx.input_mut(|input| {
        input.events.retain(|event| {
            let (key, modifiers) = match event {
                Event::Key { key, pressed: true, modifiers, .. } => (*key, *modifiers),
                // The toolkit has made these of Ctrl and a letter.
                Event::Copy => (EKey::C, egui::Modifiers::CTRL),
                Event::Cut => (EKey::X, egui::Modifiers::CTRL),
                Event::Paste(_) => (EKey::V, egui::Modifiers::CTRL),
                Event::Key { .. } | Event::Text(_) => return false,
                _ => return true,
            };
            heard.get_or_insert((key, modifiers));
            false
        });
    });
    let Some((key, modifiers)) = heard else { return };
    if key == EKey::Escape && modifiers.is_none() {
        memory.asking = Asking::Nothing;
        return;
    }
    let Some(key) = key_named(key) else {
        memory.asking = Asking::Unknown(action);
        return;
    };
    let ctrl = modifiers.ctrl || modifiers.command;
    let shortcut = Shortcut { ctrl, shift: modifiers.shift, alt: modifiers.alt, key }.plainly();
    memory.asking = match (shortcut.used_by(), cx.keys().holder(shortcut)) {
        (Some(by), _) => Asking::Used(action, shortcut, by),
        (None, Some(by)) if by != action => Asking::Held(action, place, shortcut, by),
        _ => {
            cx.push(prefer(move |s| s.keys.bind(action, place, Some(shortcut))));
            Asking::Nothing
        }
    };
}

/// The line that says what is waited for, or who has what was pressed.
fn question(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory) {
    let asking = memory.asking;
    ui.allocate_ui(vec2(ui.available_width(), 24.0), |ui| {
        ui.horizontal_centered(|ui| {
            let say = |ui: &mut Ui, text: String| ui.label(RichText::new(text).color(cx.p.caution));
            match asking {
                Asking::Nothing => {
                    ui.label(caption("Click a key, then press the one that you want instead", cx.p));
                }
                Asking::Key(action, place) => {
                    let now = cx.keys().all(action).get(place).map(|key| format!(", now {key}")).unwrap_or_default();
                    ui.label(format!("Press the new key of {}{now}. Esc leaves it as it is.", action.name()));
                    if !now.is_empty() && ui.button("No key").on_hover_text("Takes this key away").clicked() {
                        cx.push(prefer(move |s| s.keys.bind(action, place, None)));
                        memory.asking = Asking::Nothing;
                    }
                }
                Asking::Held(action, place, shortcut, by) => {
                    say(ui, format!("{shortcut} is the key of {}.", by.name()));
                    let take = format!("Give it to {}", action.name());
                    let tip = format!("{} keeps no key, or its other one", by.name());
                    if ui.button(take).on_hover_text(tip).clicked() {
                        cx.push(prefer(move |s| s.keys.bind(action, place, Some(shortcut))));
                        memory.asking = Asking::Nothing;
                    }
                    if ui.button("Leave it").on_hover_text("Changes nothing").clicked() {
                        memory.asking = Asking::Nothing;
                    }
                }
                Asking::Used(action, shortcut, by) => {
                    say(ui, format!("{shortcut} belongs to {by}. {} keeps what it has.", action.name()));
                }
                Asking::Unknown(action) => {
                    say(ui, format!("No action can have this key. {} keeps what it has.", action.name()));
                }
            }
        });
    });
}

/// All actions that fit the filter, in columns of about the same length.
fn body(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory) {
    let filter = memory.filter.trim().to_lowercase();
    let fits = |action: Action| {
        let keys = cx.keys().all(action);
        filter.is_empty()
            || action.name().to_lowercase().contains(&filter)
            || action.tooltip().to_lowercase().contains(&filter)
            || action.words().any(|word| word.starts_with(&filter))
            || keys.iter().any(|key| key.to_string().to_lowercase() == filter)
    };
    let workspace = cx.state.settings.workspace;
    let over = memory.over.filter(|pane| cx.state.selection.panes.contains(pane));
    let here = |action: Action| action.is_of(workspace, over) && action.command(cx.state).is_some();
    let place = over.map_or(String::new(), |pane| format!(", {}", pane.title()));
    let mut parts = vec![(
        format!("Here: {}{place}", workspace.name()),
        Action::iter().filter(|action| here(*action) && fits(*action)).collect::<Vec<_>>(),
    )];
    for group in Group::iter() {
        let rest = group.actions().filter(|action| !here(*action) && fits(*action)).collect();
        parts.push((group.name().to_owned(), rest));
    }
    parts.retain(|(_, actions)| !actions.is_empty());
    if parts.is_empty() {
        ui.label(caption("Nothing fits", cx.p));
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
                row(cx, ui, *action, memory);
                filled += 1;
            }
            uis[column].add_space(8.0);
            filled += 1;
        }
    });
}

/// An action with its keys, each of which can be clicked.
fn row(cx: &mut Cx<'_>, ui: &mut Ui, action: Action, memory: &mut Memory) {
    let keys = cx.keys().all(action);
    let name = action.name();
    ui.spacing_mut().interact_size.y = ROW;
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(3.0, 1.0);
        ui.spacing_mut().button_padding = vec2(4.0, 0.0);
        let left = Layout::left_to_right(egui::Align::Center);
        ui.allocate_ui_with_layout(vec2(158.0, ROW), left, |ui| {
            ui.set_min_width(158.0);
            ui.add(egui::Label::new(RichText::new(name).size(12.0)).truncate()).on_hover_text(action.tooltip());
        });
        let mut button = |ui: &mut Ui, place: usize, text: &str, says: String, tip: &str| {
            let waits = memory.asking == Asking::Key(action, place);
            let text = RichText::new(if waits { "press…" } else { text }).size(SMALL).monospace();
            let button = Button::selectable(waits, text).frame_when_inactive(true).min_size(vec2(18.0, ROW));
            if ui.add(button).accessible_name(says).on_hover_text(tip).clicked() {
                memory.asking = if waits { Asking::Nothing } else { Asking::Key(action, place) };
            }
        };
        for (place, key) in keys.iter().enumerate() {
            let says = if place == 0 { format!("Key of {name}") } else { format!("Key {} of {name}", place + 1) };
            button(ui, place, &key.to_string(), says, "Click, then press another key");
        }
        let tip = "One more key for it: click, then press it";
        button(ui, keys.len(), "+", format!("Another key for {name}"), tip);
        if cx.keys().is_changed(action) {
            let back = ui.add(Button::new(RichText::new("default").size(SMALL)).min_size(vec2(0.0, ROW)));
            let defaults: Vec<String> = action.defaults().iter().map(ToString::to_string).collect();
            let tip = match defaults.as_slice() {
                [] => "It has no key by default".to_owned(),
                keys => format!("Back to {}, as far as no other action was given it", keys.join(", ")),
            };
            if back.accessible_name(format!("Default key of {name}")).on_hover_text(tip).clicked() {
                cx.push(prefer(move |s| s.keys.reset(Some(action))));
                memory.asking = Asking::Nothing;
            }
        }
    });
}
