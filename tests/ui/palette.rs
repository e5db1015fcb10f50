//! The command palette: what is shown is what runs, and people's own words find it.

use eframe::egui::{Event, Key, Modifiers};
use touch2touch::app::settings::Workspace;

use super::rig::Rig;

fn open(rig: &mut Rig) {
    rig.harness.key_press_modifiers(Modifiers::COMMAND, Key::P);
    rig.harness.step();
    rig.harness.step();
    assert!(rig.state().selection.palette);
}

#[test]
fn enter_runs_what_the_last_letter_found() {
    let Some(mut rig) = Rig::new([1280.0, 800.0], 1) else { return };
    assert_eq!(rig.state().settings.workspace, Workspace::Inspect);
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
    let state = rig.state();
    assert!(!state.selection.palette, "it ran");
    assert!(state.library.open.is_some(), "the first row of the list before opens a folder");
    assert_eq!(state.settings.workspace, Workspace::Evaluate);
}
