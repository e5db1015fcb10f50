//! Correcting masks: strokes, clean-ups, undo, saving.

use touch2touch::app::action::Action;
use touch2touch::app::command::{Answer, Command, LabelsCommand, LibraryCommand, Pane, PredictCommand, ViewCommand};
use touch2touch::app::jobs::Worker;
use touch2touch::app::keys::{ImprintSource, MaskVersion, Revision};
use touch2touch::app::labels::{MaskPlace, Review};
use touch2touch::app::results;
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{MaskSource, MaskTool};
use touch2touch_core::dataset::PairId;
use touch2touch_core::grid::Mask;
use touch2touch_core::label::CleanKind;
use touch2touch_core::rig::{PadId, lab};
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::masks::{FOLDER, MaskStore};
use touch2touch_pipeline::labels::Labels;

use super::bench::{Bench, PAIR};
use super::panes;

const MEASURED: ImprintSource = ImprintSource::Measured;

pub(super) fn bench() -> Bench {
    let mut bench = Bench::open();
    bench.run(panes(&[Pane::Measured, Pane::Masks]));
    bench
}

fn begin(bench: &mut Bench, finger: PadId, at_px: [f32; 2]) {
    bench.send(LabelsCommand::BeginStroke { finger, source: MEASURED, at_px, erase: false });
}

pub(super) fn stroke(bench: &mut Bench, finger: PadId, from: [f32; 2], to: [f32; 2]) {
    begin(bench, finger, from);
    bench.send(LabelsCommand::StrokeTo(to));
    bench.send(LabelsCommand::EndStroke);
}

fn mask(bench: &Bench, finger: PadId) -> Mask {
    (**results::mask_in_force(&bench.state, MEASURED, finger).unwrap().mask).clone()
}

fn count(mask: &Mask) -> usize {
    mask.as_slice().iter().filter(|v| **v).count()
}

#[test]
fn a_stroke_starts_from_the_mask_shown_and_is_saved_when_it_ends() {
    let mut bench = bench();
    bench.run(prefer(|s| s.mask.choice.source = MaskSource::Threshold));
    let automatic = mask(&bench, lab::RIGHT);
    assert_eq!(count(&automatic), 35 + 4, "the ring and the spot");
    begin(&mut bench, lab::RIGHT, [12.0, 2.0]);
    bench.settle();
    assert!(bench.stored(PAIR).is_empty(), "nothing is saved while the pen is down");
    bench.send(LabelsCommand::StrokeTo([14.0, 2.0]));
    bench.send(LabelsCommand::EndStroke);
    let drawn = mask(&bench, lab::RIGHT);
    assert!(drawn[(12, 2)] && drawn[(14, 2)] && drawn[(4, 4)]);
    let in_force = results::mask_in_force(&bench.state, MEASURED, lab::RIGHT).unwrap();
    assert_eq!(in_force.label, "edited by you, from Threshold 5.00 mm");
    bench.settle();
    let saved = bench.stored(PAIR);
    assert_eq!(*saved.measured(lab::RIGHT).unwrap().mask, drawn);
    assert_eq!(saved.measured(lab::LEFT), None);
    assert_eq!(saved.review, Review::InProgress);
    assert!(bench.state.document.unsaved.is_empty());
    // Another automatic source does not touch it; removing it brings that source back.
    bench.run(prefer(|s| s.mask.choice.source = MaskSource::TopPercent));
    assert_eq!(mask(&bench, lab::RIGHT), drawn);
    bench.run(LabelsCommand::ResetMask);
    assert!(matches!(
        results::mask_in_force(&bench.state, MEASURED, lab::RIGHT).unwrap().version,
        MaskVersion::Auto(_)
    ));
    // Undo changes the file too.
    bench.run(LabelsCommand::Undo);
    let saved = bench.stored(PAIR);
    assert_eq!(*saved.measured(lab::RIGHT).unwrap().mask, drawn);
}

#[test]
fn a_stroke_that_touches_nothing_leaves_nothing() {
    let mut bench = bench();
    bench.send(prefer(|s| s.mask.tool = MaskTool::Eraser));
    stroke(&mut bench, lab::RIGHT, [-900.0, 1.0], [-800.0, 1.0]);
    bench.send(prefer(|s| s.mask.tool = MaskTool::Brush));
    stroke(&mut bench, lab::RIGHT, [900.0, -900.0], [f32::NAN, 1.0]);
    bench.settle();
    assert!(bench.state.document.drawn_mask(PAIR, &MaskPlace::measured(lab::RIGHT)).is_none());
    assert!(Action::Undo.command(&bench.state).is_none());
    assert!(bench.stored(PAIR).is_empty());
    assert_eq!(bench.state.document.review(PAIR), Review::Todo);
    // Over what is right already it says that somebody looked: the pixels stay, and are theirs.
    let before = mask(&bench, lab::RIGHT);
    bench.send(prefer(|s| s.mask.tool = MaskTool::Eraser));
    stroke(&mut bench, lab::RIGHT, [21.0, 1.0], [22.0, 1.0]);
    assert_eq!(mask(&bench, lab::RIGHT), before);
    let hand = bench.state.document.drawn_mask(PAIR, &MaskPlace::measured(lab::RIGHT)).unwrap();
    assert!(hand.marks.has_hand_work());
    assert!(Action::Undo.command(&bench.state).is_some());
}

#[test]
fn a_note_typed_during_a_stroke_is_written_without_the_stroke() {
    let mut bench = bench();
    let name = PAIR.to_owned();
    begin(&mut bench, lab::RIGHT, [12.0, 2.0]);
    bench.run(LabelsCommand::SetNote(name.clone(), "odd edge".into()));
    let stored = |bench: &Bench| bench.stored(PAIR);
    assert_eq!(stored(&bench).note, "odd edge");
    assert!(stored(&bench).masks.is_empty(), "it may still be given up");
    assert!(bench.state.document.finished_labels()[&name].masks.is_empty());
    assert!(bench.state.document.stroke.is_some(), "it goes on");
    bench.run(LabelsCommand::EndStroke);
    assert_eq!(*stored(&bench).measured(lab::RIGHT).unwrap().mask, mask(&bench, lab::RIGHT));
    assert_eq!(stored(&bench).note, "odd edge");
}

#[test]
fn undo_and_redo_follow_what_is_on_screen() {
    let mut bench = bench();
    let automatic = [mask(&bench, lab::RIGHT), {
        bench.run(ViewCommand::SelectFinger(lab::LEFT));
        mask(&bench, lab::LEFT)
    }];
    bench.send(ViewCommand::SelectFinger(lab::RIGHT));
    stroke(&mut bench, lab::RIGHT, [20.0, 1.0], [21.0, 1.0]);
    let first = mask(&bench, lab::RIGHT);
    stroke(&mut bench, lab::RIGHT, [20.0, 6.0], [21.0, 6.0]);
    let second = mask(&bench, lab::RIGHT);
    bench.send(ViewCommand::SelectFinger(lab::LEFT));
    stroke(&mut bench, lab::LEFT, [20.0, 1.0], [21.0, 1.0]);
    bench.run(LibraryCommand::Select(PairId(1)));
    assert!(Action::Undo.command(&bench.state).is_none(), "nothing of pair 1 was changed");
    bench.send(LabelsCommand::Undo);
    bench.run(LibraryCommand::Select(PairId(0)));
    bench.send(LabelsCommand::Undo);
    assert_eq!(mask(&bench, lab::LEFT), automatic[1], "only the left finger is on screen");
    bench.send(ViewCommand::SelectFinger(lab::RIGHT));
    assert_eq!(mask(&bench, lab::RIGHT), second);
    bench.send(LabelsCommand::Undo);
    assert_eq!(mask(&bench, lab::RIGHT), first);
    bench.send(LabelsCommand::Undo);
    assert_eq!(mask(&bench, lab::RIGHT), automatic[0]);
    assert_eq!(bench.state.document.review(PAIR), Review::Todo, "untouched again");
    bench.send(LabelsCommand::Redo);
    bench.send(LabelsCommand::Redo);
    assert_eq!(mask(&bench, lab::RIGHT), second);
}

#[test]
fn clean_ups_work_on_the_mask_in_force() {
    let mut bench = bench();
    bench.send(LabelsCommand::CleanUp(CleanKind::FillHoles.into()));
    assert_eq!(count(&mask(&bench, lab::RIGHT)), 36 + 4);
    bench.send(LabelsCommand::CleanUp(CleanKind::LargestIsland.into()));
    assert_eq!(count(&mask(&bench, lab::RIGHT)), 36);
    bench.send(LabelsCommand::CleanUp(CleanKind::LargestIsland.into()));
    assert!(bench.log().last().unwrap().contains("nothing to change"));
    bench.send(LabelsCommand::AdoptAutomatic);
    assert_eq!(count(&mask(&bench, lab::RIGHT)), 39);
    for expected in [36, 40, 39] {
        bench.send(LabelsCommand::Undo);
        assert_eq!(count(&mask(&bench, lab::RIGHT)), expected);
    }
    assert!(bench.state.document.drawn_mask(PAIR, &MaskPlace::measured(lab::RIGHT)).is_none());
}

#[test]
fn labels_that_cannot_be_read_are_never_written() {
    let mut bench = Bench::open();
    let file = MaskStore::in_folder(bench.folders.data.join(FOLDER)).mask_file(PAIR, lab::RIGHT);
    std::fs::create_dir_all(file.parent().unwrap()).unwrap();
    std::fs::write(&file, "{ half a fi").unwrap();
    bench.run(panes(&[Pane::Measured]));
    assert_eq!(bench.errors(), 1);
    assert!(bench.state.document.blocked(PAIR).is_some());
    let automatic = mask(&bench, lab::RIGHT);
    stroke(&mut bench, lab::RIGHT, [20.0, 1.0], [21.0, 1.0]);
    for command in [
        Command::Labels(LabelsCommand::CleanUp(CleanKind::FillHoles.into())),
        Command::Labels(LabelsCommand::AdoptAutomatic),
        Command::Labels(LabelsCommand::SetReview(Review::Done)),
        Command::Labels(LabelsCommand::ResetMask),
    ] {
        bench.send(command);
    }
    bench.settle();
    assert_eq!(mask(&bench, lab::RIGHT), automatic, "the automatic mask is shown, and stays");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "{ half a fi");
    assert!(Action::FillHoles.command(&bench.state).is_none());
}

#[test]
fn nothing_is_drawn_before_the_stored_labels_are_read() {
    let mut bench = Bench::open();
    bench.send(panes(&[Pane::Measured]));
    begin(&mut bench, lab::RIGHT, [12.0, 2.0]);
    assert!(bench.state.document.stroke.is_none());
    assert!(bench.state.document.labels.is_empty());
}

#[test]
fn a_full_disk_is_said_and_what_was_drawn_is_kept_and_saved_later() {
    let mut bench = bench();
    bench.fill(true);
    stroke(&mut bench, lab::RIGHT, [20.0, 1.0], [21.0, 1.0]);
    bench.settle();
    assert_eq!(bench.errors(), 1);
    assert!(bench.state.document.unsaved.contains(PAIR));
    bench.fill(false);
    bench.run(LabelsCommand::Save);
    assert!(bench.state.document.unsaved.is_empty());
    assert!(bench.stored(PAIR).measured(lab::RIGHT).is_some());
}

/// The studio says "saved" from `unsaved`: not while a newer stroke waits for the disk.
#[test]
fn an_answer_to_an_earlier_saving_confirms_nothing_newer() {
    let mut bench = bench();
    let unsaved = |bench: &Bench| bench.state.document.unsaved.contains(PAIR);
    stroke(&mut bench, lab::RIGHT, [20.0, 1.0], [21.0, 1.0]);
    // What an earlier request, which was being carried out when this one came, is answered with.
    bench.send(Answer::LabelsSaved(PAIR.into(), Revision(0), None));
    assert!(unsaved(&bench), "the stroke is not on the disk");
    bench.settle();
    assert!(!unsaved(&bench));
}

#[test]
fn moving_on_ends_the_stroke() {
    let mut bench = bench();
    begin(&mut bench, lab::RIGHT, [12.0, 2.0]);
    bench.run(LibraryCommand::Step(1));
    let saved = bench.stored(PAIR);
    assert!(saved.measured(lab::RIGHT).unwrap().mask[(12, 2)]);
    assert!(bench.state.document.stroke.is_none());
}

#[test]
fn strokes_waiting_for_the_disk_become_one_and_survive_the_end() {
    let mut bench = bench();
    for y in 0..5 {
        stroke(&mut bench, lab::RIGHT, [20.0, y as f32 * 3.0], [21.0, y as f32 * 3.0]);
    }
    let drawn = mask(&bench, lab::RIGHT);
    assert_eq!(bench.runtime.waiting(Worker::Files), 1);
    let folders = bench.folders.clone();
    // The program ends before the disk had its turn: what waits to be written is written first.
    drop(bench);
    let stored = Labels::of(&Dataset::open(&folders.data).unwrap()).load(PAIR).unwrap();
    assert_eq!(*stored.measured(lab::RIGHT).unwrap().mask, drawn);
}

#[test]
fn done_goes_to_the_next_unfinished_and_survives_reopening() {
    let mut bench = bench();
    bench.send(LibraryCommand::DoneAndNext);
    assert_eq!(bench.state.pair_name(), "tool_a/data_1");
    bench.settle();
    bench.run(LabelsCommand::SetReview(Review::Flagged));
    bench.run(LibraryCommand::Reload);
    assert_eq!(bench.state.document.review(PAIR), Review::Done);
    assert_eq!(bench.state.document.review("tool_a/data_1"), Review::Flagged);
    bench.send(LibraryCommand::SetFilter("is:done".into()));
    assert_eq!(bench.state.library.order, [PairId(0)]);
    bench.send(LibraryCommand::NextUnfinished);
    assert!(bench.log().last().unwrap().contains("done or skipped"));
}

#[test]
fn a_mask_belongs_to_one_imprint() {
    let mut bench = Bench::open();
    bench.send(panes(&[Pane::Measured, Pane::Predicted, Pane::Masks]));
    bench.run(PredictCommand::Generate);
    let label = |bench: &Bench, source| results::mask_in_force(&bench.state, source, lab::RIGHT).unwrap().label;
    stroke(&mut bench, lab::RIGHT, [12.0, 2.0], [14.0, 2.0]);
    bench.settle();
    assert!(label(&bench, MEASURED).contains("by you"));
    assert!(!label(&bench, ImprintSource::Predicted).contains("by you"), "painted on another picture");
    let in_force =
        |bench: &Bench, source| results::mask_in_force(&bench.state, source, lab::RIGHT).unwrap().mask.clone();
    let measured = in_force(&bench, MEASURED);
    let source = ImprintSource::Predicted;
    bench.send(LabelsCommand::BeginStroke { finger: lab::RIGHT, source, at_px: [12.0, 2.0], erase: false });
    bench.send(LabelsCommand::EndStroke);
    let changed = in_force(&bench, source);
    assert!(label(&bench, source).contains("by you"));
    assert_eq!(in_force(&bench, MEASURED), measured);
    // Another prediction has none, and undo does not reach the one that is not on screen.
    bench.run(PredictCommand::GenerateNewSeed);
    assert!(!label(&bench, ImprintSource::Predicted).contains("by you"));
    for _ in 0..9 {
        bench.send(LabelsCommand::Undo);
    }
    bench.settle();
    let saved = bench.stored(PAIR);
    assert_eq!(saved.masks.len(), 1, "that of the measured imprint is undone");
    let (place, kept) = saved.masks.iter().next().unwrap();
    assert_eq!((place.of.source(), &kept.mask), (ImprintSource::Predicted, &changed));
}

#[test]
fn every_tool_draws_and_undo_takes_it_back() {
    let mut bench = bench();
    bench.run(prefer(|s| s.mask.choice.source = MaskSource::Threshold));
    let before = mask(&bench, lab::RIGHT);
    for (tool, name) in [
        (MaskTool::Lasso, "lasso"),
        (MaskTool::Polygon, "polygon"),
        (MaskTool::Rectangle, "rectangle"),
        (MaskTool::Wand, "wand"),
    ] {
        bench.send(prefer(move |s| s.mask.tool = tool));
        begin(&mut bench, lab::RIGHT, [10.0, 8.0]);
        for at in [[18.0, 8.0], [18.0, 13.0], [11.0, 13.0]] {
            bench.send(LabelsCommand::StrokeTo(at));
            bench.send(LabelsCommand::Corner(at));
        }
        bench.send(LabelsCommand::Close);
        bench.send(LabelsCommand::EndStroke);
        assert_ne!(mask(&bench, lab::RIGHT), before, "{name}");
        assert_eq!(bench.state.history.next_undo(PAIR, &results::mask_places(&bench.state)).unwrap().name, name);
        bench.send(LabelsCommand::Undo);
        assert_eq!(mask(&bench, lab::RIGHT), before, "{name}");
    }
    // A stroke given up leaves nothing.
    begin(&mut bench, lab::RIGHT, [10.0, 8.0]);
    bench.send(LabelsCommand::StrokeTo([12.0, 9.0]));
    bench.send(LabelsCommand::CancelStroke);
    assert_eq!(mask(&bench, lab::RIGHT), before);
}

#[test]
fn a_polygon_counts_once_it_is_closed() {
    let mut bench = bench();
    bench.send(prefer(|s| s.mask.choice.source = MaskSource::Threshold));
    bench.run(prefer(|s| s.mask.tool = MaskTool::Polygon));
    let before = mask(&bench, lab::RIGHT);
    let corners = [[10.0, 8.0], [18.0, 8.0], [18.0, 13.0]];
    let draw = |bench: &mut Bench, count: usize| {
        begin(bench, lab::RIGHT, corners[0]);
        for at in &corners[1..count] {
            bench.send(LabelsCommand::Corner(*at));
        }
        // The pointer is elsewhere when it is closed: that is no corner.
        bench.send(LabelsCommand::StrokeTo([1.0, 13.0]));
    };
    let set = |bench: &Bench| bench.state.document.stroke.as_ref().map(|s| s.drawing.points.len() - 1);
    let last_said = |bench: &Bench| bench.state.log.entries.back().unwrap().text.clone();
    // Two corners enclose nothing.
    draw(&mut bench, 2);
    bench.send(LabelsCommand::Close);
    assert_eq!((set(&bench), last_said(&bench).as_str()), (Some(2), "A polygon has at least three corners"));
    bench.send(LabelsCommand::Undo);
    assert_eq!(set(&bench), Some(1));
    bench.send(LabelsCommand::Undo);
    assert_eq!((set(&bench), mask(&bench, lab::RIGHT)), (None, before.clone()));
    // Neither done nor saved nor left is closed.
    draw(&mut bench, 3);
    bench.send(LibraryCommand::DoneAndNext);
    bench.send(LabelsCommand::SetReview(Review::Done));
    bench.run(LabelsCommand::Save);
    assert_eq!((set(&bench), bench.state.selection.pair), (Some(3), Some(PairId(0))));
    assert_eq!(bench.state.document.review(PAIR), Review::Todo);
    assert!(bench.state.log.entries.iter().any(|e| e.text.contains("nothing was marked")));
    bench.send(LibraryCommand::Step(1));
    assert_eq!(last_said(&bench), "The open polygon was dropped");
    bench.run(LibraryCommand::Step(-1));
    assert_eq!(mask(&bench, lab::RIGHT), before);
    assert!(bench.stored(PAIR).masks.is_empty());
    // Closed, it is its corners.
    draw(&mut bench, 3);
    bench.send(LabelsCommand::Close);
    let drawn = mask(&bench, lab::RIGHT);
    assert!(drawn.get(17, 9) == Some(&true) && drawn.get(11, 12) == before.get(11, 12), "{drawn:?}");
    bench.run(LibraryCommand::DoneAndNext);
    let saved = bench.stored(PAIR);
    assert_eq!((saved.review, saved.masks.values().any(|hand| *hand.mask == drawn)), (Review::Done, true));
}
