//! Keys to actions, and the sheet that lists them: both from the one table of actions.

use eframe::egui::{self, Key as EKey, RichText, Ui};
use strum::IntoEnumIterator as _;

use super::cx::Cx;
use super::theme::{Palette, SMALL, section};
use crate::app::action::{Action, Group, Key, Shortcut};
use crate::app::command::ViewCommand;
use crate::app::pane::{Kind, Pane};

/// The toolkit's name of a key.
fn key_of(key: Key) -> EKey {
    match key {
        Key::Escape => EKey::Escape,
        Key::Equals => EKey::Equals,
        // The names are the same, but for these: the toolkit parses them.
        other => EKey::from_name(&other.text()).or_else(|| EKey::from_name(&format!("{other:?}"))).unwrap_or(EKey::F35),
    }
}

/// Whether the key is typed with Shift on most keyboards, so that Shift says nothing about the shortcut.
fn is_shifted_symbol(key: Key) -> bool {
    matches!(key, Key::Questionmark | Key::Exclamationmark)
}

/// The actions whose shortcut was pressed in this frame. Keys without Ctrl are a text's while text is being typed.
///
/// The key of an action that is not `possible` now is left to what else wants it (Enter to a focused button).
/// While something covers the panes (`covered`) they are its own: Escape closes it and nothing else.
pub(super) fn pressed(ctx: &egui::Context, covered: bool, possible: impl Fn(Action) -> bool) -> Vec<Action> {
    let typing = covered || ctx.egui_wants_keyboard_input() || egui::Popup::is_any_open(ctx);
    let mut actions = Vec::new();
    ctx.input_mut(|input| {
        // The most specific first: Ctrl + Shift + Z is not Ctrl + Z.
        let mut all: Vec<(Action, Shortcut)> =
            Action::iter().filter(|a| possible(*a)).flat_map(|a| a.shortcuts().iter().map(move |s| (a, *s))).collect();
        all.sort_by_key(|(_, s)| std::cmp::Reverse(u8::from(s.ctrl) + u8::from(s.shift) + u8::from(s.alt)));
        for (action, s) in all {
            if typing && !s.ctrl && !matches!(s.key, Key::F1 | Key::F5 | Key::F11 | Key::F12) {
                continue;
            }
            // A text box has its own undo, copy and word keys.
            if typing && matches!(s.key, Key::Z | Key::Y | Key::C | Key::Backspace | Key::Enter) {
                continue;
            }
            let mut hit = false;
            input.events.retain(|event| {
                let egui::Event::Key { key, pressed: true, modifiers, .. } = event else { return true };
                let same_key = *key == key_of(s.key)
                    || (s.key == Key::Questionmark && *key == EKey::Slash && modifiers.shift)
                    || (s.key == Key::Exclamationmark && *key == EKey::Num1 && modifiers.shift);
                let shift_fits = is_shifted_symbol(s.key) || modifiers.shift == s.shift;
                let ctrl_fits = (modifiers.ctrl || modifiers.command) == s.ctrl;
                let fits = same_key && shift_fits && ctrl_fits && modifiers.alt == s.alt && possible(action);
                hit |= fits;
                !fits
            });
            // Copy and the like arrive as events of their own.
            if s == (Shortcut { ctrl: true, shift: false, alt: false, key: Key::C }) && !typing {
                let before = input.events.len();
                input.events.retain(|e| !matches!(e, egui::Event::Copy));
                hit |= before != input.events.len();
            }
            if hit {
                actions.push(action);
            }
        }
    });
    actions
}

/// Whether an action's keys mean it while the pointer is over a pane. Space presses what has the focus elsewhere.
pub(super) fn fits_pane(action: Action, over: Option<Pane>) -> bool {
    action != Action::PlaySteps || over.is_some_and(|pane| matches!(pane.kind(), Kind::Steps | Kind::Scene(_)))
}

/// The window with all actions and their keys.
pub(super) fn sheet(cx: &mut Cx<'_>, ctx: &egui::Context) {
    if !cx.state.selection.shortcut_sheet {
        return;
    }
    let size = ctx.content_rect().size();
    let modal = egui::Modal::new(egui::Id::unique("shortcut sheet")).show(ctx, |ui| {
        let columns = if size.x >= 1100.0 { 3 } else { 2 };
        ui.set_width((size.x - 80.0).min(1060.0));
        ui.horizontal(|ui| {
            ui.label(RichText::new("Shortcuts").heading());
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if ui.button("Close").on_hover_text("Esc").clicked() {
                    cx.push(ViewCommand::SetShortcutSheet(false));
                }
            });
        });
        ui.add_space(4.0);
        egui::ScrollArea::vertical().max_height(size.y - 160.0).min_scrolled_height(size.y - 160.0).show(ui, |ui| {
            // Filled column by column, about equally long.
            let groups: Vec<Group> = Group::iter().collect();
            let rows = |g: &Group| g.actions().count() + 2;
            let total: usize = groups.iter().map(rows).sum();
            let mut parts: Vec<Vec<Group>> = vec![Vec::new(); columns];
            let mut filled = 0;
            for group in groups {
                let column = ((filled + rows(&group) / 2) * columns / total.max(1)).min(columns - 1);
                filled += rows(&group);
                parts[column].push(group);
            }
            ui.columns(columns, |uis| {
                for (ui, groups) in uis.iter_mut().zip(parts) {
                    for group in groups {
                        group_ui(cx.p, ui, group);
                    }
                }
            });
        });
    });
    if modal.should_close() {
        cx.push(ViewCommand::SetShortcutSheet(false));
    }
}

fn group_ui(p: &Palette, ui: &mut Ui, group: Group) {
    ui.label(section(group.name(), p));
    egui::Grid::new(("shortcuts", group)).num_columns(2).spacing([12.0, 1.0]).min_row_height(16.0).show(ui, |ui| {
        for action in group.actions() {
            let keys: Vec<String> = action.shortcuts().iter().map(ToString::to_string).collect();
            ui.label(RichText::new(action.name()).size(12.0)).on_hover_text(action.tooltip());
            ui.label(RichText::new(keys.join("  ")).size(SMALL).monospace().color(p.weak));
            ui.end_row();
        }
    });
    ui.add_space(8.0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::Modifiers;

    #[test]
    fn every_key_of_the_table_is_known_to_the_toolkit() {
        for action in Action::iter() {
            for s in action.shortcuts() {
                assert_ne!(key_of(s.key), EKey::F35, "{action:?} {s}");
            }
        }
    }

    /// What the toolkit calls the modifiers of a shortcut.
    fn modifiers(s: crate::app::action::Shortcut) -> Modifiers {
        Modifiers { alt: s.alt, ctrl: s.ctrl, shift: s.shift, mac_cmd: false, command: s.ctrl }
    }

    fn press(key: EKey, modifiers: Modifiers) -> Vec<Action> {
        let ctx = egui::Context::default();
        let mut raw = egui::RawInput::default();
        raw.events.push(egui::Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers });
        let mut got = Vec::new();
        let mut output = ctx.run_ui(raw, |ui| got.extend(pressed(ui.ctx(), false, |_| true)));
        // No picture is made, so nobody uploads its textures.
        output.textures_delta.clear();
        got
    }

    #[test]
    fn a_key_triggers_its_action_and_no_other() {
        for action in Action::iter() {
            for s in action.shortcuts() {
                let mut m = modifiers(*s);
                m.shift |= is_shifted_symbol(s.key);
                assert_eq!(press(key_of(s.key), m), vec![action], "{s}");
            }
        }
        assert_eq!(press(EKey::Slash, Modifiers::SHIFT), vec![Action::ShortcutSheet]);
    }
}
