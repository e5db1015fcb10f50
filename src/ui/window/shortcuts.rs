//! Keys to actions, and the list of them: both from the one table of actions.

mod list;

use eframe::egui::{self, Key};
use strum::IntoEnumIterator as _;

pub(crate) use self::list::{Memory, list};
use crate::app::action::{Action, Shortcut};
use crate::app::pane::{Kind, Pane};
use touch2touch_core::manual::PoseAxis;

/// The toolkit's key; `None` where it has none of that name.
fn key_of(s: Shortcut) -> Option<Key> {
    Key::from_name(match s.key {
        "PgUp" => "PageUp",
        "PgDn" => "PageDown",
        own => own,
    })
}

/// The place at which keys arrive.
#[derive(Clone, Copy, Default)]
pub(crate) struct Place {
    /// True where something covers the panes: keys are its own, Escape closes it and nothing else.
    pub covered: bool,
    /// True where a form or a dialog is open beside the panes: of the keys without Ctrl, Escape alone is an action's.
    pub dialog: bool,
    /// True where masks are drawn: only there single letters change labels.
    pub labeling: bool,
}

impl Place {
    /// True where keys are a text's, a menu's, or those of what covers the panes.
    fn is_typing(self, ctx: &egui::Context) -> bool {
        self.covered || ctx.egui_wants_keyboard_input() || egui::Popup::is_any_open(ctx)
    }
}

/// The actions whose shortcut was pressed in this frame. Keys without Ctrl are a text's while text is being typed.
///
/// The key of an action that is not `possible` now is left to what else wants it (Enter to a focused button).
pub(crate) fn pressed(ctx: &egui::Context, place: Place, possible: impl Fn(Action) -> bool) -> Vec<Action> {
    let pressed = |e: &egui::Event| matches!(e, egui::Event::Key { pressed: true, .. } | egui::Event::Copy);
    if !ctx.input(|input| input.events.iter().any(pressed)) {
        return Vec::new();
    }
    let typing = place.is_typing(ctx);
    let mut actions = Vec::new();
    ctx.input_mut(|input| {
        // The most specific first: Ctrl + Shift + Z is not Ctrl + Z.
        let mut all: Vec<(Action, Shortcut)> =
            Action::iter().filter(|a| possible(*a)).flat_map(|a| a.keys().iter().map(move |s| (a, *s))).collect();
        all.sort_by_key(|(_, s)| std::cmp::Reverse(u8::from(s.ctrl) + u8::from(s.shift) + u8::from(s.alt)));
        for (action, s) in all {
            let bare = !s.ctrl && !s.is_function();
            if (typing && (bare || s.is_for_text()))
                || (place.dialog && bare && s.key != "Esc")
                || (!place.labeling && !s.ctrl && !s.alt && action.is_of_labeling())
            {
                continue;
            }
            let mut hit = false;
            input.events.retain(|event| {
                let egui::Event::Key { key, pressed: true, modifiers, .. } = event else { return true };
                let same_key = Some(*key) == key_of(s)
                    || (s.key == "?" && *key == Key::Slash && modifiers.shift)
                    || (s.key == "!" && *key == Key::Num1 && modifiers.shift);
                let shift_fits = s.is_shifted() || modifiers.shift == s.shift;
                let ctrl_fits = (modifiers.ctrl || modifiers.command) == s.ctrl;
                let fits = same_key && shift_fits && ctrl_fits && modifiers.alt == s.alt && possible(action);
                hit |= fits;
                !fits
            });
            // Copy and the like arrive as events of their own.
            if s == (Shortcut { ctrl: true, shift: false, alt: false, key: "C" }) && !typing {
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

/// Moves of the tool in hand that arrow keys ask for: axis and steps. Alt turns; Shift takes ten steps, Ctrl a tenth of one, and
/// Ctrl + Shift turns by it: many desktops keep Ctrl + Alt for themselves.
pub(crate) fn nudges(ctx: &egui::Context, place: Place) -> Vec<(PoseAxis, f64)> {
    if place.dialog || place.is_typing(ctx) {
        return Vec::new();
    }
    let mut asked = Vec::new();
    ctx.input_mut(|input| {
        input.events.retain(|event| {
            let egui::Event::Key { key, pressed: true, modifiers: held, .. } = event else { return true };
            let fine = held.ctrl || held.command;
            let (axis, sign) = match (key, held.alt || (fine && held.shift)) {
                (Key::ArrowLeft, true) => (PoseAxis::Theta, -1.0),
                (Key::ArrowRight, true) => (PoseAxis::Theta, 1.0),
                (Key::ArrowLeft, false) => (PoseAxis::Y, -1.0),
                (Key::ArrowRight, false) => (PoseAxis::Y, 1.0),
                (Key::ArrowUp, false) => (PoseAxis::Z, -1.0),
                (Key::ArrowDown, false) => (PoseAxis::Z, 1.0),
                _ => return true,
            };
            let steps = match (fine, held.shift) {
                (true, _) => 0.1,
                (false, true) => 10.0,
                (false, false) => 1.0,
            };
            asked.push((axis, sign * steps));
            false
        });
    });
    asked
}

/// True where an action's keys mean it while the pointer is over a pane. Space presses what has the focus elsewhere.
pub(crate) fn fits_pane(action: Action, over: Option<Pane>) -> bool {
    action != Action::PlaySteps || over.is_some_and(|pane| matches!(pane.kind(), Kind::Steps | Kind::Scene))
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::Modifiers;

    #[test]
    fn every_key_is_known_to_the_toolkit() {
        for shortcut in Action::iter().flat_map(Action::keys) {
            assert!(key_of(*shortcut).is_some(), "{shortcut}");
        }
    }

    /// Modifiers of a shortcut, as the toolkit calls them.
    fn modifiers(s: crate::app::action::Shortcut) -> Modifiers {
        Modifiers { alt: s.alt, ctrl: s.ctrl, shift: s.shift, mac_cmd: false, command: s.ctrl }
    }

    fn press(key: Key, modifiers: Modifiers) -> Vec<Action> {
        press_at(Place { labeling: true, ..Place::default() }, key, modifiers)
    }

    fn press_at(place: Place, key: Key, modifiers: Modifiers) -> Vec<Action> {
        let ctx = egui::Context::default();
        let mut raw = egui::RawInput::default();
        raw.events.push(egui::Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers });
        let mut got = Vec::new();
        let mut output = ctx.run_ui(raw, |ui| got.extend(pressed(ui.ctx(), place, |_| true)));
        // No picture is made, so nobody uploads its textures.
        output.textures_delta.clear();
        got
    }

    #[test]
    fn no_letter_changes_labels_where_no_mask_is_drawn_and_none_acts_under_a_dialog() {
        let mut letters = 0;
        for action in Action::iter() {
            for s in action.keys().iter().filter(|s| !s.ctrl && !s.is_function()) {
                let mut m = modifiers(*s);
                m.shift |= s.is_shifted();
                let at = |place| press_at(place, key_of(*s).unwrap(), m);
                let elsewhere = if action.is_of_labeling() && !s.alt { vec![] } else { vec![action] };
                letters += usize::from(elsewhere.is_empty());
                assert_eq!(at(Place::default()), elsewhere, "{s}");
                let escape = if s.key == "Esc" { vec![action] } else { vec![] };
                assert_eq!(at(Place { dialog: true, labeling: true, ..Place::default() }), escape, "{s}");
            }
        }
        assert!(letters >= 18, "{letters} letters are of labeling");
        for action in [Action::AdoptAutomatic, Action::FillHoles, Action::ResetMask, Action::Flag] {
            assert!(action.is_of_labeling(), "{action:?}");
        }
    }

    /// Of an input method: the letters of a composition arrive as keys too on some desktops.
    #[test]
    fn letters_of_a_composition_are_the_texts_and_trigger_nothing() {
        let ctx = egui::Context::default();
        let (mut text, mut got) = (String::new(), Vec::new());
        let mut frame = |events: Vec<egui::Event>| {
            let raw = egui::RawInput { events, ..egui::RawInput::default() };
            let mut output = ctx.run_ui(raw, |ui| {
                got.extend(pressed(ui.ctx(), Place { labeling: true, ..Place::default() }, |_| true));
                ui.text_edit_singleline(&mut text).request_focus();
            });
            output.textures_delta.clear();
            text.clone()
        };
        let key = |key| egui::Event::Key {
            key,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers: Modifiers::NONE,
        };
        let ime = |event| egui::Event::Ime(event);
        let preedit = |text: &str| ime(egui::ImeEvent::Preedit { text: text.into(), active_range_chars: None });
        frame(Vec::new());
        for letters in ["n", "ni", "nih"] {
            frame(vec![preedit(letters), key(Key::B), key(Key::C), key(Key::H)]);
        }
        frame(vec![preedit("nihao"), key(Key::Enter)]);
        let typed = frame(vec![ime(egui::ImeEvent::Commit("né".into()))]);
        assert_eq!((typed.as_str(), got), ("né", Vec::new()));
        // Without a text these keys are actions.
        assert!([Key::B, Key::C, Key::H].iter().all(|key| !press(*key, Modifiers::NONE).is_empty()));
    }

    #[test]
    fn a_key_triggers_its_action_and_no_other() {
        for action in Action::iter() {
            for s in action.keys() {
                let mut m = modifiers(*s);
                m.shift |= s.is_shifted();
                assert_eq!(press(key_of(*s).unwrap(), m), vec![action], "{s}");
            }
        }
        assert_eq!(press(Key::Slash, Modifiers::SHIFT), vec![Action::ShortcutSheet]);
    }
}
