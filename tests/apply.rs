//! The application model without a window: commands in, state and effects out, jobs run one by one in the test's own
//! thread, so that every order of events can be had on purpose.

mod answered;
mod bench;
mod generating;
mod inspect;
mod masks;
mod random;
mod shown;
mod unsaved;
mod whole;

use std::collections::BTreeSet;

use strum::IntoEnumIterator as _;
use touch2touch::app::command::{Command, LibraryCommand, Pane, PredictCommand, TasksCommand, ViewCommand};
use touch2touch::app::jobs::Worker;
use touch2touch::app::keys::{ImprintSource, ShiftMode};
use touch2touch::app::library::{Place, Sort};
use touch2touch::app::settings::prefer;
use touch2touch::app::state::{Absent, Lookup};
use touch2touch::app::{demand, results};
use touch2touch_core::dataset::PairId;
use touch2touch_core::rig::{PadId, lab};

use bench::{Bench, IMPRINT_SIZE, PAIR};

const RIGHT: PadId = lab::RIGHT;

fn panes(list: &[Pane]) -> Command {
    Command::View(ViewCommand::ShowPanes(list.iter().copied().collect::<BTreeSet<_>>()))
}

#[test]
fn from_opening_to_the_figures() {
    let mut bench = Bench::open();
    assert_eq!(bench.state.library.order.len(), 13);
    assert_eq!(bench.state.pair_name(), PAIR, "the first pair is shown at once");
    assert!(matches!(results::imprint(&bench.state, ImprintSource::Measured, RIGHT), Lookup::Waiting));
    bench.run(panes(&[Pane::Measured, Pane::Predicted, Pane::Compare, Pane::Metrics]));
    assert!(bench.state.tasks.is_idle());
    assert_eq!(results::imprint(&bench.state, ImprintSource::Measured, RIGHT).ready().unwrap().size(), IMPRINT_SIZE);
    assert!(matches!(
        results::imprint(&bench.state, ImprintSource::Predicted, RIGHT),
        Lookup::Absent(Absent::NoPrediction)
    ));
    bench.send(PredictCommand::Generate);
    let task = bench.state.tasks.running.values().next().unwrap();
    assert_eq!(
        (bench.state.tasks.running.len(), task.recipes.len()),
        (1, 2),
        "the figures need both fingers: one batch"
    );
    bench.settle();
    assert_eq!(bench.generated(), 2);
    let recipe = results::chosen(&bench.state, RIGHT).unwrap().clone();
    assert_eq!(recipe.config.seed, 42);
    assert_eq!(results::imprint(&bench.state, ImprintSource::Predicted, RIGHT).ready().unwrap().size(), IMPRINT_SIZE);
    let comparison = results::comparison(&bench.state, RIGHT).ready().unwrap();
    assert!(comparison.psnr_db.is_some_and(f64::is_finite) && comparison.mae_m > 0.0);
    // The same recipe again is there already.
    let runs = bench.generated();
    bench.send(PredictCommand::Generate);
    assert!(bench.state.tasks.running.is_empty());
    assert_eq!(bench.generated(), runs);
    // Another range mapping needs no model.
    bench.run(prefer(|s| s.shift = ShiftMode::Raw));
    assert!(results::comparison(&bench.state, RIGHT).ready().is_some());
    assert_eq!(bench.generated(), runs);
}

#[test]
fn what_is_not_on_screen_is_not_computed() {
    let mut bench = Bench::open();
    bench.settle();
    assert_eq!(bench.state.results.samples.len(), 0, "no pane, no work");
    bench.send(panes(&[Pane::Log, Pane::Settings]));
    assert!(demand::demands(&bench.state).is_empty());
    bench.run(panes(&[Pane::GelSlim]));
    let loaded = bench.state.results.samples.len();
    assert_eq!(loaded, 5, "the pair shown and four neighbors on the one side that has any");
    assert!(bench.state.results.estimates.is_empty());
    bench.send(panes(&[Pane::Browser]));
    bench.run(LibraryCommand::ShowRows(0..3));
    assert_eq!(bench.state.results.thumbnails.len(), 3);
    bench.run(panes(&[Pane::Measured]));
    let masked = |finger| results::mask_in_force(&bench.state, ImprintSource::Measured, finger).is_ok();
    assert!(masked(RIGHT) && !masked(lab::LEFT), "only the active finger is on screen");
    assert_eq!(bench.state.results.samples.len(), loaded, "thumbnails of loaded pairs need no file");
}

#[test]
fn a_late_result_lands_under_its_own_key() {
    let mut bench = Bench::open();
    bench.run(panes(&[Pane::Predicted]));
    bench.send(PredictCommand::Generate);
    let first = bench.state.pair_key().unwrap();
    bench.run(LibraryCommand::Step(1));
    assert!(results::chosen(&bench.state, RIGHT).is_none(), "the pair now shown has no prediction");
    assert!(results::shown(&bench.state, first.finger(RIGHT)).is_some());
    bench.run(LibraryCommand::Step(-1));
    assert!(results::imprint(&bench.state, ImprintSource::Predicted, RIGHT).ready().is_some());
    // Of a data set that is not open any more nothing is kept.
    bench.send(PredictCommand::GenerateNewSeed);
    bench.run(LibraryCommand::Reload);
    assert!(bench.state.results.predictions.is_empty() && bench.state.tasks.running.is_empty());
    assert_eq!(bench.state.pair_name(), PAIR);
}

#[test]
fn only_the_last_opening_counts() {
    let mut bench = Bench::open();
    let another = bench.another();
    bench.send(LibraryCommand::Open(another));
    bench.send(LibraryCommand::Open(Place::Path("missing".into())));
    bench.run(LibraryCommand::Open(Place::Demo));
    assert_eq!(bench.state.library.open.as_ref().unwrap().place, Place::Demo);
    assert_eq!((bench.state.library.opening.clone(), bench.errors()), (None, 0));
    bench.run(LibraryCommand::Open(Place::Path("missing".into())));
    assert!(bench.state.library.failure.is_some());
    assert_eq!(bench.errors(), 1);
    assert!(bench.state.library.open.is_some(), "what was open stays open");
    assert_eq!(bench.state.settings.recent[0], Place::Demo);
}

#[test]
fn jobs_stop_when_told() {
    let mut bench = Bench::open();
    bench.run(panes(&[Pane::Predicted]));
    bench.send(PredictCommand::Generate);
    bench.send(TasksCommand::CancelAll);
    bench.tick();
    assert!(bench.state.tasks.running.is_empty(), "waiting jobs end without their turn");
    assert_eq!(bench.generated(), 0);
    assert_eq!(bench.errors(), 0, "being told to stop is no error");
    assert!(bench.log().iter().any(|line| line.contains("cancelled")));
}

#[test]
fn a_failure_is_said_once_and_not_tried_again_by_itself() {
    let mut bench = Bench::open();
    bench.spoil(1, true);
    bench.run(panes(&[Pane::Measured]));
    assert_eq!(bench.errors(), 0, "pair 1 was only loaded ahead");
    let loads = bench.state.results.samples.len();
    bench.run(LibraryCommand::Select(PairId(1)));
    assert_eq!(bench.errors(), 1);
    assert!(matches!(results::imprint(&bench.state, ImprintSource::Measured, RIGHT), Lookup::Failed(_)));
    bench.settle();
    assert_eq!(bench.errors(), 1);
    assert!(bench.state.results.samples.len() > loads, "the neighbors are loaded all the same");
    bench.spoil(1, false);
    bench.run(TasksCommand::Retry);
    assert!(results::imprint(&bench.state, ImprintSource::Measured, RIGHT).ready().is_some());
}

#[test]
fn the_newest_request_replaces_a_waiting_one() {
    let mut bench = Bench::open();
    bench.send(panes(&[Pane::Measured]));
    let first = bench.state.pair_key().unwrap();
    // Scrubbing: nothing runs meanwhile.
    for _ in 0..11 {
        bench.send(LibraryCommand::Step(1));
    }
    let last = bench.state.pair_key().unwrap();
    assert_eq!(last.pair, PairId(11));
    assert!(bench.runtime.waiting(Worker::Files) <= 2 + 4 + 1, "labels, the pair, four neighbors and the settings");
    bench.settle();
    assert!(!bench.state.results.samples.contains(&first));
    assert!(bench.state.results.samples.contains(&last));
}

#[test]
fn the_list_filters_and_sorts() {
    let mut bench = Bench::open();
    bench.send(LibraryCommand::SetFilter("TOOL_B 1".into()));
    let names: Vec<&str> =
        bench.state.library.order.iter().map(|id| bench.state.library.entry(*id).unwrap().name.as_str()).collect();
    assert_eq!(names, ["tool_b/data_1"]);
    // What is selected was filtered away: the first step goes to the first of the list, and stays there.
    bench.send(LibraryCommand::Step(1));
    bench.send(LibraryCommand::Step(1));
    assert_eq!(bench.state.pair_name(), "tool_b/data_1");
    bench.send(LibraryCommand::SetFilter("nothing like it".into()));
    bench.send(LibraryCommand::First);
    bench.send(LibraryCommand::Step(i64::MIN));
    bench.send(LibraryCommand::NextUnfinished);
    assert!(bench.state.library.order.is_empty());
    bench.send(LibraryCommand::SetFilter(String::new()));
    bench.send(LibraryCommand::SetToolFilter(Some("tool_b".into())));
    for sort in Sort::iter() {
        bench.send(LibraryCommand::SetSort(sort));
        assert_eq!(bench.state.library.order.len(), 6);
    }
    bench.send(LibraryCommand::Last);
    bench.send(LibraryCommand::Step(i64::MAX));
    assert_eq!(bench.state.pair_name(), "tool_b/data_5");
}

#[test]
fn preferences_are_kept_in_range_and_saved() {
    let mut bench = Bench::open();
    bench.settle();
    bench.send(prefer(|s| s.mask.radius_px = f32::NAN));
    bench.send(prefer(|s| s.mask.radius_px = 1e9));
    assert_eq!(bench.state.settings.mask.radius_px, 40.0);
    bench.send(prefer(|s| s.mask_opacity = -3.0));
    assert_eq!(bench.state.settings.mask_opacity, 0.0);
    let range = bench.state.settings.range;
    bench.send(prefer(move |s| (s.range.min_m, s.range.max_m) = (1.0, f32::NAN)));
    assert_eq!(bench.state.settings.range, range);
    assert_eq!(bench.runtime.waiting(Worker::Files), 1, "changes that wait for the disk become one");
    bench.settle();
    assert_eq!(bench.folders.services(false).load_settings().0.mask_opacity, 0.0);
}
