//! The steps of a registration: computed only while looked at, found again under their recipe.

use touch2touch::app::action::Action;
use touch2touch::app::command::{Command, LibraryCommand, Pane};
use touch2touch::app::inspect::InspectCommand;
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::settings::MaskSource;
use touch2touch::app::settings::prefer;
use touch2touch::app::state::Lookup;
use touch2touch::app::{demand, results};
use touch2touch_core::dataset::PairId;
use touch2touch_core::frames::PlanarPose;

use super::bench::{Bench, SIMULATED};
use super::panes;

const MEASURED: ImprintSource = ImprintSource::Measured;

/// The simulated grasp with the true contact as its mask.
fn bench(list: &[Pane]) -> Bench {
    let mut bench = Bench::open();
    bench.send(prefer(|s| s.mask.choice.source = MaskSource::Truth));
    bench.send(LibraryCommand::Select(SIMULATED));
    bench.run(panes(list));
    bench
}

fn send(bench: &mut Bench, command: InspectCommand) {
    bench.send(Command::Inspect(command));
}

#[test]
fn nothing_is_recorded_unless_it_is_looked_at() {
    let mut bench = bench(&[Pane::Scene, Pane::Metrics]);
    let pose = results::pose(&bench.state, MEASURED).ready().unwrap().clone();
    assert!(pose.report.trace.is_empty() && pose.report.fits.is_empty());
    assert!(bench.state.results.runs.is_empty());
    assert!(Action::StepBack.command(&bench.state).is_none(), "there is nothing to step through");
    // The pane of the steps alone records; it needs no pose beside.
    bench.state.results.estimates.clear();
    bench.run(panes(&[Pane::Steps]));
    assert_eq!(bench.state.results.runs.len(), 1);
    assert!(results::pose(&bench.state, MEASURED).ready().is_none());
    let inspection = results::inspection(&bench.state).ready().unwrap().clone();
    assert_eq!(inspection.report().grasp_from_object, pose.grasp_from_object, "looking changes nothing");
    // A closed pane asks for nothing.
    bench.send(panes(&[Pane::Log]));
    assert!(demand::demands(&bench.state).is_empty());
}

#[test]
fn stepping_goes_both_ways_and_stops_at_the_ends() {
    let mut bench = bench(&[Pane::Steps]);
    let (run, last) = {
        let shown = results::inspected(&bench.state).unwrap();
        assert!(shown.is_last() && shown.run == shown.inspection.report().winner);
        assert_eq!(shown.step.grasp_from_object, shown.inspection.report().grasp_from_object);
        (shown.run, shown.at)
    };
    assert!(last > 3, "{last} steps are too few for this test");
    let at = |bench: &Bench| results::inspected(&bench.state).unwrap().at;
    let act = |bench: &mut Bench, action: Action| {
        let command = action.command(&bench.state).unwrap();
        bench.send(command);
    };
    assert!(Action::StepForward.command(&bench.state).is_none());
    act(&mut bench, Action::StepBack);
    act(&mut bench, Action::StepBack);
    assert_eq!(at(&bench), last - 2);
    bench.send(InspectCommand::Go { run, at: 0 });
    assert_eq!(at(&bench), 0);
    {
        let shown = results::inspected(&bench.state).unwrap();
        let first = shown.inspection.step(run, 0).unwrap().grasp_from_object;
        assert_eq!(shown.step.grasp_from_object, first, "step 0 is the applied start");
        assert_eq!(shown.step.iteration, 0);
        assert!(shown.inspection.what_next(run, 0).contains("moving"));
        let reason = shown.inspection.what_next(run, last);
        assert_eq!(reason, shown.inspection.report().runs[run].stop.to_string());
    }
    send(&mut bench, InspectCommand::By(i64::MAX));
    assert_eq!((at(&bench), bench.state.inspect.at), (last, None));
    send(&mut bench, InspectCommand::By(i64::MIN));
    assert_eq!(at(&bench), 0);
    // Playing from the end begins again, and ends by itself.
    send(&mut bench, InspectCommand::By(i64::MAX));
    act(&mut bench, Action::PlaySteps);
    assert!(bench.state.inspect.playing && at(&bench) == 0);
    for _ in 0..last {
        assert!(bench.state.inspect.playing);
        send(&mut bench, InspectCommand::By(1));
    }
    assert!(!bench.state.inspect.playing && results::inspected(&bench.state).unwrap().is_last());
    // Scrubbing computed nothing.
    assert_eq!(bench.state.results.runs.len(), 1);
    // Another start; one that does not exist shows the last.
    send(&mut bench, InspectCommand::Run(usize::MAX));
    let shown = results::inspected(&bench.state).unwrap();
    assert_eq!(shown.run, shown.inspection.num_runs() - 1);
    send(&mut bench, InspectCommand::Go { run: 0, at: 1 });
    assert_eq!((results::inspected(&bench.state).unwrap().run, at(&bench)), (0, 1));
}

#[test]
fn a_start_is_a_run_of_its_own_and_the_pair_resets_it() {
    let mut bench = bench(&[Pane::Steps]);
    let start = PlanarPose { theta_rad: 0.3, y_m: 0.004, z_m: 0.0 };
    send(&mut bench, InspectCommand::Start(Some(PlanarPose { y_m: f64::NAN, ..start })));
    assert_eq!(bench.state.inspect.start, None);
    send(&mut bench, InspectCommand::Start(Some(start)));
    assert!(
        matches!(results::inspection(&bench.state), Lookup::Stale(_)),
        "the run before stays until the new one is there"
    );
    bench.settle();
    let inspection = results::inspection(&bench.state).ready().unwrap().clone();
    assert_eq!((inspection.num_runs(), inspection.requested(0)), (1, Some(start)));
    let applied = inspection.step(0, 0).unwrap().grasp_from_object;
    assert!((applied.theta_rad - start.theta_rad).abs() < 1e-9 && (applied.y_m - start.y_m).abs() < 1e-9);
    assert_eq!(results::inspected(&bench.state).unwrap().at, 0, "it is watched from where it began");
    // A start far from everything is a failure of this run alone.
    send(&mut bench, InspectCommand::Start(Some(PlanarPose { y_m: 0.5, ..start })));
    bench.settle();
    assert!(matches!(results::inspection(&bench.state), Lookup::Failed(err) if err.why.contains("outline")));
    assert_eq!(bench.errors(), 0, "the pane says it; the log does not repeat it");
    let back = Action::OwnStarts.command(&bench.state).unwrap();
    bench.send(back);
    assert!(results::inspection(&bench.state).ready().is_some_and(|i| i.requested(0) != Some(start)));
    send(&mut bench, InspectCommand::Start(Some(start)));
    bench.run(LibraryCommand::Select(PairId(0)));
    assert_eq!(bench.state.inspect.start, None);
    assert!(results::inspected(&bench.state).is_none(), "the true contact of this pair is not known");
}
