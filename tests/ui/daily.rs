//! Small things of every day: what was on screen comes back, a dead end offers the way out.

use eframe::egui::vec2;
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{Command, LibraryCommand, Pane, SettingsCommand, TasksCommand, UiRequest, ViewCommand};
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::results;
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{MaskSource, Workspace};
use touch2touch::app::state::{Lookup, State};
use touch2touch::app::tasks::Level;
use touch2touch_core::pose::Registration;
use touch2touch_core::rig::lab;
use touch2touch_pipeline::error::TaskError;

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];
const MEASURED: ImprintSource = ImprintSource::Measured;

fn state(rig: &Rig) -> &State {
    rig.harness.state().state()
}

/// Notes that go by themselves are gone, and the panes are as high as they stay.
fn quiet(rig: &mut Rig) {
    for _ in 0..60 {
        rig.harness.step();
    }
}

#[test]
fn a_restart_brings_back_pair_finger_camera_and_the_large_pane() {
    let Some(mut rig) = Rig::new(SIZE, 3) else { return };
    rig.send(prefer(|s| s.hint_dismissed = true));
    rig.send(prefer(|s| s.workspace = Workspace::Align));
    rig.send(LibraryCommand::Step(4));
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
    let pair = state(&rig).pair_name().to_owned();
    let turned = rig.harness.state().on_screen(MEASURED, [0.0, 0.01, 0.01]).unwrap();
    rig.harness.state_mut().remember();
    rig.harness.step();
    rig.settle();

    rig.restart(SIZE);
    quiet(&mut rig);
    assert_eq!(state(&rig).pair_name(), pair);
    assert_eq!(state(&rig).selection.finger, lab::LEFT);
    assert!(!state(&rig).selection.both_fingers);
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
    assert_eq!(state(&rig).selection.panes.iter().copied().collect::<Vec<_>>(), [Pane::Scene]);
    rig.send(SettingsCommand::ResetSettings);
    rig.restart(SIZE);
    assert_ne!(state(&rig).pair_name(), pair);
}

#[test]
fn a_mask_without_contact_offers_the_threshold() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    rig.send(prefer(|s| s.hint_dismissed = true));
    let mut mask = state(&rig).settings.mask.clone();
    mask.choice.source = MaskSource::TopPercent;
    mask.choice.top_percent = 0.0;
    rig.send(prefer(move |s| s.mask = mask.clone()));
    // Membranes need no mask.
    rig.send(prefer(|s| s.registration = Registration::DistanceField(None)));
    rig.send(prefer(|s| s.workspace = Workspace::Align));
    assert!(
        matches!(results::pose(state(&rig), MEASURED), Lookup::Failed(_)),
        "{:?}",
        results::pose(state(&rig), MEASURED)
    );
    rig.shoot("daily-no-contact");
    rig.harness.get_all_by_label("Use threshold").next().unwrap().click();
    rig.harness.step();
    rig.settle();
    assert_eq!(state(&rig).settings.mask.choice.source, MaskSource::Threshold);
    assert!(results::pose(state(&rig), MEASURED).ready().is_some(), "{:?}", results::pose(state(&rig), MEASURED));
    assert!(rig.harness.query_by_label("Use threshold").is_none());
}

#[test]
fn notes_cover_nothing_and_only_errors_stay() {
    let Some(mut rig) = Rig::new(SIZE, 2) else { return };
    rig.send(prefer(|s| s.hint_dismissed = true));
    rig.send(prefer(|s| s.workspace = Workspace::Align));
    let dismiss = |rig: &Rig| rig.harness.query_all_by_label("Dismiss").next().map(|button| button.rect());
    // That there is no mask model is a warning: it goes by itself, and stays in the log.
    quiet(&mut rig);
    assert!(state(&rig).log.unseen().any(|entry| entry.level == Level::Warning));
    assert!(dismiss(&rig).is_none());
    rig.send(TasksCommand::Report(TaskError::new("Read the cup", "the handle is missing")));
    let note = dismiss(&rig).expect("an error is said");
    let view = rig.harness.get_by_label("3D view, measured").rect();
    let panes = rig.harness.get_by_label("Filter pairs").rect();
    assert!(note.top() >= view.bottom() && note.top() >= panes.bottom(), "{note:?} {view:?}");
    rig.shoot("daily-note");
    // A minute of the window's clock: the error stands.
    for _ in 0..240 {
        rig.harness.step();
    }
    assert!(dismiss(&rig).is_some());
    rig.harness.get_by_label("Dismiss").click();
    rig.harness.step();
    rig.settle();
    assert!(dismiss(&rig).is_none());
}
