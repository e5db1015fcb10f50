//! Small things of every day: what was on screen comes back, a dead end offers the way out.

use eframe::egui::vec2;
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{Command, LibraryCommand, Pane, SettingsCommand, UiRequest, ViewCommand};
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::settings::Workspace;
use touch2touch::app::settings::prefer;
use touch2touch_core::rig::lab;

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];
const MEASURED: ImprintSource = ImprintSource::Measured;

/// Notes that go by themselves are gone, and the panes are as high as they stay.
fn quiet(rig: &mut Rig) {
    for _ in 0..20 {
        rig.harness.step();
    }
}

#[test]
fn a_restart_brings_back_pair_finger_camera_and_the_large_pane() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    rig.send(prefer(|s| s.workspace = Workspace::Align));
    rig.send(LibraryCommand::Step(1));
    rig.send(ViewCommand::SelectFinger(lab::LEFT));
    rig.send(ViewCommand::ShowBothFingers(false));
    quiet(&mut rig);
    let center = rig.harness.get_by_label("3D view, measured").rect().center();
    rig.harness.hover_at(center);
    rig.harness.step();
    rig.harness.drag_at(center);
    rig.harness.hover_at(center + vec2(140.0, 30.0));
    rig.harness.step();
    rig.harness.drop_at(center + vec2(140.0, 30.0));
    rig.settle();
    let pair = rig.state().pair_name().to_owned();
    let turned = rig.harness.state().on_screen(MEASURED, [0.0, 0.01, 0.01]).unwrap();
    rig.harness.state_mut().remember();
    rig.harness.step();
    rig.settle();

    rig.restart(SIZE);
    quiet(&mut rig);
    assert_eq!(rig.state().pair_name(), pair);
    assert_eq!(rig.state().selection.finger, lab::LEFT);
    assert!(!rig.state().selection.both_fingers);
    let again = rig.harness.state().on_screen(MEASURED, [0.0, 0.01, 0.01]).unwrap();
    assert!((again - turned).length() < 1.0, "{turned:?} {again:?}");

    // The large pane, by itself; and nothing of it where another place is opened.
    let over = rig.harness.get_by_label("3D view, measured").rect().center();
    rig.harness.hover_at(over);
    rig.harness.step();
    rig.send(Command::View(ViewCommand::Ui(UiRequest::ToggleMaximized)));
    let large = |rig: &Rig| rig.harness.get_by_label("3D view, measured").rect().width();
    assert!(large(&rig) > 1000.0);
    rig.harness.state_mut().remember();
    rig.harness.step();
    rig.settle();
    rig.restart(SIZE);
    assert!(large(&rig) > 1000.0, "{}", large(&rig));
    assert_eq!(rig.state().selection.panes.iter().copied().collect::<Vec<_>>(), [Pane::Scene]);
    rig.send(SettingsCommand::ResetSettings);
    rig.restart(SIZE);
    assert_ne!(rig.state().pair_name(), pair);
}
