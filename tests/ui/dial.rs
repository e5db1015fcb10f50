//! The dial: a run, its plots, a pair opened from a dot, a value put in force.

use eframe::egui;
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{DialCommand, LibraryCommand, Pane, UiRequest, ViewCommand};
use touch2touch::app::dial::DialPairs;
use touch2touch::app::library::Place;
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{MaskSource, Theme, Workspace};
use touch2touch_core::pose::Registration;
use touch2touch_work::sweep::Dial;

use super::rig::{Rig, write_dataset};

fn open(rig: &mut Rig) {
    rig.send(prefer(|s| s.hint_dismissed = true));
    rig.send(prefer(|s| s.workspace = Workspace::Evaluate));
    rig.send(ViewCommand::Ui(UiRequest::ShowPane(Pane::Dial)));
}

fn click(rig: &mut Rig, label: &str) {
    rig.harness.get_by_label(label).click();
    rig.harness.step();
    rig.settle();
}

#[test]
fn a_dial_is_turned_a_dot_opens_its_pair_and_a_value_is_put_in_force() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("grasps");
    write_dataset(&data, 2);
    let Some(mut rig) = Rig::live([1280.0, 800.0], Place::Path(data)) else { return };
    open(&mut rig);
    rig.harness.get_by_label_contains("Run it to see what this dial does");
    rig.shoot("dial-empty");
    // A dial that cannot be turned says why, and what can.
    rig.send(DialCommand::Choose(Dial::Trim));
    rig.harness.get_by_label_contains("does not trim");
    rig.shoot("dial-refused");
    rig.send(DialCommand::Choose(Dial::Threshold));
    rig.send(DialCommand::Range([3.0, 7.0], 5));
    click(&mut rig, "Turn the dial");
    let found = rig.harness.state().state().dial.result.clone().expect("it was turned");
    assert_eq!((found.pairs, found.series.len(), found.series[1].points.len()), (4, 2, 5));
    rig.shoot("dial-threshold");
    for mm in [3, 4, 5, 6, 7] {
        rig.harness.get_by_label_contains(&format!("Pairs at {mm} mm: median"));
    }
    // The mask model decides: the plot of what is in force is beside those of the values.
    rig.harness.get_by_label_contains("Pairs at as set: median");

    // Along the floor of a plot there is a dot at the error of the best pair.
    let plot = rig.harness.get_by_label_contains("Pairs at 5 mm: ").rect();
    let points = &found.series[1].points[2];
    let best = points.cases.iter().min_by(|a, b| a.error_rad.unwrap().total_cmp(&b.error_rad.unwrap())).unwrap();
    let other = points.cases.iter().find(|case| case.pair != best.pair).unwrap().pair;
    rig.send(LibraryCommand::Select(other));
    for step in 0..60 {
        let at = egui::pos2(plot.left() + 3.0 + 3.0 * step as f32, plot.top() + 51.0);
        rig.harness.hover_at(at);
        rig.harness.step();
        rig.harness.drag_at(at);
        rig.harness.drop_at(at);
        rig.harness.step();
        rig.settle();
        if rig.harness.state().state().selection.pair != Some(other) {
            break;
        }
    }
    assert_eq!(rig.harness.state().state().selection.pair, Some(best.pair), "{}", best.name);
    rig.shoot("dial-opened");

    click(&mut rig, "Use 4 mm");
    let choice = rig.harness.state().state().settings.mask.choice;
    assert_eq!((choice.source, choice.threshold_m), (MaskSource::Threshold, 0.004));
    rig.harness.get_by_label("in force");
    click(&mut rig, "Dial over measured imprints");
    rig.shoot("dial-measured");
    // What was seen was with another registration.
    rig.send(prefer(|s| s.registration = Registration::PlanarPointToPoint.into()));
    rig.harness.get_by_label("of earlier settings");
    rig.send(DialCommand::Choose(Dial::Trim));
    click(&mut rig, "Turn the dial");
    click(&mut rig, "Use 0.2");
    assert_eq!(rig.harness.state().state().settings.registration.trim(), Some(0.2));
    rig.shoot("dial-trim");
    // A turn is over one data set.
    rig.send(LibraryCommand::Open(Place::Demo));
    assert!(rig.harness.state().state().dial.result.is_none());
}

/// The pane on more pairs, for looking at.
#[test]
#[ignore = "pictures for looking at, into the folder TOUCH2TOUCH_SCREENSHOTS"]
fn pictures_of_the_dial() {
    for (size, name) in [([1280.0, 800.0], "1280"), ([1920.0, 1080.0], "1920")] {
        let Some(mut rig) = Rig::live(size, Place::Demo) else { return };
        open(&mut rig);
        rig.shoot(&format!("{name}-dial-empty"));
        rig.send(DialCommand::Over(DialPairs::Spread(12)));
        rig.send(DialCommand::Predictions(false));
        rig.send(DialCommand::Start);
        rig.shoot(&format!("{name}-dial"));
        rig.send(prefer(|s| s.theme = Theme::Light));
        rig.shoot(&format!("{name}-dial-light"));
        rig.send(DialCommand::Choose(Dial::Gate));
        rig.send(DialCommand::Start);
        rig.shoot(&format!("{name}-dial-gate"));
    }
}
