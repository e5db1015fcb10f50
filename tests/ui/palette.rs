//! The command palette: what is shown is what runs, and people's own words find it.

use eframe::egui::{Event, Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::action::Action;
use touch2touch::app::command::Pane;
use touch2touch::app::settings::{Workspace, prefer};

use super::rig::Rig;

fn open(rig: &mut Rig) {
    rig.harness.key_press_modifiers(Modifiers::COMMAND, Key::P);
    rig.harness.step();
    rig.harness.step();
    assert!(rig.harness.state().state().selection.palette);
}

#[test]
fn enter_runs_what_the_last_letter_found() {
    let Some(mut rig) = Rig::new([1280.0, 800.0], 1) else { return };
    assert_eq!(rig.harness.state().state().settings.workspace, Workspace::Inspect);
    open(&mut rig);
    // The list of no words is on screen; a quick typist's word and Enter arrive in one frame.
    let key = |pressed| Event::Key {
        key: Key::Enter,
        physical_key: None,
        pressed,
        repeat: false,
        modifiers: Modifiers::NONE,
    };
    rig.harness.input_mut().events.extend([Event::Text("Evaluate".into()), key(true), key(false)]);
    rig.harness.step();
    rig.settle();
    let state = rig.harness.state().state();
    assert!(!state.selection.palette, "it ran");
    assert!(state.library.open.is_some(), "the first row of the list before opens a folder");
    assert_eq!(state.settings.workspace, Workspace::Evaluate);
}

#[test]
fn other_words_find_actions() {
    let Some(mut rig) = Rig::new([1280.0, 800.0], 1) else { return };
    for (word, action) in [
        ("worst", Action::NextWorst),
        ("outlier", Action::NextWorst),
        ("png", Action::SavePane),
        ("csv", Action::ExportTable),
        ("orthographic", Action::Parallel),
        ("stop", Action::CancelJobs),
    ] {
        open(&mut rig);
        rig.harness.get_by_label("Find anything").type_text(word);
        rig.harness.step();
        rig.harness.step();
        let rows: Vec<f32> = rig.harness.query_all_by_label(action.name()).map(|row| row.rect().top()).collect();
        // 72 points to the palette, then the text: among its first rows.
        assert!(rows.iter().any(|top| (90.0..230.0).contains(top)), "{word}: {} at {rows:?}", action.name());
        rig.harness.key_press(Key::Escape);
        rig.settle();
    }
}

#[test]
fn a_pane_is_found_from_a_workspace_that_has_none_of_it() {
    let Some(mut rig) = Rig::new([1280.0, 800.0], 1) else { return };
    rig.send(prefer(|s| s.workspace = Workspace::Evaluate));
    rig.settle();
    open(&mut rig);
    rig.harness.get_by_label("Find anything").type_text(Pane::Settings.title());
    rig.harness.step();
    rig.harness.key_press(Key::Enter);
    rig.settle();
    let state = rig.harness.state().state();
    assert_eq!(state.settings.workspace, Workspace::Inspect);
    assert!(state.selection.panes.contains(&Pane::Settings), "{:?}", state.selection.panes);
}
