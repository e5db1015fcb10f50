//! Keys: shown by what works here, changed by clicks and keys, kept.

use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::action::Action;
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{Theme, Workspace};
use touch2touch::app::state::State;

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];

fn state(rig: &Rig) -> &State {
    rig.harness.state().state()
}

fn press(rig: &mut Rig, modifiers: Modifiers, key: Key) {
    rig.harness.key_press_modifiers(modifiers, key);
    rig.harness.step();
    rig.settle();
}

fn click(rig: &mut Rig, label: &str) {
    rig.harness.get_by_label(label).click();
    rig.harness.step();
    rig.settle();
}

/// Narrows the sheet to what a person looks for, so that its rows are on screen.
fn find(rig: &mut Rig, text: &str) {
    rig.harness.get_by_label("Filter shortcuts").type_text(text);
    rig.harness.step();
    rig.settle();
}

fn says(rig: &Rig, text: &str) -> bool {
    rig.harness.query_all_by_label_contains(text).next().is_some()
}

#[test]
fn a_key_is_changed_by_a_click_and_a_key_and_survives_a_restart() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    rig.send(prefer(|s| s.hint_dismissed = true));
    press(&mut rig, Modifiers::NONE, Key::F1);
    find(&mut rig, "dark or");
    click(&mut rig, "Another key for Dark or light");
    // What is waited for means nothing else: Ctrl+P opens no palette, Escape closes no sheet.
    assert!(says(&rig, "Press the new key of Dark or light"));
    press(&mut rig, Modifiers::NONE, Key::Escape);
    assert!(state(&rig).selection.shortcut_sheet && !says(&rig, "Press the new key"));
    click(&mut rig, "Another key for Dark or light");
    press(&mut rig, Modifiers::CTRL, Key::J);
    assert_eq!(state(&rig).settings.keys.text(Action::SwitchTheme), "Ctrl+J");
    rig.harness.get_by_label("Key of Dark or light");
    press(&mut rig, Modifiers::NONE, Key::Escape);
    assert!(!state(&rig).selection.shortcut_sheet);
    press(&mut rig, Modifiers::CTRL, Key::J);
    assert_eq!(state(&rig).settings.theme, Theme::Light);

    // Another one in its place: the old one does nothing any more, and tooltips and menus say the new one.
    press(&mut rig, Modifiers::NONE, Key::F1);
    find(&mut rig, "dark or");
    click(&mut rig, "Key of Dark or light");
    press(&mut rig, Modifiers::NONE, Key::F9);
    press(&mut rig, Modifiers::NONE, Key::Escape);
    press(&mut rig, Modifiers::CTRL, Key::J);
    assert_eq!(state(&rig).settings.theme, Theme::Light);
    press(&mut rig, Modifiers::NONE, Key::F9);
    assert_eq!(state(&rig).settings.theme, Theme::Dark);
    click(&mut rig, "View");
    rig.harness.get_by_label("Dark or light").hover();
    for _ in 0..40 {
        rig.harness.step();
    }
    assert!(says(&rig, "(F9)"), "the tooltip");

    rig.restart(SIZE);
    press(&mut rig, Modifiers::NONE, Key::F9);
    assert_eq!(state(&rig).settings.theme, Theme::Light);
    press(&mut rig, Modifiers::NONE, Key::F1);
    find(&mut rig, "dark or");
    click(&mut rig, "Default key of Dark or light");
    press(&mut rig, Modifiers::NONE, Key::Escape);
    press(&mut rig, Modifiers::NONE, Key::F9);
    assert_eq!(state(&rig).settings.theme, Theme::Light);
}

#[test]
fn a_key_that_another_action_has_is_refused_or_taken_over() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    rig.send(prefer(|s| s.hint_dismissed = true));
    let keys = |rig: &Rig, action| state(rig).settings.keys.text(action);
    press(&mut rig, Modifiers::NONE, Key::F1);
    find(&mut rig, "dark or");
    click(&mut rig, "Another key for Dark or light");
    press(&mut rig, Modifiers::CTRL, Key::P);
    assert!(says(&rig, "Ctrl+P is the key of Command palette."));
    assert!(!state(&rig).selection.palette);
    rig.shoot("shortcuts-held");
    click(&mut rig, "Leave it");
    assert_eq!((keys(&rig, Action::SwitchTheme).as_str(), keys(&rig, Action::Palette).as_str()), ("", "Ctrl+P"));
    for (modifiers, key, what) in [
        (Modifiers::ALT, Key::F4, "Alt+F4 belongs to the desktop"),
        (Modifiers::NONE, Key::Tab, "No action can have this key"),
    ] {
        click(&mut rig, "Another key for Dark or light");
        press(&mut rig, modifiers, key);
        assert!(says(&rig, what), "{what}");
        assert_eq!(keys(&rig, Action::SwitchTheme), "");
    }
    click(&mut rig, "Another key for Dark or light");
    press(&mut rig, Modifiers::CTRL, Key::P);
    click(&mut rig, "Give it to Dark or light");
    assert_eq!(keys(&rig, Action::SwitchTheme), "Ctrl+P");
    assert_eq!(keys(&rig, Action::Palette), "Ctrl+K", "its other one");
    click(&mut rig, "Key of Dark or light");
    click(&mut rig, "No key");
    assert_eq!((keys(&rig, Action::SwitchTheme).as_str(), keys(&rig, Action::Palette).as_str()), ("", "Ctrl+P"));
    click(&mut rig, "Another key for Dark or light");
    press(&mut rig, Modifiers::NONE, Key::F9);
    click(&mut rig, "All defaults");
    assert_eq!(keys(&rig, Action::SwitchTheme), "");
}

#[test]
fn the_sheet_begins_with_what_works_here_and_fits_the_window() {
    for size in [SIZE, [1024.0, 700.0]] {
        let Some(mut rig) = Rig::new(size, 1) else { return };
        rig.send(prefer(|s| s.hint_dismissed = true));
        rig.send(prefer(|s| s.workspace = Workspace::Align));
        let over = rig.harness.get_by_label("3D view, measured").rect().center();
        rig.harness.hover_at(over);
        rig.harness.step();
        press(&mut rig, Modifiers::NONE, Key::F1);
        rig.shoot(&format!("shortcuts-{}", size[0]));
        assert!(says(&rig, "HERE: ALIGN, 3D"));
        let top = |rig: &Rig, name: &str| rig.harness.get_by_label(name).rect().top();
        let (here, file) = (top(&rig, "Another key for Cut open"), top(&rig, "Another key for Open folder…"));
        assert!(here < file, "{here} {file}");
        // An action stands once.
        rig.harness.get_by_label("Another key for View from the top");
        for label in ["Filter shortcuts", "All defaults", "Close"] {
            let rect = rig.harness.get_by_label(label).rect();
            assert!(rect.right() <= size[0] && rect.bottom() <= size[1], "{label}: {rect:?}");
        }
        let keys = rig.harness.query_all_by_label_contains("Another key for").map(|node| node.rect());
        for rect in keys.filter(|rect| rect.height() > 0.0) {
            assert!(rect.left() >= 0.0 && rect.right() <= size[0] - 32.0, "{rect:?}");
        }
        find(&mut rig, "Ctrl+S");
        assert_eq!(rig.harness.query_all_by_label_contains("Another key for").count(), 1);
        rig.shoot(&format!("shortcuts-filter-{}", size[0]));
    }
}
