//! With a simulated grasp: masks, clouds, poses; with threads; without models.

use std::sync::{Arc, Condvar, Mutex};

use touch2touch::app::action::Action;
use touch2touch::app::command::{Command, LabelsCommand, LibraryCommand, Pane, PredictCommand};
use touch2touch::app::keys::{ImprintSource, Registration};
use touch2touch::app::runtime::Runtime;
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{ColorRange, MaskSource, MaskTool};
use touch2touch::app::state::{Absent, Lookup};
use touch2touch::app::{demand, results};
use touch2touch_core::dataset::PairId;
use touch2touch_core::rig::lab;

use super::bench::{self, Bench, Folders, SHALLOW, SIMULATED};
use super::panes;

const MEASURED: ImprintSource = ImprintSource::Measured;

#[test]
fn the_pose_follows_the_mask() {
    let mut bench = Bench::open();
    bench.send(panes(&[Pane::Scene, Pane::Measured]));
    bench.send(prefer(|s| s.mask.choice.source = MaskSource::Cad));
    bench.run(LibraryCommand::Select(SIMULATED));
    let pose = results::pose(&bench.state, MEASURED).ready().unwrap().clone();
    // The true contact of both fingers: better than the lab's tightest success limit of 5 degrees.
    assert!(pose.error_rad.unwrap() < 5f64.to_radians(), "{:?}", pose.error_rad);
    assert!(pose.report.iterations > 0 && !pose.stop.is_empty() && pose.num_points > 100);
    let cloud = results::cloud(&bench.state, MEASURED).ready().unwrap();
    assert_eq!(cloud.contact_points().len(), pose.num_points);
    // Rubbing out a part: while the pen is down nothing is computed, then cloud and pose are new.
    bench.send(prefer(|s| s.mask.tool = MaskTool::Eraser));
    let at_px = {
        let mask = results::mask_in_force(&bench.state, MEASURED, lab::RIGHT).unwrap().mask.clone();
        let at = mask.as_slice().iter().position(|v| *v).unwrap();
        [(at % mask.width()) as f32, (at / mask.width()) as f32]
    };
    bench.send(LabelsCommand::BeginStroke { finger: lab::RIGHT, source: MEASURED, at_px, erase: false });
    bench.send(LabelsCommand::StrokeTo([at_px[0] + 10.0, at_px[1] + 10.0]));
    assert!(demand::demands(&bench.state).is_empty());
    assert!(
        matches!(results::pose(&bench.state, MEASURED), Lookup::Stale(_)),
        "the old pose stays until the new one is there"
    );
    bench.run(LabelsCommand::EndStroke);
    let after = results::pose(&bench.state, MEASURED).ready().unwrap();
    assert!(after.num_points < pose.num_points);
    // The other registration is another result; the first one is still there.
    bench.run(prefer(|s| s.registration = Registration::LabIcp));
    let lab = results::pose(&bench.state, MEASURED).ready().unwrap();
    assert!(lab.error_rad.is_some() && lab.report.iterations > 1);
    bench.send(prefer(|s| s.registration = Registration::default()));
    assert!(results::pose(&bench.state, MEASURED).ready().is_some());
    // Accepting it is a change of the document like any other.
    let accept = Action::AcceptMeasuredPose.command(&bench.state).unwrap();
    bench.send(accept);
    assert!(results::accepted(&bench.state, MEASURED).is_some());
    bench.send(LabelsCommand::Undo);
    assert!(results::accepted(&bench.state, MEASURED).is_none());
}

#[test]
fn a_source_without_camera_says_why_there_is_no_pose() {
    let mut bench = Bench::open();
    let pictures = bench.another();
    bench.send(LibraryCommand::Open(pictures));
    bench.run(panes(&[Pane::Scene, Pane::Measured]));
    assert!(matches!(results::cloud(&bench.state, MEASURED), Lookup::Absent(Absent::NoCamera)));
    assert!(bench.state.tasks.is_idle());
    for (source, absent) in [(MaskSource::Truth, Absent::NotSimulated), (MaskSource::Cad, Absent::NoTool)] {
        bench.run(prefer(move |s| s.mask.choice.source = source));
        match results::mask_in_force(&bench.state, MEASURED, lab::RIGHT) {
            Err(Lookup::Absent(found)) => assert_eq!(found, absent),
            other => panic!("{other:?}"),
        }
    }
    bench.run(prefer(|s| s.mask.choice.source = MaskSource::Unet));
    assert!(results::mask_in_force(&bench.state, MEASURED, lab::RIGHT).is_ok());
}

#[test]
fn where_the_mask_model_finds_nothing_depth_decides_and_label_and_log_say_so() {
    let mut bench = Bench::open();
    bench.send(LibraryCommand::Select(SHALLOW));
    bench.send(panes(&[Pane::Measured]));
    bench.run(prefer(|s| s.mask.choice.source = MaskSource::Unet));
    let shown = results::mask_in_force(&bench.state, MEASURED, lab::RIGHT).unwrap();
    assert!(shown.label.starts_with("Depth ") && shown.label.contains("found no contact"), "{}", shown.label);
    assert!(shown.mask.as_slice().contains(&true));
    let said = |bench: &Bench| bench.state.log.entries.iter().filter(|e| e.text.contains("found no contact")).count();
    assert_eq!(said(&bench), 1, "{:#?}", bench.state.log.entries);
    // The other finger says so when it is looked at, and a source that finds contact says nothing.
    bench.run(prefer(|s| s.mask.choice.source = MaskSource::Threshold));
    assert_eq!(results::mask_in_force(&bench.state, MEASURED, lab::RIGHT).unwrap().label, "Threshold 5.00 mm");
    assert_eq!(said(&bench), 1);
}

#[test]
fn without_models_the_rest_works_and_a_notice_says_what_to_do() {
    let folders = Folders::new();
    let services = folders.services(false);
    let mut bench = Bench::with(folders, services, Vec::new());
    bench.run(panes(&[Pane::Measured, Pane::Predicted]));
    assert!(bench.state.log.entries.iter().any(|e| e.text.contains("No generator") && e.hint.is_some()));
    assert!(Action::Generate.command(&bench.state).is_none());
    bench.send(PredictCommand::Generate);
    assert_eq!(bench.errors(), 1);
    assert!(results::mask_in_force(&bench.state, MEASURED, lab::RIGHT).is_ok());
}

#[test]
fn threads_give_the_same_and_wake_the_window() {
    let folders = Folders::new();
    let woken = Arc::new((Mutex::new(false), Condvar::new()));
    let bell = woken.clone();
    let wake = Arc::new(move || {
        *bell.0.lock().unwrap() = true;
        bell.1.notify_one();
    });
    let mut runtime = Runtime::threads(Arc::new(folders.services(false)), wake);
    let mut state = bench::state();
    runtime.tick(&mut state, folders.start(bench::models()));
    runtime.tick(&mut state, vec![panes(&[Pane::Measured, Pane::Predicted, Pane::Compare])]);
    let mut asked = false;
    while results::comparison(&state, lab::RIGHT).ready().is_none() {
        if !asked && results::can_generate(&state).is_ok() && results::sample(&state).ready().is_some() {
            asked = true;
            runtime.tick(&mut state, vec![Command::Predict(PredictCommand::Generate)]);
        } else {
            // Waits for news, not for time: without the bell this test would hang, and that is what it checks.
            let mut rung = woken.0.lock().unwrap();
            while !*rung {
                rung = woken.1.wait(rung).unwrap();
            }
            *rung = false;
            drop(rung);
            runtime.tick(&mut state, Vec::new());
        }
    }
    assert_eq!(results::chosen(&state, lab::RIGHT).unwrap().config.seed, 42);
}

#[test]
fn colors_stay_from_pair_to_pair() {
    let mut bench = Bench::open();
    bench.run(panes(&[Pane::Measured]));
    let ranges = |bench: &mut Bench| {
        let mut seen = Vec::new();
        for pair in [0, 1, 0] {
            bench.run(LibraryCommand::Select(PairId(pair)));
            seen.push(bench.state.settings.range);
        }
        seen
    };
    let kept = bench.state.settings.range;
    assert_eq!(ranges(&mut bench), [kept; 3], "nobody asked for other colors");
    // A person gives each pair its own, and takes that back.
    bench.send(prefer(move |s| s.range = ColorRange { locked: false, ..kept }));
    let own = ranges(&mut bench);
    assert!(own[0] != own[1] && own[0] == own[2], "{own:?}");
    bench.send(prefer(move |s| s.range = ColorRange { locked: true, ..own[0] }));
    let kept = bench.state.settings.range;
    assert_eq!(ranges(&mut bench), [kept; 3]);
}
