//! Labels that cannot be saved: what is asked at closing, trying again, and where they go else.

use std::time::{Duration, Instant};

use touch2touch::app::command::{LabelsCommand, LibraryCommand, Pane, UiRequest, UnsavedCommand};
use touch2touch::app::labels::Question;
use touch2touch::app::library::Place;
use touch2touch::app::services::Services;
use touch2touch::app::source::Source;
use touch2touch_core::rig::lab;
use touch2touch_pipeline::io::masks::{FOLDER, MaskStore};

use super::bench::{Bench, Folders, PAIR, models};
use super::masks::{bench, stroke};
use super::panes;

/// One round with a command, and all that follows; whether the window closes.
fn closes(bench: &mut Bench, command: UnsavedCommand) -> bool {
    let mut asked = bench.runtime.tick(&mut bench.state, vec![LabelsCommand::Unsaved(command).into()]);
    asked.extend(bench.runtime.settle(&mut bench.state));
    asked.contains(&UiRequest::Close)
}

fn on_disk(bench: &Bench) -> bool {
    bench.stored(PAIR).measured(lab::RIGHT).is_some()
}

/// What waits for the next opening.
fn waiting(bench: &Bench) -> Source {
    Source::open(&Place::Path(bench.folders.data.clone()), Some(&bench.folders.config.join("recovered"))).unwrap()
}

/// A stroke on a full disk.
fn stuck() -> Bench {
    let mut bench = bench();
    bench.fill(true);
    stroke(&mut bench, lab::RIGHT, [20.0, 1.0], [21.0, 1.0]);
    bench.settle();
    assert!(bench.state.document.failed.contains_key(PAIR) && bench.state.document.question.is_none());
    bench
}

#[test]
fn the_window_closes_at_once_where_all_is_saved_and_after_what_is_being_written() {
    let mut bench = bench();
    assert!(closes(&mut bench, UnsavedCommand::Close));
    stroke(&mut bench, lab::RIGHT, [20.0, 1.0], [21.0, 1.0]);
    let asked = bench.runtime.tick(&mut bench.state, vec![LabelsCommand::Unsaved(UnsavedCommand::Close).into()]);
    assert!(!asked.contains(&UiRequest::Close) && !on_disk(&bench), "the disk did not have its turn yet");
    let asked = bench.runtime.settle(&mut bench.state);
    assert!(asked.contains(&UiRequest::Close) && on_disk(&bench));
}

#[test]
fn closing_on_a_full_disk_asks_and_closes_once_it_is_saved() {
    let mut bench = stuck();
    assert!(!closes(&mut bench, UnsavedCommand::Close));
    assert_eq!(bench.state.document.question, Some(Question::Closing));
    assert_eq!(bench.errors(), 1, "it is said once, however often it is tried");
    assert!(!closes(&mut bench, UnsavedCommand::Stay));
    bench.fill(false);
    assert!(!closes(&mut bench, UnsavedCommand::Retry), "the person stays");
    assert!(on_disk(&bench) && bench.state.document.failed.is_empty());
    bench.fill(true);
    stroke(&mut bench, lab::RIGHT, [2.0, 1.0], [3.0, 1.0]);
    assert!(!closes(&mut bench, UnsavedCommand::Close));
    bench.fill(false);
    assert!(closes(&mut bench, UnsavedCommand::Retry));
    assert!(bench.state.document.unsaved.is_empty());
}

#[test]
fn what_failed_is_tried_again_after_a_while_and_only_then() {
    let folders = Folders::new();
    let services = Services { retry_after: Duration::from_millis(30), ..folders.services(false) };
    let mut bench = Bench::with(folders, services, models());
    bench.run(panes(&[Pane::Measured, Pane::Masks]));
    assert_eq!(bench.runtime.next_tick(), None, "an idle window sleeps");
    bench.fill(true);
    stroke(&mut bench, lab::RIGHT, [20.0, 1.0], [21.0, 1.0]);
    bench.settle();
    assert!(bench.runtime.next_tick().is_some_and(|wait| wait <= Duration::from_millis(30)));
    bench.fill(false);
    let begin = Instant::now();
    while !on_disk(&bench) {
        assert!(begin.elapsed() < Duration::from_secs(30));
        std::thread::sleep(bench.runtime.next_tick().unwrap_or_default());
        bench.settle();
    }
    bench.settle();
    assert!(bench.state.document.unsaved.is_empty() && bench.state.document.failed.is_empty());
    assert_eq!(bench.runtime.next_tick(), None);
}

#[test]
fn discarding_closes_and_leaves_nothing_and_ending_otherwise_keeps_it() {
    let mut bench = stuck();
    assert!(!closes(&mut bench, UnsavedCommand::Discard), "nothing was asked");
    closes(&mut bench, UnsavedCommand::Close);
    assert!(closes(&mut bench, UnsavedCommand::Discard));
    bench.runtime.finish(&mut bench.state);
    bench.fill(false);
    assert!(waiting(&bench).recovered.pairs.is_empty() && !on_disk(&bench));

    let mut bench = stuck();
    // One more, of which the disk heard nothing when the end came.
    stroke(&mut bench, lab::RIGHT, [2.0, 14.0], [3.0, 14.0]);
    bench.runtime.finish(&mut bench.state);
    bench.fill(false);
    assert_eq!(waiting(&bench).recovered.pairs, [PAIR]);
    let mask = bench.stored(PAIR).measured(lab::RIGHT).unwrap().mask.clone();
    assert!(mask[(20, 1)] && mask[(2, 14)]);
}

#[test]
fn a_data_set_that_went_away_is_asked_about_at_once_for_each_new_stroke() {
    let mut bench = bench();
    bench.lose(true);
    stroke(&mut bench, lab::RIGHT, [20.0, 1.0], [21.0, 1.0]);
    bench.settle();
    assert_eq!(bench.state.document.question, Some(Question::Lost));
    closes(&mut bench, UnsavedCommand::Stay);
    closes(&mut bench, UnsavedCommand::Retry);
    assert_eq!(bench.state.document.question, None, "trying again by itself does not ask again");
    stroke(&mut bench, lab::RIGHT, [2.0, 1.0], [3.0, 1.0]);
    bench.settle();
    assert_eq!(bench.state.document.question, Some(Question::Lost));
    bench.lose(false);
    assert!(!closes(&mut bench, UnsavedCommand::Retry), "it came back: that closes the question, not the window");
    assert!(bench.state.document.question.is_none() && on_disk(&bench));
}

#[test]
fn what_is_saved_elsewhere_is_saved_unless_it_changed_meanwhile() {
    let mut bench = stuck();
    closes(&mut bench, UnsavedCommand::Close);
    let folder = bench.folders.data.with_file_name("usb");
    bench.send(LabelsCommand::Unsaved(UnsavedCommand::Elsewhere(folder.clone())));
    // Drawn while that is being written.
    stroke(&mut bench, lab::RIGHT, [2.0, 14.0], [3.0, 14.0]);
    bench.settle();
    assert!(bench.state.document.unsaved.contains(PAIR));
    assert!(closes(&mut bench, UnsavedCommand::Elsewhere(folder.clone())));
    let doc = &bench.state.document;
    assert!(doc.unsaved.is_empty() && doc.failed.is_empty() && doc.elsewhere.contains(PAIR));
    let kept = MaskStore::in_folder(folder.join(FOLDER)).load(PAIR, lab::RIGHT).unwrap().unwrap();
    assert!(kept.mask[(20, 1)] && kept.mask[(2, 14)]);
}

#[test]
fn another_data_set_does_not_cost_what_could_not_be_saved() {
    let mut bench = stuck();
    let another = bench.another();
    bench.run(LibraryCommand::Open(another));
    assert!(bench.state.document.unsaved.is_empty());
    bench.fill(false);
    assert_eq!(waiting(&bench).recovered.pairs, [PAIR]);
    // What fails only after the other one is open.
    let mut bench = super::masks::bench();
    bench.fill(true);
    let another = bench.another();
    bench.send(LibraryCommand::Open(another));
    stroke(&mut bench, lab::RIGHT, [20.0, 1.0], [21.0, 1.0]);
    bench.settle();
    bench.fill(false);
    assert_eq!(waiting(&bench).recovered.pairs, [PAIR]);
    assert!(on_disk(&bench));
}
