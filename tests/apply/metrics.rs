//! The figures of all pairs so far are those of the results that count now.

use touch2touch::app::command::{LabelsCommand, LibraryCommand, Pane, SettingsCommand};
use touch2touch::app::keys::{ImprintSource, Registration};
use touch2touch::app::metrics::PoseMetric;
use touch2touch::app::settings::MaskSource;
use touch2touch::app::state::State;
use touch2touch::app::workbench::{SceneTool, WorkbenchCommand};
use touch2touch::domain::dataset::PairId;

use super::double::{Bench, SIMULATED};
use super::panes;

const MEASURED: ImprintSource = ImprintSource::Measured;

/// The figure of the simulated grasp's measured pose, if there is one; nothing else may have any.
fn figure(state: &State) -> Option<PoseMetric> {
    let found = state.metrics_so_far();
    assert!(found.iter().all(|f| f.pair == SIMULATED && f.finger.is_none() && f.comparison.is_none()), "{found:?}");
    found.first().map(|f| f.poses[MEASURED as usize])
}

#[test]
fn a_pose_counts_as_long_as_it_is_made_as_the_settings_say() {
    let mut bench = Bench::open_simulated();
    bench.send(panes(&[Pane::SceneMeasured]));
    bench.send(SettingsCommand::SetMaskSource(MaskSource::Cad));
    assert_eq!(figure(&bench.state), None);
    bench.send(LibraryCommand::Select(SIMULATED));
    bench.settle();
    let error_rad = bench.state.pose(MEASURED).ready().unwrap().error_rad;
    let here = Some(PoseMetric { error_rad, by_hand: false });
    assert!(error_rad.is_some());
    assert_eq!(figure(&bench.state), here);
    // Another pair is looked at; then other settings, and back.
    bench.send(LibraryCommand::Select(PairId(0)));
    bench.settle();
    assert_eq!(figure(&bench.state), here);
    for (other, back) in [
        (
            SettingsCommand::SetPoseEngine(Registration::LabIcp),
            SettingsCommand::SetPoseEngine(Registration::DistanceField),
        ),
        (SettingsCommand::SetMaskSource(MaskSource::Threshold), SettingsCommand::SetMaskSource(MaskSource::Cad)),
    ] {
        bench.send(other.clone());
        assert_eq!(figure(&bench.state), None, "{other:?}");
        bench.send(back);
        assert_eq!(figure(&bench.state), here, "after {other:?}: it is among the results");
    }
    // What a person sets counts before what was registered, until it is withdrawn.
    bench.send(LibraryCommand::Select(SIMULATED));
    bench.settle();
    let truth = bench.state.truth().unwrap();
    bench.send(WorkbenchCommand::SetTool(SceneTool::Pose));
    bench.send(WorkbenchCommand::SetSide(MEASURED));
    bench.send(WorkbenchCommand::SetHandPose(truth.into()));
    bench.send(WorkbenchCommand::AcceptHand);
    let by_hand = figure(&bench.state).unwrap();
    assert!(by_hand.by_hand && by_hand.error_rad.unwrap() < 1e-9, "{by_hand:?}");
    bench.send(LabelsCommand::Undo);
    assert_eq!(figure(&bench.state), here);
}

#[test]
fn a_corrected_mask_takes_the_place_of_the_automatic_one() {
    let mut bench = Bench::open_simulated();
    bench.send(panes(&[Pane::SceneMeasured, Pane::Measured]));
    bench.send(SettingsCommand::SetMaskSource(MaskSource::Cad));
    bench.send(LibraryCommand::Select(SIMULATED));
    bench.settle();
    let automatic = figure(&bench.state).unwrap();
    let at_px = {
        let mask = bench.state.mask_in_force(MEASURED, bench.state.selection.finger).unwrap().mask.clone();
        let at = mask.as_slice().iter().position(|v| *v).unwrap();
        [(at % mask.width()) as f32, (at / mask.width()) as f32]
    };
    let finger = bench.state.selection.finger;
    bench.send(LabelsCommand::BeginStroke { finger, source: MEASURED, at_px, erase: true });
    bench.send(LabelsCommand::StrokeTo([at_px[0] + 10.0, at_px[1] + 10.0]));
    bench.send(LabelsCommand::EndStroke);
    bench.settle();
    let corrected = figure(&bench.state).unwrap();
    assert_eq!(corrected.error_rad, bench.state.pose(MEASURED).ready().unwrap().error_rad);
    assert_ne!(corrected, automatic);
    bench.send(LabelsCommand::Undo);
    assert_eq!(figure(&bench.state), Some(automatic));
}
